//! Prompts per second, single and as a batch on all cores, beside the crate `instant-clip-tokenizer`.
//!
//! `cargo bench --no-default-features --bench tokenize` ends with the ratio of the two, measured in turns.

use criterion::{Criterion, Throughput};
use rayon::prelude::*;
use std::hint::black_box;
use std::time::Instant;
use wake_physics::scene::paper_grid;
use wake_text::{TOKENS, Tokenizer, Wording};

/// What both tokenizers are asked for: 77 ids.
type Ids = [u32; TOKENS];

fn ours(prompt: &str) -> Ids {
    Tokenizer::clip().encode(prompt).ids
}

fn instant(tokenizer: &instant_clip_tokenizer::Tokenizer, prompt: &str) -> Ids {
    let mut tokens = vec![tokenizer.start_of_text()];
    tokenizer.encode(prompt, &mut tokens);
    tokens.truncate(TOKENS - 1);
    tokens.resize(TOKENS, tokenizer.end_of_text());
    std::array::from_fn(|i| u32::from(tokens[i].to_u16()))
}

/// The prompts of the paper's grid, in turn in each wording.
fn prompts() -> Vec<String> {
    paper_grid()
        .zip(Wording::ALL.into_iter().cycle())
        .map(|(scene, wording)| wording.prompt(&scene).expect("the grid is valid"))
        .collect()
}

fn compare(criterion: &mut Criterion, prompts: &[String]) {
    let other = instant_clip_tokenizer::Tokenizer::new();
    let mut single = criterion.benchmark_group("single");
    single.throughput(Throughput::Elements(prompts.len() as u64));
    single.bench_function("wake-text", |b| {
        b.iter(|| {
            for p in prompts {
                black_box(ours(p));
            }
        });
    });
    single.bench_function("instant-clip-tokenizer", |b| {
        b.iter(|| {
            for p in prompts {
                black_box(instant(&other, p));
            }
        });
    });
    single.finish();
    let mut batch = criterion.benchmark_group("batch on all cores");
    batch.throughput(Throughput::Elements(prompts.len() as u64));
    batch.bench_function("wake-text", |b| {
        b.iter(|| Tokenizer::clip().encode_batch(prompts));
    });
    batch.bench_function("instant-clip-tokenizer with rayon", |b| {
        b.iter(|| -> Vec<Ids> { prompts.par_iter().map(|p| instant(&other, p)).collect() });
    });
    batch.finish();
}

/// Median seconds of two functions, run in turns so that both see the same machine.
fn medians(mut first: impl FnMut(), mut second: impl FnMut()) -> [f64; 2] {
    let seconds = |f: &mut dyn FnMut()| {
        let start = Instant::now();
        f();
        start.elapsed().as_secs_f64()
    };
    let mut times = [vec![], vec![]];
    for _ in 0..31 {
        times[0].push(seconds(&mut first));
        times[1].push(seconds(&mut second));
    }
    times.map(|mut times| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    })
}

fn report(what: &str, count: usize, [ours, instant]: [f64; 2]) {
    println!(
        "{what}: wake-text {:.0} prompts/s, instant-clip-tokenizer {:.0} prompts/s, ratio {:.2}",
        count as f64 / ours,
        count as f64 / instant,
        instant / ours
    );
}

fn main() {
    let start = Instant::now();
    Tokenizer::clip();
    println!("first call: {:.0} ms", 1e3 * start.elapsed().as_secs_f64());
    let prompts = prompts();
    let mut criterion = Criterion::default().configure_from_args();
    compare(&mut criterion, &prompts);
    criterion.final_summary();
    let other = instant_clip_tokenizer::Tokenizer::new();
    let single = medians(
        || {
            for p in &prompts {
                black_box(ours(p));
            }
        },
        || {
            for p in &prompts {
                black_box(instant(&other, p));
            }
        },
    );
    let batch = medians(
        || drop(black_box(Tokenizer::clip().encode_batch(&prompts))),
        || {
            drop(black_box(
                prompts
                    .par_iter()
                    .map(|p| instant(&other, p))
                    .collect::<Vec<_>>(),
            ))
        },
    );
    report("single", prompts.len(), single);
    report("batch on all cores", prompts.len(), batch);
}
