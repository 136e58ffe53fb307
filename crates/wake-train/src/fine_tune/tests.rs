//! A toy latent diffusion model is fine-tuned on four images.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::Path;

use burn::module::Module;
use burn::tensor::{Device, Tensor};
use serde_json::{Value, json};
use wake_dataset::Grey;

use super::batches::Prompted;
use super::*;
use crate::tensors::values;
use crate::{Checkpoint, LrSchedule, Run, RunOptions, TrainerOptions};
use wake_ldm::autoencoder::AutoencoderKlConfig;
use wake_ldm::scheduler::{BetaCurve, NoiseSchedule, Prediction, TerminalSnr};
use wake_ldm::text::ClipTextConfig;
use wake_ldm::unet::UNetConfig;
use wake_nn::weights::Layout;

const BATCH: usize = 4;

fn unet(device: &Device) -> UNet {
    let config = UNetConfig::small(2, Some(8), None)
        .with_block_out_channels(vec![8, 16])
        .with_down_attention(vec![false, true])
        .with_up_attention(vec![true, false])
        .with_heads(vec![1, 2])
        .with_norm_groups(4);
    config.init(device)
}

fn frozen(device: &Device) -> Frozen {
    let text = ClipTextConfig::new()
        .with_vocab_size(16)
        .with_hidden_size(8)
        .with_intermediate_size(16)
        .with_layers(1)
        .with_heads(1);
    Frozen {
        text: text.init(device),
        autoencoder: AutoencoderKlConfig::small(2, 2)
            .with_block_out_channels(vec![8, 8])
            .with_norm_groups(4)
            .init(device),
    }
}

fn schedule() -> NoiseSchedule {
    let curve = BetaCurve::ScaledLinear(0.00085, 0.012);
    NoiseSchedule::new(&curve, 1000, TerminalSnr::Zero).unwrap()
}

/// Four waves in turn, each with its own prompt.
#[derive(Debug)]
struct Waves;

impl PromptedSource for Waves {
    fn at(&self, position: u64) -> Result<Prompted> {
        let number = position % BATCH as u64;
        let wave = (0..1024u64).map(|n| 0.5 + 0.5 * (0.37 * (1024 * number + n) as f32).sin());
        let ids = (0..4).map(|n| (4 * number + n) as i32);
        let image = Grey {
            rows: 32,
            columns: 32,
            pixels: wave.collect(),
        };
        Ok(Prompted {
            image,
            ids: ids.collect(),
        })
    }
}

fn options(peak: f64, accumulation: usize) -> RunOptions {
    RunOptions {
        batch: BATCH,
        seed: 1,
        identity: Value::Null,
        trainer: TrainerOptions {
            rate: LrSchedule {
                peak,
                warmup: 2,
                steps: 100,
            },
            grad_accumulation_steps: accumulation,
            ..TrainerOptions::default()
        },
    }
}

fn learning(workers: usize) -> Vec<Device> {
    vec![Device::flex().autodiff(); workers]
}

fn task(prediction: Prediction, frozen: &Frozen) -> FineTuneTask<Waves> {
    let task = FineTuneTask::new(Waves, frozen, (schedule(), prediction), 1, &learning(1));
    task.unwrap().with_snr_gamma(Some(5.0))
}

fn whole(unet: &UNet, options: RunOptions, workers: usize) -> Run<UNet> {
    let unet = unet.clone();
    Run::of(
        "whole",
        &json!({}),
        |_| unet.train(),
        options,
        learning(workers),
    )
    .unwrap()
}

fn low_rank(unet: &UNet, options: RunOptions) -> Run<LowRank> {
    let devices = learning(1);
    devices[0].seed(options.seed);
    let base = unet.clone().no_grad().train().fork(&devices[0]);
    let changes = LowRank::of_attentions(&base, Layout::Diffusers, 2).unwrap();
    Run::of("changes", &json!({}), |_| changes, options, devices).unwrap()
}

fn losses<M: Module>(run: &mut Run<M>, task: &impl Task<M>, steps: usize) -> Vec<f64> {
    let step = |_| {
        let (report, _) = run.step(task).unwrap();
        assert!(report.applied && report.loss.is_finite());
        report.loss
    };
    (0..steps).map(step).collect()
}

#[test]
fn noise_and_velocity_are_learnt() {
    let device = Device::flex();
    for prediction in [Prediction::Epsilon, Prediction::Velocity] {
        let (unet, task) = (unet(&device), task(prediction, &frozen(&device)));
        let of = |peak: f64| losses(&mut whole(&unet, options(peak, 1), 1), &task, 100);
        // Both have the same draws, and one a learning rate too small to learn: only what is learnt differs, step by step.
        let (learning, idle) = (of(5e-3), of(1e-12));
        let gains: Vec<f64> = idle
            .iter()
            .zip(&learning)
            .map(|(a, b)| a - b)
            .skip(60)
            .collect();
        let count = gains.len() as f64;
        let mean = gains.iter().sum::<f64>() / count;
        let squares: f64 = gains.iter().map(|gain| (gain - mean).powi(2)).sum();
        let error = (squares / (count * (count - 1.0))).sqrt();
        assert!(mean > 3.0 * error, "{prediction:?}: {mean} ± {error}");
    }
}

#[test]
fn low_rank_changes_leave_the_model_as_it_is() {
    let device = Device::flex();
    let base = unet(&device);
    let task = task(Prediction::Epsilon, &frozen(&device)).with_base(&base);
    let mut run = low_rank(&base, options(2e-2, 1));
    let before = values(&base);
    losses(&mut run, &task, 4);
    let changed = run.averaged();
    assert!(changed.num_params() < base.num_params() / 4);
    let differ = |a: &Tensor<1>, b: &Tensor<1>| {
        (a.clone() - b.clone()).abs().max().into_scalar::<f32>() > 0.0
    };
    let after = values(&changed.merged(base));
    let different = before
        .iter()
        .zip(&after)
        .filter(|(a, b)| differ(a, b))
        .count();
    assert_eq!(different, changed.layers().len());
}

/// Losses and gradient norms of three steps.
fn curve<M: Module>(mut run: Run<M>, task: &impl Task<M>) -> Vec<f64> {
    let step = |_| {
        let (report, _) = run.step(task).unwrap();
        [report.loss, report.norm]
    };
    (0..3).flat_map(step).collect()
}

/// Four images at once, one after the other, and on two devices.
#[test]
fn parts_of_a_batch_make_the_step_of_the_whole() {
    let device = Device::flex();
    let (base, frozen) = (unet(&device), frozen(&device));
    let task = task(Prediction::Epsilon, &frozen).with_base(&base);
    let near = |one: &[f64], other: &[f64]| {
        for (a, b) in one.iter().zip(other) {
            // Sums of some thousand f32 terms in another order, with cancellation.
            assert!((a - b).abs() < 1e-4 * a, "{one:?} {other:?}");
        }
    };
    let of = |workers, parts| curve(whole(&base, options(1e-3, parts), workers), &task);
    let one = of(1, 1);
    for (workers, parts) in [(1, 4), (2, 1), (2, 2)] {
        near(&one, &of(workers, parts));
    }
    let [one, other] = [1, 4].map(|parts| curve(low_rank(&base, options(1e-3, parts)), &task));
    near(&one, &other);
}

/// A part is computed from its own images alone, so memory falls with the number of parts.
#[test]
fn a_part_holds_its_own_images_alone() {
    let frozen = frozen(&Device::flex());
    let task = task(Prediction::Epsilon, &frozen);
    let whole: PromptedBatch = Task::<UNet>::batch(&task, 0..4).unwrap();
    let part = Task::<UNet>::batch(&task, 2..3).unwrap();
    assert_eq!(part.steps.len(), 1);
    assert_eq!((whole.steps.len(), part.steps[0]), (4, whole.steps[2]));
    let pixels: Vec<f32> = whole
        .images
        .iter::<f32>()
        .skip(2 * 1024)
        .take(1024)
        .collect();
    assert_eq!(part.images.iter::<f32>().collect::<Vec<_>>(), pixels);
}

/// A data set of four pairs, of which a share is for validation.
fn four_pairs(folder: &Path, val_share: f64) -> wake_dataset::Folder {
    let recipe = wake_dataset::Recipe::default();
    let recipe = recipe.with_assignments(&["scene.grid.rows = 32", "scene.grid.columns = 32"]);
    let manifest = wake_dataset::Manifest::new(recipe.unwrap(), 3, 4).unwrap();
    let manifest = manifest.with_val_share(val_share).unwrap();
    let source = manifest.source().unwrap();
    wake_dataset::write(folder, &manifest, &source, 1, |_| ()).unwrap();
    wake_dataset::Folder::open(folder).unwrap()
}

/// If all images but one are for validation, only that one is drawn.
#[test]
fn pairs_for_validation_are_not_learnt_from() {
    let folder = tempfile::tempdir().unwrap();
    let folder = four_pairs(folder.path(), 0.75);
    let [position] = folder.trainset()[..] else {
        panic!("{:?}", folder.trainset());
    };
    let learnt = folder.pair(position).unwrap().image;
    let pairs = PromptedPairs::new(&folder, None, 5);
    assert!((0..32).all(|position| pairs.at(position).unwrap().image == learnt));
}

#[test]
fn all_pairs_are_learnt_from() {
    let folder = tempfile::tempdir().unwrap();
    let folder = four_pairs(folder.path(), 0.0);
    let pairs = PromptedPairs::new(&folder, None, 5);
    let drawn: Vec<_> = (0..64).map(|at| pairs.at(at).unwrap().image).collect();
    // One of four is missed with a probability of 4 · 0.75⁶⁴ = 4e-8.
    for position in 0..4 {
        let learnt = folder.pair(position).unwrap().image;
        assert!(drawn.contains(&learnt), "{position}");
    }
}

#[test]
fn a_killed_run_goes_on_to_the_bit() {
    let device = Device::flex();
    let (base, frozen) = (unet(&device), frozen(&device));
    let task = task(Prediction::Epsilon, &frozen).with_base(&base);
    let seeded = |seed| RunOptions {
        seed,
        ..options(1e-2, 1)
    };
    goes_on(&task, |seed| whole(&base, seeded(seed), 1));
    goes_on(&task, |seed| low_rank(&base, seeded(seed)));
}

fn goes_on<M: Module>(task: &impl Task<M>, run: impl Fn(u64) -> Run<M>) {
    let folder = tempfile::tempdir().unwrap();
    let mut whole = run(1);
    losses(&mut whole, task, 2);
    whole.checkpoint(folder.path(), 2).unwrap();
    let newest = || Checkpoint::newest(folder.path()).unwrap().unwrap();
    let mut second = run(1);
    second.resume(newest()).unwrap();
    assert_eq!(second.steps(), 2);
    assert_eq!(losses(&mut whole, task, 3), losses(&mut second, task, 3));
    let refused = run(2).resume(newest()).unwrap_err().to_string();
    assert!(
        refused.contains("seed = 1") && refused.contains("expected 2"),
        "{refused}"
    );
}

#[test]
fn weights_at_each_signal_to_noise_ratio_are_the_closed_form() {
    let snr = [0.0, 0.5, 5.0, 20.0, 1e6];
    let noise = min_snr_weights(&snr, 5.0, Prediction::Epsilon);
    let velocity = min_snr_weights(&snr, 5.0, Prediction::Velocity);
    // The sample's weight is the noise's times the ratio: x₀ = (x − √(1 − ᾱ) n)/√ᾱ.
    let sample = min_snr_weights(&snr, 5.0, Prediction::Sample);
    for ((sample, noise), snr) in sample.iter().zip(&noise).zip(snr) {
        assert!(
            (sample - noise * snr).abs() < 1e-12 * (1.0 + snr),
            "{sample} {noise} {snr}"
        );
    }
    let expected = [
        (1.0, 0.0),
        (1.0, 0.5 / 1.5),
        (1.0, 5.0 / 6.0),
        (0.25, 5.0 / 21.0),
        (5e-6, 5.0 / (1e6 + 1.0)),
    ];
    for ((a, b), (c, d)) in noise.iter().zip(&velocity).zip(expected) {
        assert!((a - c).abs() < 1e-12 && (b - d).abs() < 1e-12);
    }
}

/// √ᾱ does not mix noise and image linearly, as flow prediction needs.
#[test]
fn the_prediction_of_a_flow_is_refused() {
    let (frozen, how) = (frozen(&Device::flex()), (schedule(), Prediction::Flow));
    let refused = FineTuneTask::new(Waves, &frozen, how, 1, &learning(1));
    let refused = refused.expect_err("a refusal").to_string();
    assert!(refused.contains("flow"), "{refused}");
}

#[test]
fn useless_rates_are_refused() {
    let base = unet(&Device::flex());
    for (peak, word) in [
        (0.0, "rate is 0"),
        (f64::NAN, "rate is NaN"),
        (1e300, "rate is 1"),
    ] {
        let init = |_: &Device| base.clone().train();
        let run = Run::of("whole", &json!({}), init, options(peak, 1), learning(1));
        let refused = run.expect_err("a refusal").to_string();
        assert!(refused.contains(word), "{refused}");
    }
}
