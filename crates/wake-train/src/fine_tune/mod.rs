//! Fine-tuning of a Stable Diffusion-layout model: the U-Net, or low-rank changes of it.

mod batches;
mod training;

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use burn::module::Module;
use burn::tensor::{Device, Tensor, TensorData};

use super::run::{Task, Terms};
use crate::error::{Error, Result};
use crate::streams::{self, FINE_TUNE_STREAM};
use wake_ldm::autoencoder::AutoencoderKl;
use wake_ldm::lora::LowRank;
use wake_ldm::scheduler::{NoiseLevel, NoiseSchedule, Prediction};
use wake_ldm::streams::POSTERIOR_STREAM;
use wake_ldm::text::ClipText;
use wake_ldm::unet::{UNet, UNetInput};
use wake_nn::noise::{NoiseSource, normal_batch};

pub(crate) use batches::is_told;
pub(crate) use batches::{PromptedPairs, PromptedSource};
pub use training::FineTuning;

/// Frozen parts of the model, outside autodiff.
#[derive(Debug, Clone)]
pub(crate) struct Frozen {
    /// Encodes prompts.
    pub text: ClipText,
    /// Encodes images to latents.
    pub autoencoder: AutoencoderKl,
}

impl Frozen {
    fn on(&self, device: &Device) -> Self {
        Self {
            text: self.text.clone().to_device(device),
            autoencoder: self.autoencoder.clone().to_device(device),
        }
    }
}

/// Fine-tuning task for a [`UNet`], or for low-rank changes of one.
///
/// ```text
/// x = √ᾱₜ x₀ + √(1 − ᾱₜ) n,    loss = w(t) |model(x, t, words) − target|²
/// ```
///
/// The target is n, or √ᾱₜ n − √(1 − ᾱₜ) x₀, or x₀; images and prompts are encoded without gradients.
///
/// # References
///
/// Rombach et al. (2022), "High-Resolution Image Synthesis with Latent Diffusion Models", Eq. 2; Salimans & Ho
/// (2022), appendix D (velocity); Hang et al. (2023), section 3.4 (weights).
#[derive(Debug)]
pub(crate) struct FineTuneTask<S> {
    source: S,
    schedule: NoiseSchedule,
    prediction: Prediction,
    snr_gamma: Option<f64>,
    seed: u64,
    places: Vec<OnDevice>,
}

/// Frozen parts on one device.
#[derive(Debug)]
struct OnDevice {
    /// Autodiff device.
    device: Device,
    // Copies share the weights and are cheap; one thread at a time makes them.
    frozen: Mutex<(Frozen, Option<UNet>)>,
}

impl<S: PromptedSource> FineTuneTask<S> {
    /// Task on the images of a source.
    ///
    /// - `schedule`: noise level of each step
    /// - `prediction`: what the U-Net predicts
    /// - `devices`: autodiff devices of the run
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::Unsupported`] for flow prediction, which mixes noise and image linearly and not with √ᾱ.
    pub(crate) fn new(
        source: S,
        frozen: &Frozen,
        (schedule, prediction): (NoiseSchedule, Prediction),
        seed: u64,
        devices: &[Device],
    ) -> Result<Self> {
        if prediction == Prediction::Flow {
            return Err(Error::Value(wake_nn::Error::Unsupported {
                option: "prediction_type of a fine-tuned model".to_owned(),
                value: "flow_prediction".to_owned(),
                supported: "epsilon, v_prediction, sample".to_owned(),
            }));
        }
        let place = |device: &Device| OnDevice {
            device: device.clone(),
            frozen: Mutex::new((frozen.on(&device.clone().inner()), None)),
        };
        Ok(Self {
            source,
            schedule,
            prediction,
            snr_gamma: None,
            seed,
            places: devices.iter().map(place).collect(),
        })
    }

    /// Sets γ, at which the signal-to-noise ratio in the weights of steps is clipped; with `None` all steps have equal weights.
    #[must_use]
    pub(crate) fn with_snr_gamma(mut self, gamma: Option<f64>) -> Self {
        self.snr_gamma = gamma;
        self
    }

    /// Sets the U-Net whose low-rank changes are trained; it stays as it is.
    #[must_use]
    pub(crate) fn with_base(self, unet: &UNet) -> Self {
        for place in &self.places {
            let unet = unet.clone().no_grad().train().fork(&place.device);
            lock(&place.frozen).1 = Some(unet);
        }
        self
    }

    /// Frozen models on the device of a loss.
    fn frozen_on(&self, device: &Device) -> (Frozen, Option<UNet>) {
        let mut places = self.places.iter();
        let there = places.find(|place| place.device == *device);
        let there = there.expect("a run learns on the devices that its task was made for");
        lock(&there.frozen).clone()
    }

    /// Inputs, target and weights of a batch.
    fn question(&self, frozen: &Frozen, batch: &PromptedBatch, device: &Device) -> Question {
        let inner = device.clone().inner();
        let (positions, count) = (batch.positions.clone(), batch.steps.len());
        let images = Tensor::<4>::from_data(batch.images.clone(), &inner);
        let images = frozen.autoencoder.scaled(images);
        let posterior = frozen.autoencoder.encode(images);
        let [_, channels, rows, columns] = posterior.mode().dims();
        let sources: Vec<NoiseSource> = positions
            .map(|position| NoiseSource::new(self.seed.wrapping_add(position << 16)))
            .collect();
        let draw = |stream| normal_batch(&sources, stream, [channels, rows, columns], &inner);
        let clean = frozen
            .autoencoder
            .to_latents(posterior.sample(draw(POSTERIOR_STREAM)));
        let noise = draw(FINE_TUNE_STREAM);
        let ids = Tensor::from_data(batch.ids.clone(), &inner);
        let context = frozen.text.last_hidden_state(ids);
        let noised = noised(&self.schedule, self.prediction, &batch.steps, clean, noise);
        let levels = batch.steps.iter().map(|&t| self.schedule.noise_level(t));
        let snr: Vec<f64> = levels.map(|l| (l.signal / l.noise).powi(2)).collect();
        let weights = self.snr_gamma.map_or_else(
            || vec![1.0; count],
            |gamma| min_snr_weights(&snr, gamma, self.prediction),
        );
        Question {
            input: UNetInput {
                sample: Tensor::from_inner(noised.sample),
                timesteps: Tensor::from_inner(noised.timesteps),
                context: Some(Tensor::from_inner(context)),
                condition: None,
            },
            target: Tensor::from_inner(noised.target),
            weights: Tensor::from_inner(each(weights, &inner)),
        }
    }

    fn batch_at(&self, positions: Range<u64>) -> Result<PromptedBatch> {
        let random = NoiseSource::new(self.seed);
        let count = (positions.end - positions.start) as usize;
        let (mut pixels, mut ids, mut size) = (Vec::new(), Vec::new(), [0, 0]);
        for position in positions.clone() {
            let pair = self.source.at(position)?;
            size = [pair.image.rows, pair.image.columns];
            pixels.extend(pair.image.pixels);
            ids.extend(pair.ids);
        }
        let tokens = ids.len() / count.max(1);
        let levels = self.schedule.steps() as f64;
        let step = |position| (random.uniform(streams::STEPS, position) * levels) as usize;
        Ok(PromptedBatch {
            images: TensorData::new(pixels, [count, 1, size[0], size[1]]),
            ids: TensorData::new(ids, [count, tokens]),
            steps: positions.clone().map(step).collect(),
            positions,
        })
    }
}

/// Images and prompts at some positions of a run.
#[derive(Debug)]
pub(crate) struct PromptedBatch {
    /// Grey 0…1, `[batch, 1, rows, columns]`.
    images: TensorData,
    /// `[batch, tokens]`
    ids: TensorData,
    /// Step of the noise schedule of each image.
    steps: Vec<usize>,
    positions: Range<u64>,
}

impl<S: PromptedSource> Task<UNet> for FineTuneTask<S> {
    type Batch = PromptedBatch;

    fn batch(&self, positions: Range<u64>) -> Result<PromptedBatch> {
        self.batch_at(positions)
    }

    fn loss(&self, unet: &UNet, device: &Device, batch: &PromptedBatch) -> (Tensor<1>, Terms) {
        let (frozen, _) = self.frozen_on(device);
        let question = self.question(&frozen, batch, device);
        (question.loss(unet), Terms::new())
    }
}

impl<S: PromptedSource> Task<LowRank> for FineTuneTask<S> {
    type Batch = PromptedBatch;

    fn batch(&self, positions: Range<u64>) -> Result<PromptedBatch> {
        self.batch_at(positions)
    }

    /// # Panics
    ///
    /// When [`with_base`](FineTuneTask::with_base) was not called.
    fn loss(
        &self,
        changes: &LowRank,
        device: &Device,
        batch: &PromptedBatch,
    ) -> (Tensor<1>, Terms) {
        let (frozen, unet) = self.frozen_on(device);
        let unet = unet.expect("changes are learnt of a U-Net");
        let question = self.question(&frozen, batch, device);
        (question.loss(&changes.merged(unet)), Terms::new())
    }
}

fn lock<T>(value: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    value.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Inputs of the U-Net for a batch, its target, and weights of the squared error.
struct Question {
    input: UNetInput,
    target: Tensor<4>,
    weights: Tensor<4>,
}

impl Question {
    fn loss(self, unet: &UNet) -> Tensor<1> {
        let error = unet.forward(self.input) - self.target;
        (error.square() * self.weights).mean()
    }
}

/// Noisy latents, their steps, and the target of the model.
pub(super) struct Noised {
    /// `[batch, channels, rows, columns]`
    pub(super) sample: Tensor<4>,
    /// `[batch]`
    pub(super) timesteps: Tensor<1>,
    /// Same shape as `sample`.
    pub(super) target: Tensor<4>,
}

/// Mixes latents with noise at the levels of their steps.
pub(super) fn noised(
    schedule: &NoiseSchedule,
    prediction: Prediction,
    steps: &[usize],
    clean: Tensor<4>,
    noise: Tensor<4>,
) -> Noised {
    let levels: Vec<NoiseLevel> = steps.iter().map(|&t| schedule.noise_level(t)).collect();
    let device = clean.device();
    let signal = each(levels.iter().map(|level| level.signal).collect(), &device);
    let spread = each(levels.iter().map(|level| level.noise).collect(), &device);
    let sample = clean.clone() * signal.clone() + noise.clone() * spread.clone();
    let target = match prediction {
        Prediction::Velocity => noise * signal - clean * spread,
        Prediction::Sample => clean,
        Prediction::Flow => noise - clean,
        Prediction::Epsilon => noise,
    };
    Noised {
        sample,
        timesteps: each(steps.iter().map(|&t| t as f64).collect(), &device).reshape([-1]),
        target,
    }
}

/// A number for each image, `[numbers, 1, 1, 1]`.
pub(super) fn each(values: Vec<f64>, device: &Device) -> Tensor<4> {
    let numbers: Vec<f32> = values.into_iter().map(|x| x as f32).collect();
    let count = numbers.len();
    Tensor::from_data(TensorData::new(numbers, [count, 1, 1, 1]), device)
}

/// Weights of the squared error at each signal-to-noise ratio.
///
/// ```text
/// noise:     min(SNR, γ)/SNR
/// velocity:  min(SNR, γ)/(SNR + 1)
/// sample:    min(SNR, γ)
/// ```
///
/// # References
///
/// Hang et al. (2023), "Efficient Diffusion Training via Min-SNR Weighting Strategy", section 3.4.
fn min_snr_weights(snr: &[f64], gamma: f64, prediction: Prediction) -> Vec<f64> {
    let weight = |&snr: &f64| match prediction {
        Prediction::Sample => snr.min(gamma),
        Prediction::Velocity => snr.min(gamma) / (snr + 1.0),
        _ if snr <= gamma => 1.0,
        _ => gamma / snr,
    };
    snr.iter().map(weight).collect()
}

#[cfg(all(test, feature = "flex"))]
mod full_size;
#[cfg(all(test, feature = "flex"))]
mod tests;
