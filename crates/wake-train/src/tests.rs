//! A toy model goes through everything that a real run does.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod numbers;

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use burn::module::Module;
use burn::tensor::{DType, Device, Tensor};
use serde_json::{Value, json};

use super::trainer::Trainer;
use super::*;
use crate::latents::LatentSet;
use crate::prompts::Prompts;
use crate::tasks::{FlowTask, ParserTask, PriorTask};
use wake_dataset::{Recipe, Simulated};
use wake_ldm::conditioning::{Vocabulary, statement, tokens};
use wake_ldm::network::{Flow, PatchTransform, PhysicsPrior, WakeModelConfig, windows};

const SIZE: usize = 32;

fn config() -> WakeModelConfig {
    WakeModelConfig {
        image_size: SIZE,
        latent_channels: 4,
        widths: vec![16, 32],
        text_width: 16,
        prior_width: 16,
        map_channels: 8,
        norm_groups: 8,
        ..WakeModelConfig::standard(&Vocabulary::new([1, 2]))
    }
}

/// Latents of waves whose direction is the ship's heading, and the transform that encodes them.
fn set() -> (LatentSet, PatchTransform) {
    let device = Device::flex();
    let wave = |i: usize| -> Vec<f32> {
        let (sin, cos) = (i as f64).sin_cos();
        let at = |p: usize| ((p / SIZE) as f64 * sin + (p % SIZE) as f64 * cos) * 0.8;
        (0..SIZE * SIZE)
            .map(|p| (0.5 + 0.1 * at(p).sin()) as f32)
            .collect()
    };
    let images: Vec<Vec<f32>> = (0..12).map(wave).collect();
    let (transform, _) = PatchTransform::fit(images.iter().map(Vec::as_slice), SIZE, 4, &device);
    let mut set = LatentSet::default();
    for (i, image) in images.into_iter().enumerate() {
        let mut scene = config().base_scene();
        let ship = &mut scene.ships[0];
        (ship.speed, ship.heading) = (8.0, (i as f64).to_degrees());
        // The expected image has half of the wave's amplitude.
        let physics = PhysicsPrior {
            grey: image.iter().map(|g| 0.5 + 0.5 * (g - 0.5)).collect(),
            log_deviations: vec![0.0; 4],
        };
        set.extend(&transform, vec![(image, physics, scene)])
            .unwrap();
    }
    (set, transform)
}

fn options(accumulation: usize) -> RunOptions {
    RunOptions {
        batch: 4,
        seed: 5,
        identity: Value::Null,
        trainer: TrainerOptions {
            rate: LrSchedule {
                peak: 3e-3,
                warmup: 3,
                steps: 40,
            },
            grad_accumulation_steps: accumulation,
            ..TrainerOptions::default()
        },
    }
}

fn run(workers: usize, accumulation: usize) -> Run<Flow> {
    let devices = vec![Device::flex().autodiff(); workers];
    let init = |device: &Device| config().init_flow(device);
    Run::of(
        "flow",
        &json!(config()),
        init,
        options(accumulation),
        devices,
    )
    .unwrap()
}

/// Resumes a run from a checkpoint.
fn resumed(workers: usize, accumulation: usize, checkpoint: &Checkpoint) -> Run<Flow> {
    let mut run = run(workers, accumulation);
    run.resume(checkpoint.clone()).unwrap();
    run
}

/// Tensors of a run's checkpoint.
fn weights(run: &Run<Flow>, folder: &Path) -> Tensors {
    run.checkpoint(folder, 2).unwrap();
    Checkpoint::newest(folder).unwrap().unwrap().tensors
}

fn advance(
    run: &mut Run<Flow>,
    (set, patches): &(LatentSet, PatchTransform),
    steps: usize,
) -> Vec<f64> {
    let task = FlowTask {
        set,
        patches,
        seed: 5,
    };
    (0..steps)
        .map(|_| run.step(&task).unwrap().0.loss)
        .collect()
}

/// Common start of several runs: random initialisation draws from a generator that other tests share.
fn start(folder: &Path) -> Checkpoint {
    run(1, 1).checkpoint(folder, 2).unwrap();
    Checkpoint::newest(folder).unwrap().unwrap()
}

#[test]
fn a_killed_run_gives_the_same_curve_to_the_bit() {
    let (set, folder) = (set(), tempfile::tempdir().unwrap());
    let start = start(&folder.path().join("start"));
    let mut whole = resumed(1, 1, &start);
    let curve = advance(&mut whole, &set, 6);
    let mut first = resumed(1, 1, &start);
    let mut pieces = advance(&mut first, &set, 3);
    first.checkpoint(&folder.path().join("half"), 2).unwrap();
    drop(first);
    let half = Checkpoint::newest(&folder.path().join("half"))
        .unwrap()
        .unwrap();
    let mut second = resumed(1, 1, &half);
    pieces.extend(advance(&mut second, &set, 3));
    assert_eq!(curve, pieces);
    let (a, b) = (folder.path().join("a"), folder.path().join("b"));
    assert_eq!(weights(&whole, &a), weights(&second, &b));
}

#[test]
fn two_workers_and_two_parts_make_the_step_of_one() {
    let (set, folder) = (set(), tempfile::tempdir().unwrap());
    let start = start(&folder.path().join("start"));
    let after = |workers: usize, accumulation: usize| {
        let mut run = resumed(workers, accumulation, &start);
        let losses = advance(&mut run, &set, 2);
        let name = format!("{workers}-{accumulation}");
        (losses, weights(&run, &folder.path().join(name)))
    };
    let (losses, one) = after(1, 1);
    for (workers, accumulation) in [(2, 1), (1, 2), (2, 2)] {
        let (other_losses, other) = after(workers, accumulation);
        for (a, b) in losses.iter().zip(&other_losses) {
            // Means of some thousand f32 terms in another order.
            assert!((a - b).abs() < 1e-5 * a.abs(), "{a} {b}");
        }
        for (name, (_, numbers)) in one.iter().filter(|(name, _)| name.starts_with("first.")) {
            let largest = numbers.iter().fold(0f32, |m, x| m.max(x.abs()));
            let differences = numbers
                .iter()
                .zip(&other[name].1)
                .map(|(a, b)| (a - b).abs());
            // Gradients are sums over batch and pixels with cancellation: a few thousand roundings.
            let allowed = 1e-3 * largest + 1e-7;
            assert!(
                differences.fold(0f32, f32::max) <= allowed,
                "{name} {largest}"
            );
        }
    }
}

/// Means of the first and the last five losses.
fn early_and_late(losses: &[f64]) -> [f64; 2] {
    assert!(losses.iter().all(|loss| loss.is_finite()), "{losses:?}");
    let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
    [mean(&losses[..5]), mean(&losses[losses.len() - 5..])]
}

#[test]
fn the_loss_of_the_flow_falls() {
    let losses = advance(&mut run(1, 1), &set(), 150);
    let [early, late] = early_and_late(&losses);
    // The first losses are the variance of the velocity; the mean of five, over 1,280 squares, has a relative error of 0.04.
    assert!(late < 0.8 * early, "{early} {late}");
}

#[test]
fn sixteen_bits_learn_as_32_bits_do() {
    let (set, folder) = (set(), tempfile::tempdir().unwrap());
    let start = start(folder.path());
    let losses = |bf16: bool| {
        let devices = vec![Device::flex().autodiff()];
        let init = |device: &Device| config().init_flow(device);
        let mut options = options(1);
        options.trainer.bf16 = bf16;
        let mut run = Run::of("flow", &json!(config()), init, options, devices).unwrap();
        // The same weights for both; a run cannot be resumed with another precision otherwise.
        let mut start = start.clone();
        start.state["trainer"]["bf16"] = bf16.into();
        run.resume(start).unwrap();
        let losses = advance(&mut run, &set, 40);
        assert_eq!(run.averaged().dtype(), DType::F32);
        losses
    };
    let (wide, narrow) = (losses(false), losses(true));
    // Eight bits of mantissa and a dozen layers: an error of 2⁻⁸ √12 of the velocity in one forward pass.
    assert!((wide[0] - narrow[0]).abs() < 0.014 * wide[0]);
    let [[early, late], [_, other]] = [&wide, &narrow].map(|losses| early_and_late(losses));
    // Rounding makes the two diverge, but their losses fall alike.
    assert!(
        late < 0.9 * early && (other - late).abs() < 0.25 * (early - late),
        "{early} {late} {other}"
    );
    assert!(wide != narrow);
}

#[test]
fn a_prior_learns_a_mean_that_leaves_residuals_of_variance_one() {
    let (set, _) = set();
    let device = Device::flex();
    let init = |device: &Device| config().init_prior(device);
    let mut run = Run::of(
        "prior",
        &json!(config()),
        init,
        options(1),
        vec![device.autodiff()],
    )
    .unwrap();
    let task = PriorTask { set: &set, seed: 5 };
    let steps: Vec<(StepReport, Terms)> = (0..300).map(|_| run.step(&task).unwrap()).collect();
    let losses: Vec<f64> = steps.iter().map(|(report, _)| report.loss).collect();
    let [_, late] = early_and_late(&losses);
    // Latents have variance 1: both terms of the loss are ½ for a prior that has learnt nothing else.
    assert!(late < 0.9, "{late}");
    let count = set.len();
    let done = AtomicUsize::new(0);
    let residuals = set.residuals(&run.averaged(), |n| {
        done.fetch_add(n, Relaxed);
    });
    assert_eq!(done.into_inner(), count);
    let all: Vec<usize> = (0..count).collect();
    let squares = residuals.latents(&all, &Device::flex()).square().mean();
    let variance = squares.into_scalar::<f32>();
    // A fitted deviation σ has a loss of ½ + ln σ: residuals not divided by it would have the variance σ², and latents divided
    // by it without the mean subtracted 1/σ². Averaged weights lag behind the last ones.
    let undivided = (2.0 * (late - 0.5)).exp();
    assert!(undivided < 0.01, "{undivided}");
    assert!((0.3..3.0).contains(&variance), "{variance}");
}

#[test]
fn a_reader_learns_to_tell_prompts_apart() {
    let prompts = Prompts::new(Simulated::new(Recipe::default(), 3).unwrap());
    let ids = (0..8).flat_map(|i| tokens(&prompts.prompt(i).unwrap().0));
    let vocabulary = Vocabulary::new(ids);
    let config = WakeModelConfig {
        vocabulary: vocabulary.known().to_vec(),
        ..config()
    };
    let init = |device: &Device| config.init_parser(device);
    let devices = vec![Device::flex().autodiff()];
    // As long as the run: a schedule of 40 steps leaves a parser that has hardly learnt, and a result that depends on a
    // machine's rounding.
    let mut options = options(1);
    options.trainer.rate.steps = 300;
    let mut run = Run::of("parser", &json!(config), init, options, devices).unwrap();
    let task = ParserTask {
        prompts: &prompts,
        vocabulary: &vocabulary,
    };
    let losses: Vec<f64> = (0..300).map(|_| run.step(&task).unwrap().0.loss).collect();
    let [early, late] = early_and_late(&losses);
    assert!(late < 0.6 * early, "{early} {late}");
    // Unseen prompts, compared with what they state and with what the next one states: a parser that ignores the words is
    // equally wrong in both.
    let device = Device::flex();
    let (texts, said): (Vec<_>, Vec<_>) = (1000..1064)
        .map(|i| prompts.prompt(i).unwrap())
        .map(|(text, conditions)| (tokens(&text), statement(&conditions)))
        .unzip();
    let count = said.len();
    let (windows, length) = windows(&texts, &vocabulary, &device);
    let read = run.averaged().forward(windows, length).into_data();
    let read: Vec<f32> = read.iter::<f32>().collect();
    let error = |shift: usize| -> f64 {
        let others = (0..count).flat_map(|i| &said[(i + shift) % count]);
        let squares = read
            .iter()
            .zip(others)
            .map(|(a, b)| f64::from(a - b).powi(2));
        squares.sum::<f64>() / read.len() as f64
    };
    // 64 prompts of 21 numbers: for a parser that ignores the words the ratio is 1 to about 3 %; 10 % is three times that.
    assert!(error(0) < 0.9 * error(1), "{} {}", error(0), error(1));
}

#[test]
fn a_checkpoint_of_another_model_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let start = start(folder.path());
    let other = WakeModelConfig {
        map_channels: 16,
        ..config()
    };
    let devices = vec![Device::flex().autodiff()];
    let init = |device: &Device| config().init_flow(device);
    let mut other = Run::of(
        "flow",
        &json!(other),
        |device| other.init_flow(device),
        options(1),
        devices.clone(),
    )
    .unwrap();
    assert!(other.resume(start.clone()).is_err());
    let mut renamed = Run::of("other", &json!(config()), init, options(1), devices).unwrap();
    assert!(renamed.resume(start.clone()).is_err());
    let mut broken = start;
    broken.tensors.pop_last();
    assert!(run(1, 1).resume(broken).is_err());
}

#[test]
fn long_gradients_are_shortened_to_the_largest_norm() {
    let mut trainer = of_a_plane(1);
    // The gradient of 30 w₀ + 40 w₁ has the norm 50.
    let report = trainer.step(|layer, device, _| {
        let slope = Tensor::<2>::from_floats([[30.0], [40.0]], device);
        (layer.weight.val() * slope).sum()
    });
    assert!((report.norm - 50.0).abs() < 1e-4);
    let first = trainer.state()[2][0].clone().into_data();
    let expected = [0.1 * 30.0 / 50.0, 0.1 * 40.0 / 50.0];
    for (found, expected) in first.iter::<f64>().zip(expected) {
        assert!((found - expected).abs() < 1e-6, "{found} {expected}");
    }
    let before = trainer.model().clone();
    let broken = trainer.step(|layer, _, _| (layer.weight.val() * f32::NAN).sum());
    assert!(!broken.applied);
    let same = (before.weight.val() - trainer.model().weight.val())
        .abs()
        .sum();
    assert!(same.into_scalar::<f32>() < f32::MIN_POSITIVE);
    assert_eq!(trainer.model().num_params(), 2);
}

/// Gradient checkpointing changes no step; weights keep it after a step, beside data on its device.
#[test]
fn checkpointing_changes_no_step() {
    let device = Device::flex().autodiff();
    let weights = [device.clone(), device.gradient_checkpointing()].map(|device| {
        let mut trainer = of_a_plane_on(device, 2);
        for _ in 0..2 {
            let report = trainer.step(|layer, device, _| {
                let point = Tensor::<2>::from_floats([[0.3], [-2.0]], device);
                (layer.weight.val() * point).sum().exp()
            });
            assert!(report.applied);
        }
        trainer.model().weight.val().into_data()
    });
    assert_eq!(weights[0], weights[1]);
}

/// A trainer of two weights under the loss w₀ + w₁, whose gradient is the same in every step.
fn of_a_plane(steps: usize) -> Trainer<burn::nn::Linear> {
    of_a_plane_on(Device::flex().autodiff(), steps)
}

fn of_a_plane_on(device: Device, steps: usize) -> Trainer<burn::nn::Linear> {
    let layer = burn::nn::LinearConfig::new(2, 1)
        .with_bias(false)
        .with_initializer(burn::nn::Initializer::Constant { value: 0.5 })
        .init(&device);
    let options = TrainerOptions {
        rate: LrSchedule {
            peak: 1e-2,
            warmup: 0,
            steps,
        },
        adam: AdamOptions {
            weight_decay: 0.0,
            ..AdamOptions::default()
        },
        ..TrainerOptions::default()
    };
    Trainer::new(layer, options, vec![device])
}

fn first_weight(trainer: &Trainer<burn::nn::Linear>) -> f64 {
    let weights = trainer.model().weight.val().into_data();
    weights.iter::<f64>().next().unwrap()
}

/// With a constant gradient each step of Adam is as long as its rate, if its number counts only the steps that were made:
/// 1 − βᵗ cancels in both averages. A lost step moves nothing and is not counted.
#[test]
fn a_step_that_is_lost_counts_for_nobody() {
    let mut trainer = of_a_plane(10);
    let start = first_weight(&trainer);
    let mut moved = 0.0;
    for factor in [1.0, f32::NAN, 1.0, f32::INFINITY, 1.0] {
        let before = first_weight(&trainer);
        let report = trainer.step(|layer, _, _| (layer.weight.val() * factor).sum());
        assert_eq!(report.applied, factor.is_finite());
        if report.applied {
            moved += report.rate;
        } else {
            assert_eq!(first_weight(&trainer).to_bits(), before.to_bits());
        }
    }
    assert_eq!(trainer.steps(), 5);
    // Rounding of 32-bit weights below 1: 6e-8 per step; ε is 1e-8 beside a clipped gradient of 0.7.
    let found = start - first_weight(&trainer);
    assert!((found - moved).abs() < 5e-7, "{found} {moved}");
}

#[test]
fn a_run_without_a_finite_step_ends_as_an_error() {
    let mut lost = of_a_plane(3);
    for _ in 0..3 {
        assert!(lost.check().is_ok());
        lost.step(|layer, _, _| (layer.weight.val() * f32::NAN).sum());
    }
    let error = lost.check().unwrap_err().to_string();
    assert!(error.contains("3 steps"), "{error}");
    let mut found = of_a_plane(3);
    for factor in [f32::NAN, 1.0, f32::NAN] {
        found.step(|layer, _, _| (layer.weight.val() * factor).sum());
    }
    assert!(found.check().is_ok());
}
