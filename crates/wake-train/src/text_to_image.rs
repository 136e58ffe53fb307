//! Images with prompts, their latents, and the training task of text encoder and U-Net.

use std::ops::Range;

use burn::module::Module;
use burn::tensor::{Device, Int, Tensor, TensorData};
use half::f16;

use super::fine_tune::{Noised, each, is_told, noised};
use super::latents::batch;
use super::run::{Task, Terms, number};
use super::tasks::{examples, noise_of};
use crate::error::{Error, Result};
use crate::streams::{self, FINE_TUNE_STREAM};
use wake_dataset::Pair;
use wake_ldm::autoencoder::{AutoencoderKl, AutoencoderKlConfig};
use wake_ldm::conditioning::statement;
use wake_ldm::pipeline::token_ids;
use wake_ldm::scheduler::{NoiseSchedule, Prediction};
use wake_ldm::text::ClipText;
use wake_ldm::unet::{UNet, UNetInput};
use wake_nn::noise::{NoiseSource, normal_batch};
use wake_text::PartialScene;

/// Images that are encoded at once.
const AT_ONCE: usize = 16;
/// Share of the diffusion steps, the noisiest, that half of the examples have.
const LATE: f64 = 0.1;
/// Examples, the first of a training, that are drawn from the prompt alone: this share, but at most so many.
const BLIND: f64 = 0.3;
const MOST_BLIND: u64 = 19_200;
/// Weights of squared errors: of the means over images, and of the first channel.
const MEAN: f64 = 0.03;
const FIRST: f64 = 4.0;
/// Target of the U-Net.
pub(crate) const PREDICTION: Prediction = Prediction::Velocity;

/// Images of one size with their prompts in memory, 16 bits per pixel.
#[derive(Debug, Default)]
pub(crate) struct PromptedImages {
    size: [usize; 2],
    pixels: Vec<f16>,
    prompts: Vec<Vec<i32>>,
    statements: Vec<Vec<f32>>,
}

impl PromptedImages {
    /// Adds the image of a pair, its prompt as CLIP tokens, and the values that the prompt states: none if it is unreadable.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::InvalidOption`] for an image of another size than earlier ones.
    pub(crate) fn push(&mut self, pair: &Pair) -> Result<()> {
        let size = [pair.image.rows, pair.image.columns];
        if self.prompts.is_empty() {
            self.size = size;
        }
        if size != self.size {
            return Err(Error::Value(wake_nn::Error::InvalidOption {
                option: "image size".to_owned(),
                value: format!("{} x {} pixels", size[0], size[1]),
                expected: format!(
                    "{} x {}, as in the images before",
                    self.size[0], self.size[1]
                ),
            }));
        }
        let said = PartialScene::read(&pair.prompt).unwrap_or_default();
        self.statements.push(statement(&said));
        let pixels = pair.image.pixels.iter().map(|&grey| f16::from_f32(grey));
        self.pixels.extend(pixels);
        self.prompts.push(token_ids(None, &pair.prompt));
        Ok(())
    }

    /// Number of images.
    pub(crate) fn len(&self) -> usize {
        self.prompts.len()
    }

    /// Prompts as tokens.
    pub(crate) fn prompts(&self) -> &[Vec<i32>] {
        &self.prompts
    }

    /// Values that the prompts state.
    pub(crate) fn statements(&self) -> &[Vec<f32>] {
        &self.statements
    }

    /// Fits a linear autoencoder to all images.
    ///
    /// - `done`: called with the number of images of each batch, which is read twice
    ///
    /// # Panics
    ///
    /// As [`AutoencoderKlConfig::fit`].
    pub(crate) fn fit(
        &self,
        config: &AutoencoderKlConfig,
        device: &Device,
        done: impl Fn(usize),
    ) -> AutoencoderKl {
        let batches = self.batches(device).map(|images| {
            done(images.dims()[0]);
            images * 2.0 - 1.0
        });
        config.fit(batches, device)
    }

    /// Encodes all images to the means of their posteriors.
    ///
    /// - `done`: called with the number of images of each batch
    pub(crate) fn encode(
        self,
        autoencoder: &AutoencoderKl,
        device: &Device,
        done: impl Fn(usize),
    ) -> PromptedLatents {
        let (mut latents, mut shape) = (Vec::<f16>::new(), [0; 3]);
        for images in self.batches(device) {
            let means = autoencoder.encode(autoencoder.scaled(images)).mode();
            let means = autoencoder.to_latents(means);
            let [count, channels, rows, columns] = means.dims();
            shape = [channels, rows, columns];
            latents.extend(means.into_data().iter::<f32>().map(f16::from_f32));
            done(count);
        }
        PromptedLatents {
            shape,
            latents,
            prompts: self.prompts,
            empty: token_ids(None, ""),
        }
    }

    /// All images, some at a time, `[images, 1, rows, columns]`, grey 0…1.
    fn batches(&self, device: &Device) -> impl Iterator<Item = Tensor<4>> + Clone {
        let [rows, columns] = self.size;
        let batches = self.pixels.chunks(AT_ONCE * (rows * columns).max(1));
        batches.map(move |pixels| {
            let grey: Vec<f32> = pixels.iter().map(|grey| grey.to_f32()).collect();
            let shape = [pixels.len() / (rows * columns), 1, rows, columns];
            Tensor::from_data(TensorData::new(grey, shape), device)
        })
    }
}

/// Latents of images with their prompts, 16 bits per number.
#[derive(Debug)]
pub(crate) struct PromptedLatents {
    shape: [usize; 3],
    latents: Vec<f16>,
    prompts: Vec<Vec<i32>>,
    empty: Vec<i32>,
}

impl PromptedLatents {
    /// Channels, rows and columns of the latents.
    pub(crate) fn shape(&self) -> [usize; 3] {
        self.shape
    }
}

/// Text encoder and U-Net, trained together.
#[derive(Module, Debug)]
pub(crate) struct TextToImage {
    /// Encodes the prompt.
    pub text_encoder: ClipText,
    /// Predicts the velocity.
    pub unet: UNet,
}

/// Task of text encoder and U-Net: squared error of the velocity.
///
/// ```text
/// x = √ᾱₜ z + √(1 − ᾱₜ) n,    v = √ᾱₜ n − √(1 − ᾱₜ) z,    e = unet(x, t, text encoder(prompt)) − v
/// loss = mean [|e − ē|² + 3 |e₁ − ē₁|² + 0.03 |ē|²]        ē: mean of e over an image, e₁: its first channel
/// ```
///
/// A tenth of the prompts are left out. Stable Diffusion v1.4 predicts the noise n, this model the velocity v: a squared error of z
/// counts 1/(1 − ᾱₜ) in v, but ᾱₜ/(1 − ᾱₜ) in n, which is 0.005 in the first steps of sampling, where the prompt decides.
///
/// Three things make the U-Net learn what a prompt says before it learns to remove noise, which needs no prompt:
///
/// - The first examples have x = 0 and the last step, where x has no signal: the image depends on the prompt alone.
/// - After that, half of the steps t are drawn from the noisiest tenth.
/// - The mean over an image, its brightness, varies far more than a wake. It has a small weight, so that its errors do not hide the
///   wake's. The first channel shows where the wake is and has a large one. With any weights, the expected velocity given x and the
///   prompt has the least loss.
///
/// # References
///
/// Rombach et al. (2022), "High-Resolution Image Synthesis with Latent Diffusion Models", Eq. 3; Salimans & Ho (2022),
/// "Progressive Distillation for Fast Sampling of Diffusion Models", appendix D (v); Ho & Salimans (2021), "Classifier-Free
/// Diffusion Guidance", algorithm 1 (prompts left out).
#[derive(Debug)]
pub(crate) struct TextToImageTask<'a> {
    /// The latents, at least one.
    pub set: &'a PromptedLatents,
    /// Noise schedule.
    pub schedule: &'a NoiseSchedule,
    /// Number of examples, the first ones, that are drawn from the prompt alone.
    pub blind: u64,
    /// Seed of order, noise, diffusion steps and left-out prompts.
    pub seed: u64,
}

impl TextToImageTask<'_> {
    /// Examples of a training of this length that are drawn from the prompt alone.
    pub(crate) fn blind_of(examples: u64) -> u64 {
        MOST_BLIND.min((BLIND * examples as f64) as u64)
    }

    /// Noisy latents of some examples; the first of the training have none.
    fn noised(&self, positions: &Range<u64>, indices: &[usize], device: &Device) -> Noised {
        let random = NoiseSource::new(self.seed);
        let count = self.schedule.steps();
        let is_blind = |position: u64| position < self.blind;
        let steps = positions.clone().map(|p| match is_blind(p) {
            true => count - 1,
            false => step_of(random, p, count),
        });
        let steps: Vec<usize> = steps.collect();
        let sources: Vec<NoiseSource> = positions.clone().map(|p| noise_of(self.seed, p)).collect();
        let noise = normal_batch(&sources, FINE_TUNE_STREAM, self.set.shape, device);
        let clean = batch(&self.set.latents, self.set.shape, indices, device);
        let noised = noised(self.schedule, PREDICTION, &steps, clean, noise);
        let seen = positions.clone().map(|p| f64::from(u8::from(!is_blind(p))));
        Noised {
            sample: noised.sample * each(seen.collect(), device),
            ..noised
        }
    }
}

impl Task<TextToImage> for TextToImageTask<'_> {
    type Batch = Range<u64>;

    fn batch(&self, positions: Range<u64>) -> Result<Range<u64>> {
        Ok(positions)
    }

    fn loss(
        &self,
        model: &TextToImage,
        device: &Device,
        positions: &Range<u64>,
    ) -> (Tensor<1>, Terms) {
        let random = NoiseSource::new(self.seed);
        let indices = examples(self.seed, positions.clone(), self.set.prompts.len());
        let noised = self.noised(positions, &indices, device);
        let told = positions.clone().zip(&indices).map(|(p, &i)| {
            match is_told(random, streams::LEFT_OUT, p) {
                true => &self.set.prompts[i],
                false => &self.set.empty,
            }
        });
        let ids = token_batch(told, device);
        let found = model.unet.forward(UNetInput {
            sample: noised.sample,
            timesteps: noised.timesteps,
            context: Some(model.text_encoder.last_hidden_state(ids)),
            condition: None,
        });
        let error = found - noised.target;
        let terms = vec![("velocity", number(&error.clone().square().mean()))];
        (weighted_square(error), terms)
    }
}

/// Mean square of errors, `[batch, channels, rows, columns]`, in which the means over rows and columns have the weight `MEAN`, and
/// what remains of the first channel has the weight `FIRST`.
fn weighted_square(error: Tensor<4>) -> Tensor<1> {
    let channels = error.dims()[1] as f64;
    let mean = error.clone().mean_dim(3).mean_dim(2);
    let varying = (error - mean.clone()).square();
    let first = varying.clone().narrow(1, 0, 1).mean() * ((FIRST - 1.0) / channels);
    varying.mean() + first + mean.square().mean() * MEAN
}

/// Prompts of the same number of tokens as one tensor, `[prompts, tokens]`.
pub(crate) fn token_batch<'a>(
    prompts: impl Iterator<Item = &'a Vec<i32>>,
    device: &Device,
) -> Tensor<2, Int> {
    let (mut ids, mut count) = (Vec::new(), 0);
    for prompt in prompts {
        ids.extend_from_slice(prompt);
        count += 1;
    }
    let shape = [count, ids.len() / count.max(1)];
    Tensor::from_data(TensorData::new(ids, shape), device)
}

/// Diffusion step of an example with noise: any of `count` for one half, one of the noisiest tenth for the other.
fn step_of(random: NoiseSource, position: u64, count: usize) -> usize {
    let uniform = random.uniform(streams::STEPS, position);
    let place = match position.is_multiple_of(2) {
        true => uniform,
        false => 1.0 - LATE + LATE * uniform,
    };
    ((place * count as f64) as usize).min(count - 1)
}

#[cfg(all(test, feature = "flex"))]
mod tests;
