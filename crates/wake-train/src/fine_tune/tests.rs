//! A toy Stable Diffusion learns one image by heart.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use burn::module::Module;
use burn::tensor::{Device, Int, Tensor};

use super::*;
use crate::tensors::values;
use crate::{Rate, TrainerOptions};
use wake_ldm::autoencoder::AutoencoderKlConfig;
use wake_ldm::scheduler::{BetaCurve, NoiseSchedule, Prediction, TerminalSnr};
use wake_ldm::text::ClipTextConfig;
use wake_ldm::unet::{UNet, UNetConfig};

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
    let curve = BetaCurve::ScaledLinear(0.00085, 0.012);
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
        schedule: NoiseSchedule::new(&curve, 1000, TerminalSnr::Zero).unwrap(),
    }
}

fn options(prediction: Prediction, peak: f64) -> FineTuneOptions {
    FineTuneOptions {
        prediction,
        snr_gamma: Some(5.0),
        seed: 1,
        identity: Value::Null,
        trainer: TrainerOptions {
            rate: Rate {
                peak,
                warmup: 2,
                steps: 100,
            },
            ..TrainerOptions::default()
        },
    }
}

fn batch(device: &Device) -> (Tensor<4>, Tensor<2, Int>) {
    let x = Tensor::<1, Int>::arange(0..(BATCH * 1024) as i64, device).float();
    let images = (x * 0.37).sin().reshape([BATCH, 1, 32, 32]);
    let ids = Tensor::<1, Int>::arange(0..(BATCH * 4) as i64, device).reshape([BATCH, 4]);
    (images, ids)
}

fn losses(run: &mut FineTune, steps: usize) -> Vec<f64> {
    let step = |_| {
        let (images, ids) = batch(&Device::flex());
        let report = run.step(images, ids).unwrap();
        assert!(report.applied && report.loss.is_finite());
        report.loss
    };
    (0..steps).map(step).collect()
}

#[test]
fn noise_and_velocity_are_learnt() {
    let device = Device::flex();
    for prediction in [Prediction::Epsilon, Prediction::Velocity] {
        let (unet, parts) = (unet(&device), frozen(&device));
        let run = |peak: f64| {
            let parts = Frozen {
                text: parts.text.clone(),
                autoencoder: parts.autoencoder.clone(),
                schedule: parts.schedule.clone(),
            };
            let options = options(prediction, peak);
            FineTune::whole(unet.clone(), parts, options, &device.clone().autodiff()).unwrap()
        };
        // Both see the same draws, one of them with steps too small to learn: step by step, only what is learnt differs.
        let (learning, idle) = (losses(&mut run(5e-3), 100), losses(&mut run(1e-12), 100));
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
    let autodiff = device.clone().autodiff();
    let base = unet(&device);
    let options = options(Prediction::Epsilon, 2e-2);
    let mut run = FineTune::low_rank(base.clone(), 2, frozen(&device), options, &autodiff).unwrap();
    let before = values(&base);
    for _ in 0..4 {
        let (images, ids) = batch(&device);
        assert!(run.step(images, ids).unwrap().norm > 0.0);
    }
    let changed = run.changes().unwrap();
    assert!(changed.num_params() < base.num_params() / 4);
    let differ = |a: &Tensor<1>, b: &Tensor<1>| {
        (a.clone() - b.clone()).abs().max().into_scalar::<f32>() > 0.0
    };
    let after = values(&run.unet());
    let different = before
        .iter()
        .zip(&after)
        .filter(|(a, b)| differ(a, b))
        .count();
    assert_eq!(different, changed.layers().len());
}

#[test]
fn a_killed_run_goes_on_to_the_bit() {
    let device = Device::flex();
    let autodiff = device.clone().autodiff();
    let (base, parts) = (unet(&device), frozen(&device));
    for rank in [None, Some(2)] {
        let run = |seed: u64| {
            let parts = Frozen {
                text: parts.text.clone(),
                autoencoder: parts.autoencoder.clone(),
                schedule: parts.schedule.clone(),
            };
            let options = FineTuneOptions {
                seed,
                ..options(Prediction::Epsilon, 1e-2)
            };
            let unet = base.clone();
            match rank {
                None => FineTune::whole(unet, parts, options, &autodiff).unwrap(),
                Some(rank) => FineTune::low_rank(unet, rank, parts, options, &autodiff).unwrap(),
            }
        };
        let folder = tempfile::tempdir().unwrap();
        let mut whole = run(1);
        losses(&mut whole, 2);
        whole.checkpoint(folder.path()).unwrap();
        let newest = || Checkpoint::newest(folder.path()).unwrap().unwrap();
        let mut second = run(1);
        second.resume(newest()).unwrap();
        assert_eq!(second.steps(), 2);
        assert_eq!(
            losses(&mut whole, 3),
            losses(&mut second, 3),
            "rank {rank:?}"
        );
        let refused = run(2).resume(newest()).unwrap_err().to_string();
        assert!(
            refused.contains("seed = 1") && refused.contains("expected 2"),
            "{refused}"
        );
    }
}

#[test]
fn weights_at_each_signal_to_noise_ratio_are_the_closed_form() {
    let snr = [0.0, 0.5, 5.0, 20.0, 1e6];
    let noise = min_snr_weights(&snr, 5.0, Prediction::Epsilon);
    let velocity = min_snr_weights(&snr, 5.0, Prediction::Velocity);
    // The sample's error is the noise's times the ratio: x₀ = (x − √(1 − ᾱ) n)/√ᾱ.
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

/// √ᾱ mixes noise in, which is not the straight line that a flow is the slope of.
#[test]
fn the_prediction_of_a_flow_and_useless_rates_are_refused() {
    let device = Device::flex();
    for (prediction, peak, word) in [
        (Prediction::Flow, 1e-3, "flow"),
        (Prediction::Epsilon, 0.0, "rate is 0"),
        (Prediction::Epsilon, f64::NAN, "rate is NaN"),
        (Prediction::Epsilon, 1e300, "rate is 1"),
    ] {
        let learning = device.clone().autodiff();
        let run = FineTune::whole(
            unet(&device),
            frozen(&device),
            options(prediction, peak),
            &learning,
        );
        let refused = run.expect_err("a refusal").to_string();
        assert!(refused.contains(word), "{refused}");
    }
}
