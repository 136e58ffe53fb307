//! Training tasks of a latent diffusion model: the autoencoder, then text encoder and U-Net.

use std::ops::Range;

use burn::module::Module;
use burn::tensor::{Device, Int, Tensor, TensorData};
use half::f16;

use super::fine_tune::{is_told, noised};
use super::latents::batch;
use super::run::{Task, Terms, number};
use super::tasks::{examples, noise_of};
use crate::error::{Error, Result};
use crate::streams::{self, FINE_TUNE_STREAM};
use wake_dataset::Pair;
use wake_ldm::autoencoder::AutoencoderKl;
use wake_ldm::pipeline::token_ids;
use wake_ldm::scheduler::{NoiseSchedule, Prediction};
use wake_ldm::streams::POSTERIOR_STREAM;
use wake_ldm::text::ClipText;
use wake_ldm::unet::{UNet, UNetInput};
use wake_nn::noise::{NoiseSource, normal_batch};

/// Rows and columns of the autoencoder's training crops, unless images are smaller.
const CROP: usize = 128;
/// Weight of the squared Laplacian of the error, relative to the squared error.
const CURVATURE: f64 = 1.0;
/// Weight of the divergence of a latent, relative to the squared error.
const DIVERGENCE: f64 = 1e-5;
/// Images that are encoded at once.
const ENCODED: usize = 16;
/// Target of the U-Net.
pub(crate) const PREDICTION: Prediction = Prediction::Velocity;

/// Images of one size with their prompts in memory, 16 bits per pixel.
#[derive(Debug, Default)]
pub(crate) struct PromptedImages {
    size: [usize; 2],
    pixels: Vec<f16>,
    prompts: Vec<Vec<i32>>,
}

impl PromptedImages {
    /// Adds the image of a pair, and its prompt as CLIP tokens.
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
        let pixels = pair.image.pixels.iter().map(|&grey| f16::from_f32(grey));
        self.pixels.extend(pixels);
        self.prompts.push(token_ids(None, &pair.prompt));
        Ok(())
    }

    /// Number of images.
    pub(crate) fn len(&self) -> usize {
        self.prompts.len()
    }

    /// Windows of `size` rows and columns at places (image, `[row, column]`), grey 0…1.
    fn windows(
        &self,
        places: &[(usize, [usize; 2])],
        size: [usize; 2],
        device: &Device,
    ) -> Tensor<4> {
        let [rows, columns] = self.size;
        let mut numbers = Vec::with_capacity(places.len() * size[0] * size[1]);
        for &(image, [row, column]) in places {
            for r in row..row + size[0] {
                let first = (image * rows + r) * columns + column;
                let line = &self.pixels[first..first + size[1]];
                numbers.extend(line.iter().map(|grey| grey.to_f32()));
            }
        }
        let data = TensorData::new(numbers, [places.len(), 1, size[0], size[1]]);
        Tensor::from_data(data, device)
    }

    /// Encodes all images to the means of their posteriors, shifted and scaled to an overall mean of 0 and variance of 1.
    ///
    /// - `done`: called with the number of images after each batch
    ///
    /// Returns the latents, and the autoencoder with this shift and scale.
    ///
    /// # Panics
    ///
    /// When there is no image.
    pub(crate) fn encode(
        self,
        autoencoder: AutoencoderKl,
        device: &Device,
        done: impl Fn(usize),
    ) -> (PromptedLatents, AutoencoderKl) {
        let all: Vec<(usize, [usize; 2])> = (0..self.len()).map(|image| (image, [0, 0])).collect();
        let (mut latents, mut shape) = (Vec::<f32>::new(), [0; 3]);
        for places in all.chunks(ENCODED) {
            let images = self.windows(places, self.size, device);
            let means = autoencoder.encode(autoencoder.scaled(images)).mode();
            let [_, channels, rows, columns] = means.dims();
            shape = [channels, rows, columns];
            latents.extend(means.into_data().iter::<f32>());
            done(places.len());
        }
        let count = latents.len() as f64;
        let mean = latents.iter().map(|&z| f64::from(z)).sum::<f64>() / count;
        let squares = latents.iter().map(|&z| (f64::from(z) - mean).powi(2));
        let scale = (count / squares.sum::<f64>().max(f64::MIN_POSITIVE)).sqrt();
        let scaled = latents.iter().map(|&z| (f64::from(z) - mean) * scale);
        let set = PromptedLatents {
            shape,
            latents: scaled.map(f16::from_f64).collect(),
            prompts: self.prompts,
            empty: token_ids(None, ""),
        };
        (set, autoencoder.with_latents(mean, scale))
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

/// Task of the autoencoder: squared error of the pixels and of its Laplacian, and a small divergence term of the latents.
///
/// ```text
/// e = decode(μ + σ n) − image,    loss = mean e² + mean (∇²e)² + 10⁻⁵ mean KL
/// ```
///
/// on crops of 128 × 128 pixels anywhere in the images, scaled to −1…1; KL is the divergence of one latent number from a
/// standard normal distribution. The Laplacian weights an error of wavenumber k by k⁴: short sea waves have a hundredth of the
/// power of long ones and would be learnt last.
///
/// # References
///
/// Kingma & Welling (2014), "Auto-Encoding Variational Bayes", Eq. 10; Rombach et al. (2022), "High-Resolution Image
/// Synthesis with Latent Diffusion Models", appendix G (the weight).
#[derive(Debug)]
pub(crate) struct AutoencoderTask<'a> {
    /// Images, at least one, with rows and columns that are multiples of the autoencoder's downsampling.
    pub images: &'a PromptedImages,
    /// Seed of order, places and noise.
    pub seed: u64,
}

impl Task<AutoencoderKl> for AutoencoderTask<'_> {
    type Batch = Range<u64>;

    fn batch(&self, positions: Range<u64>) -> Result<Range<u64>> {
        Ok(positions)
    }

    fn loss(
        &self,
        model: &AutoencoderKl,
        device: &Device,
        positions: &Range<u64>,
    ) -> (Tensor<1>, Terms) {
        let random = NoiseSource::new(self.seed);
        let crop = self.images.size.map(|side| side.min(CROP));
        let indices = examples(self.seed, positions.clone(), self.images.len());
        let place = |position: u64| -> [usize; 2] {
            std::array::from_fn(|axis| {
                let room = self.images.size[axis] - crop[axis] + 1;
                let draw = random.uniform(streams::CROPS, 2 * position + axis as u64);
                (draw * room as f64) as usize
            })
        };
        let places = indices.into_iter().zip(positions.clone().map(place));
        let images = self
            .images
            .windows(&places.collect::<Vec<_>>(), crop, device);
        let images = model.scaled(images);
        let posterior = model.encode(images.clone());
        let [count, channels, rows, columns] = posterior.mean.dims();
        let sources: Vec<NoiseSource> = positions.clone().map(|p| noise_of(self.seed, p)).collect();
        let noise = normal_batch(
            &sources,
            POSTERIOR_STREAM,
            [channels, rows, columns],
            device,
        );
        let decoded = model.decode(posterior.sample(noise));
        let error = decoded - images;
        let curvature = laplacian(&error).square().mean();
        let error = error.square().mean();
        let numbers = (count * channels * rows * columns) as f64;
        let divergence = posterior.kl().sum() / numbers;
        let terms = vec![
            ("error", number(&error)),
            ("curvature", number(&curvature)),
            ("divergence", number(&divergence)),
        ];
        (
            error + curvature * CURVATURE + divergence * DIVERGENCE,
            terms,
        )
    }
}

/// Sum of the four neighbours less four times the pixel, without the edges.
///
/// # Shapes
///
/// `[count, channels, rows, columns]` with at least 3 rows and columns → two rows and two columns fewer
fn laplacian(images: &Tensor<4>) -> Tensor<4> {
    let [_, _, rows, columns] = images.dims();
    let at = |row: usize, column: usize| {
        let rows = images.clone().narrow(2, row, rows - 2);
        rows.narrow(3, column, columns - 2)
    };
    at(0, 1) + at(2, 1) + at(1, 0) + at(1, 2) - at(1, 1) * 4.0
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
/// x = √ᾱₜ z + √(1 − ᾱₜ) n,    v = √ᾱₜ n − √(1 − ᾱₜ) z
/// loss = mean |unet(x, t, text encoder(prompt)) − v|²
/// ```
///
/// A tenth of the prompts are left out. The model predicts the velocity v; Stable Diffusion v1.4 predicts the noise n. A squared
/// error of z counts 1/(1 − ᾱₜ) in v, but ᾱₜ/(1 − ᾱₜ) in n, which is 0.005 in the first steps of sampling, where the prompt
/// decides.
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
    /// Seed of order, noise, diffusion steps and left-out prompts.
    pub seed: u64,
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
        let count = self.schedule.steps() as f64;
        let draw = |p: u64| (random.uniform(streams::STEPS, p) * count) as usize;
        let steps: Vec<usize> = positions.clone().map(draw).collect();
        let told = positions.clone().zip(&indices).flat_map(|(p, &i)| {
            match is_told(random, streams::LEFT_OUT, p) {
                true => &self.set.prompts[i],
                false => &self.set.empty,
            }
        });
        let told: Vec<i32> = told.copied().collect();
        let shape = [indices.len(), told.len() / indices.len().max(1)];
        let ids: Tensor<2, Int> = Tensor::from_data(TensorData::new(told, shape), device);
        let sources: Vec<NoiseSource> = positions.clone().map(|p| noise_of(self.seed, p)).collect();
        let noise = normal_batch(&sources, FINE_TUNE_STREAM, self.set.shape, device);
        let clean = batch(&self.set.latents, self.set.shape, &indices, device);
        let noised = noised(self.schedule, PREDICTION, &steps, clean, noise);
        let found = model.unet.forward(UNetInput {
            sample: noised.sample,
            timesteps: noised.timesteps,
            context: Some(model.text_encoder.last_hidden_state(ids)),
            condition: None,
        });
        let loss = (found - noised.target).square().mean();
        let terms = vec![("velocity", number(&loss))];
        (loss, terms)
    }
}

#[cfg(all(test, feature = "flex"))]
mod tests;
