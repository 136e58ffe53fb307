//! Prompts per second, single and as a batch on all cores, beside the crate `instant-clip-tokenizer`.
//!
//! `cargo bench --no-default-features --bench tokenize` ends with the ratios of the two, measured in turns:
//! for the prompts of the paper's grid in every wording, and for random letters, which no cache knows.

use criterion::{Criterion, Throughput};
use rand::{RngExt, SeedableRng, rngs::StdRng};
use rayon::prelude::*;
use std::hint::black_box;
use std::time::Instant;
use wake_physics::reference::paper_grid;
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
fn grid() -> Vec<String> {
    paper_grid()
        .zip(Wording::ALL.into_iter().cycle())
        .map(|(scene, wording)| wording.prompt(&scene).expect("the grid is valid"))
        .collect()
}

/// Thirty words of 1 to 9 random letters a prompt.
fn random_letters() -> Vec<String> {
    let mut random = StdRng::seed_from_u64(1);
    let mut word = || -> String {
        let length = random.random_range(1..10);
        (0..length)
            .map(|_| random.random_range('a'..='z'))
            .collect()
    };
    let mut prompt = || (0..30).map(|_| word()).collect::<Vec<_>>().join(" ");
    (0..2000).map(|_| prompt()).collect()
}

/// The four things compared, each over all prompts.
struct Contest<'a> {
    prompts: &'a [String],
    other: instant_clip_tokenizer::Tokenizer,
}

impl Contest<'_> {
    fn ours(&self) {
        for prompt in self.prompts {
            black_box(ours(prompt));
        }
    }

    fn instant(&self) {
        for prompt in self.prompts {
            black_box(instant(&self.other, prompt));
        }
    }

    fn ours_batch(&self) {
        black_box(Tokenizer::clip().encode_batch(self.prompts));
    }

    fn instant_batch(&self) {
        let prompts = self.prompts.par_iter();
        let ids: Vec<Ids> = prompts.map(|p| instant(&self.other, p)).collect();
        black_box(ids);
    }

    /// Criterion's view of the four.
    fn measure(&self, criterion: &mut Criterion, name: &str) {
        let mut group = criterion.benchmark_group(name);
        group.throughput(Throughput::Elements(self.prompts.len() as u64));
        group.bench_function("wake-text", |b| b.iter(|| self.ours()));
        group.bench_function("instant-clip-tokenizer", |b| b.iter(|| self.instant()));
        group.bench_function("wake-text, batch", |b| b.iter(|| self.ours_batch()));
        group.bench_function("instant-clip-tokenizer, rayon", |b| {
            b.iter(|| self.instant_batch());
        });
        group.finish();
    }

    /// Prints the ratios.
    fn report(&self, name: &str) {
        let single = medians(|| self.ours(), || self.instant());
        let batch = medians(|| self.ours_batch(), || self.instant_batch());
        for (how, [ours, instant]) in [("single", single), ("batch on all cores", batch)] {
            println!(
                "{name}, {how}: wake-text {:.0} prompts/s, instant-clip-tokenizer {:.0} prompts/s, ratio {:.2}",
                self.prompts.len() as f64 / ours,
                self.prompts.len() as f64 / instant,
                instant / ours
            );
        }
    }
}

/// Median seconds of two functions, run in turns so that both see the same machine.
fn medians(first: impl Fn(), second: impl Fn()) -> [f64; 2] {
    let seconds = |f: &dyn Fn()| {
        let start = Instant::now();
        f();
        start.elapsed().as_secs_f64()
    };
    let mut times = [vec![], vec![]];
    for _ in 0..31 {
        times[0].push(seconds(&first));
        times[1].push(seconds(&second));
    }
    times.map(|mut times| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    })
}

fn main() {
    let start = Instant::now();
    Tokenizer::clip();
    println!("first call: {:.0} ms", 1e3 * start.elapsed().as_secs_f64());
    let mut criterion = Criterion::default().configure_from_args();
    let texts = [("paper grid", grid()), ("random letters", random_letters())];
    let contests = texts.each_ref().map(|(name, prompts)| {
        let other = instant_clip_tokenizer::Tokenizer::new();
        (*name, Contest { prompts, other })
    });
    for (name, contest) in &contests {
        contest.measure(&mut criterion, name);
    }
    criterion.final_summary();
    for (name, contest) in &contests {
        contest.report(name);
    }
}
