//! A toy Stable Diffusion learns one image by heart.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use burn::module::Module;
use burn::tensor::{Device, Int, Tensor};

use super::fine_tune::{FineTune, FineTuneOptions, Frozen};
use super::*;
use crate::autoencoder::AutoencoderKlConfig;
use crate::scheduler::{BetaCurve, NoiseSchedule, Prediction, TerminalSnr};
use crate::text::ClipTextConfig;
use crate::unet::{UNet, UNetConfig};

const BATCH: usize = 4;

fn unet(device: &Device) -> UNet {
    let config = UNetConfig::small(2, 8, None)
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
        trainer: TrainerOptions {
            rate: Rate {
                peak,
                warmup: 2,
                steps: 200,
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

fn falls(mut run: FineTune, steps: usize) {
    let losses: Vec<f64> = (0..steps)
        .map(|_| {
            let (images, ids) = batch(&Device::flex());
            let report = run.step(images, ids);
            assert!(report.applied && report.loss.is_finite());
            report.loss
        })
        .collect();
    // Each step draws its own noise: what is learnt must show above the scatter of the losses.
    let (early, late) = (&losses[..30], &losses[steps - 30..]);
    let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
    let square_error = |part: &[f64]| {
        let squares = part.iter().map(|loss| (loss - mean(part)).powi(2));
        squares.sum::<f64>() / (part.len() * (part.len() - 1)) as f64
    };
    let error = (square_error(early) + square_error(late)).sqrt();
    let fallen = mean(early) - mean(late);
    assert!(
        fallen > 3.0 * error,
        "{} to {} ± {error}",
        mean(early),
        mean(late)
    );
}

#[test]
fn noise_and_velocity_are_learnt() {
    let device = Device::flex();
    for prediction in [Prediction::Epsilon, Prediction::Velocity] {
        // Unweighted: the loss of what knows nothing is then the same for every step that is drawn.
        let options = FineTuneOptions {
            snr_gamma: None,
            ..options(prediction, 5e-3)
        };
        falls(
            FineTune::whole(
                unet(&device),
                frozen(&device),
                options,
                &device.clone().autodiff(),
            ),
            200,
        );
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
        assert!(run.step(images, ids).norm > 0.0);
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
fn weights_at_each_signal_to_noise_ratio_are_the_closed_form() {
    let snr = [0.0, 0.5, 5.0, 20.0, 1e6];
    let noise = min_snr_weights(&snr, 5.0, Prediction::Epsilon);
    let velocity = min_snr_weights(&snr, 5.0, Prediction::Velocity);
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
