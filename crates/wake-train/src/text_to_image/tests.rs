//! A linear autoencoder of waves; a toy model learns two images by their names.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use burn::tensor::Device;
use serde_json::Value;

use super::*;
use crate::{LrSchedule, Run, RunOptions, TrainerOptions};
use wake_ldm::scheduler::{BetaCurve, TerminalSnr};
use wake_ldm::text::ClipTextConfig;
use wake_ldm::unet::UNetConfig;

fn options(batch: usize, peak: f64, steps: usize) -> RunOptions {
    RunOptions {
        batch,
        seed: 3,
        identity: Value::Null,
        trainer: TrainerOptions {
            rate: LrSchedule {
                peak,
                warmup: 5,
                steps,
            },
            ema_decay: 0.9,
            ..TrainerOptions::default()
        },
    }
}

/// Waves along both axes, longer in each further image.
fn images(count: usize, size: usize) -> PromptedImages {
    let grey = |image: usize, row: usize, column: usize| {
        let [r, c] = [row, column].map(|x| x as f32 / (1.5 + image as f32));
        f16::from_f32(0.5 + 0.2 * r.sin() + 0.2 * c.cos())
    };
    let at = |n: usize| grey(n / (size * size), n / size % size, n % size);
    PromptedImages {
        size: [size; 2],
        pixels: (0..count * size * size).map(at).collect(),
        prompts: (0..count as i32).map(|n| vec![n + 1; 4]).collect(),
        statements: vec![Vec::new(); count],
    }
}

/// The autoencoder is fitted to the images, whose latents then have mean 0 and variance 1.
#[test]
fn images_are_fitted_encoded_and_decoded() {
    let images = images(20, 32);
    let device = Device::flex();
    let config = AutoencoderKlConfig::linear(4, 8);
    let model = images.fit(&config, &device, |_| {});
    let pixels = images.batches(&device).collect::<Vec<_>>();
    let pixels = Tensor::cat(pixels, 0) * 2.0 - 1.0;
    assert_eq!(pixels.dims(), [20, 1, 32, 32]);
    let decoded = model.decode(model.encode(pixels.clone()).mode());
    let squares = |x: Tensor<4>| f64::from(x.square().mean().into_scalar::<f32>());
    // Baseline: the mean grey. Sines and cosines of twenty slowly changing wave numbers have few components.
    let constant = squares(pixels.clone() - pixels.clone().mean().reshape([1, 1, 1, 1]));
    let error = squares(decoded - pixels);
    assert!(error < 0.1 * constant, "{error} of {constant}");

    let set = images.encode(&model, &device, |_| {});
    assert_eq!(set.shape(), [4, 4, 4]);
    let all: Vec<usize> = (0..20).collect();
    let latents = batch(&set.latents, set.shape, &all, &device);
    let pixels = latents.swap_dims(0, 1).reshape([4, 320]);
    // Half precision keeps eleven bits.
    let rounding = (0.5f32).powi(10);
    let means = pixels.clone().mean_dim(1).abs().max().into_scalar::<f32>();
    assert!(means < rounding, "{means}");
    let variance = pixels.square().mean().into_scalar::<f32>();
    assert!((variance - 1.0).abs() < rounding, "{variance}");
}

#[test]
fn images_of_another_size_are_refused() {
    let mut images = images(1, 32);
    let recipe = wake_dataset::Recipe::default();
    let pair = wake_dataset::Simulated::new(recipe, 1)
        .unwrap()
        .pair(0)
        .unwrap();
    let error = images.push(&pair).unwrap_err().to_string();
    assert!(error.contains("expected 32 x 32, as in"), "{error}");
    let mut empty = PromptedImages::default();
    empty.push(&pair).unwrap();
    assert_eq!((empty.len(), empty.size), (1, [256, 256]));
    assert_eq!(empty.prompts[0].len(), 77);
    let said = PartialScene::read(&pair.prompt).unwrap();
    assert_eq!(empty.statements, [statement(&said)]);
}

/// 55 % of the steps are in the noisiest tenth, 5 % in each other tenth, within four deviations of a binomial distribution.
#[test]
fn half_of_the_steps_are_noisy() {
    let (random, count) = (NoiseSource::new(3), 20_000);
    let mut tenths = [0u32; 10];
    for position in 0..count {
        tenths[step_of(random, position, 1000) / 100] += 1;
    }
    for (n, &found) in tenths.iter().enumerate() {
        let share = if n == 9 { 0.55 } else { 0.05 };
        let expected = share * count as f64;
        let deviation = (expected * (1.0 - share)).sqrt();
        assert!(
            (f64::from(found) - expected).abs() < 4.0 * deviation,
            "{tenths:?}"
        );
    }
}

/// The first examples have no sample, only the image as their target; later ones have both.
#[test]
fn the_first_examples_are_drawn_from_the_prompt_alone() {
    let device = Device::flex();
    let set = PromptedLatents {
        shape: [1, 2, 2],
        latents: (0..8).map(|n| f16::from_f32(n as f32 - 3.5)).collect(),
        prompts: vec![vec![1]; 2],
        empty: vec![0],
    };
    let curve = BetaCurve::ScaledLinear(0.01, 0.2);
    let schedule = NoiseSchedule::new(&curve, 20, TerminalSnr::Zero).unwrap();
    let task = TextToImageTask {
        set: &set,
        schedule: &schedule,
        blind: 3,
        seed: 5,
    };
    let order = [0, 1, 1, 0];
    let noised = task.noised(&(0..4), &order, &device);
    let timesteps: Vec<f32> = noised.timesteps.into_data().iter::<f32>().collect();
    assert_eq!(timesteps[..3], [19.0; 3]);
    let clean = batch(&set.latents, set.shape, &order, &device);
    let largest = |x: Tensor<4>| -> Vec<f32> {
        let of_image = x.abs().reshape([4, 4]).max_dim(1);
        of_image.into_data().iter::<f32>().collect()
    };
    let sample = largest(noised.sample);
    assert_eq!(sample[..3], [0.0; 3]);
    assert!(sample[3] > 0.0);
    assert_eq!(largest(noised.target + clean)[..3], [0.0; 3]);
}

/// Errors of 2 in two channels, with one sign all over the image, or with the sign of a chessboard in one channel.
#[test]
fn brightness_weighs_little_and_the_first_channel_much() {
    let device = Device::flex();
    let loss = |error: [f32; 8]| {
        let error = Tensor::from_data(TensorData::new(error.to_vec(), [1, 2, 2, 2]), &device);
        number(&weighted_square(error))
    };
    let (even, board) = ([2.0; 4], [2.0, -2.0, -2.0, 2.0]);
    let of = |first: [f32; 4], second: [f32; 4]| [first, second].concat().try_into().unwrap();
    for (error, weight) in [
        (of(even, even), MEAN),
        (of(board, [0.0; 4]), 0.5 * FIRST),
        (of([0.0; 4], board), 0.5),
    ] {
        let rounding = 4.0 * f64::from(f32::EPSILON);
        assert!((loss(error) / (4.0 * weight) - 1.0).abs() < rounding);
    }
}

/// One latent image is bright on the left and dark on the right, the other the reverse. With ᾱ = 0.03 and 0.0009 their sides are
/// at most 0.17 off zero, hardly distinguishable from the noise's deviation of 0.09, so only the prompt identifies them.
#[test]
fn the_prompt_says_which_image() {
    let device = Device::flex();
    let length = 2 * 8 * 8;
    let latents = (0..2 * length).map(|n| {
        let (first, left) = (n < length, n % 8 < 4);
        f16::from_f32(if first == left { 1.0 } else { -1.0 })
    });
    let set = |prompts: [i32; 2]| PromptedLatents {
        shape: [2, 8, 8],
        latents: latents.clone().collect(),
        prompts: prompts.map(|id| vec![id; 4]).to_vec(),
        empty: vec![0; 4],
    };
    let (right, swapped) = (set([1, 2]), set([2, 1]));
    let curve = BetaCurve::ScaledLinear(0.97, 0.97);
    let schedule = NoiseSchedule::new(&curve, 2, TerminalSnr::Kept).unwrap();
    let init = |device: &Device| TextToImage {
        text_encoder: ClipTextConfig::new()
            .with_vocab_size(8)
            .with_hidden_size(8)
            .with_intermediate_size(16)
            .with_layers(1)
            .with_heads(1)
            .init(device),
        unet: UNetConfig::small(2, Some(8), None)
            .with_block_out_channels(vec![8, 16])
            .with_down_attention(vec![false, true])
            .with_up_attention(vec![true, false])
            .with_heads(vec![1, 2])
            .with_norm_groups(4)
            .init(device),
    };
    let steps = 250;
    let autodiff = device.clone().autodiff();
    let constants = options(8, 1e-2, steps);
    let devices = vec![autodiff];
    let mut run = Run::of("text-to-image", &Value::Null, init, constants, devices).unwrap();
    let task = |set| TextToImageTask {
        set,
        schedule: &schedule,
        blind: TextToImageTask::blind_of(8 * steps as u64),
        seed: 3,
    };
    for _ in 0..steps {
        assert!(run.step(&task(&right)).unwrap().0.applied);
    }
    // The same noise, steps and order in each batch, with the prompts as learnt and swapped.
    let model = run.averaged();
    let loss = |set, batch: u64| {
        let positions = 10_000 + 8 * batch..10_008 + 8 * batch;
        number(&task(set).loss(&model, &device, &positions).0)
    };
    let costs: Vec<f64> = (0..32)
        .map(|batch| loss(&swapped, batch) - loss(&right, batch))
        .collect();
    let count = costs.len() as f64;
    let mean = costs.iter().sum::<f64>() / count;
    let squares: f64 = costs.iter().map(|cost| (cost - mean).powi(2)).sum();
    let error = (squares / (count * (count - 1.0))).sqrt();
    assert!(mean > 5.0 * error, "{mean:e} ± {error:e}");
}
