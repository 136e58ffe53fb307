//! Fine-tuning of a Stable Diffusion-layout model: the U-Net, or low-rank changes of it.

mod batches;
mod training;

use std::path::{Path, PathBuf};

use burn::module::Module;
use burn::tensor::{Device, Int, Tensor, TensorData};
use serde_json::{Value, json};

use super::checkpoint::Checkpoint;
use super::trainer::{StepReport, Trainer, TrainerOptions};
use crate::error::{Error, Result};
use crate::streams::{self, FINE_TUNE_STREAM};
use wake_ldm::autoencoder::AutoencoderKl;
use wake_ldm::lora::LowRank;
use wake_ldm::scheduler::{NoiseLevel, NoiseSchedule, Prediction};
use wake_ldm::streams::POSTERIOR_STREAM;
use wake_ldm::text::ClipText;
use wake_ldm::unet::{UNet, UNetInput};
use wake_nn::noise::{NoiseSource, normal_batch};
use wake_nn::weights::Layout;

pub use batches::PromptedBatches;
pub use training::FineTuning;

/// Constants of a [`FineTune`] run.
#[derive(Debug, Clone)]
pub struct FineTuneOptions {
    /// What the U-Net predicts.
    pub prediction: Prediction,
    /// γ of the min-SNR weights; without it every step counts the same.
    pub snr_gamma: Option<f64>,
    /// Seed of everything that is drawn.
    pub seed: u64,
    /// What is fitted to what, such as the weights begun with and the manifest of the data set: a checkpoint of another
    /// is refused.
    pub identity: Value,
    /// The loop.
    pub trainer: TrainerOptions,
}

/// The parts of the model that do not learn.
#[derive(Debug)]
pub struct Frozen {
    /// Words to tokens.
    pub text: ClipText,
    /// Images to latents.
    pub autoencoder: AutoencoderKl,
    /// How much noise each step has.
    pub schedule: NoiseSchedule,
}

/// What learns.
#[derive(Debug)]
enum Learning {
    Whole(Box<Trainer<UNet>>),
    Changes(Box<Trainer<LowRank>>, Box<UNet>),
}

/// A run that fits a latent diffusion model to other images.
///
/// ```text
/// x = √ᾱₜ x₀ + √(1 − ᾱₜ) n,    loss = w(t) |model(x, t, words) − target|²
/// ```
///
/// The target is n, or √ᾱₜ n − √(1 − ᾱₜ) x₀; images are encoded and prompts read without gradients.
///
/// # References
///
/// Rombach et al. (2022), "High-Resolution Image Synthesis with Latent Diffusion Models", Eq. 2; Salimans & Ho
/// (2022), appendix D (velocity); Hang et al. (2023), section 3.4 (weights).
#[derive(Debug)]
pub struct FineTune {
    learning: Learning,
    frozen: Frozen,
    options: FineTuneOptions,
    device: Device,
}

impl FineTune {
    /// A run that changes all weights of the U-Net, on an autodiff device.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::Unsupported`] for the prediction of a flow, which mixes noise and image along a line and not with √ᾱ;
    /// else as [`TrainerOptions::validate`].
    pub fn whole(
        unet: UNet,
        frozen: Frozen,
        options: FineTuneOptions,
        device: &Device,
    ) -> Result<Self> {
        check(&options)?;
        let trainer = Trainer::new(unet.train(), options.trainer, vec![device.clone()]);
        let learning = Learning::Whole(Box::new(trainer));
        Ok(Self::new(learning, frozen, options, device))
    }

    /// A run that leaves the U-Net as it is and learns changes of rank `rank` of its attentions, which begin as the seed of the
    /// options says.
    ///
    /// # Errors
    ///
    /// As [`whole`](Self::whole) and [`LowRank::of_attentions`].
    pub fn low_rank(
        unet: UNet,
        rank: usize,
        frozen: Frozen,
        options: FineTuneOptions,
        device: &Device,
    ) -> Result<Self> {
        check(&options)?;
        let unet = unet.no_grad().train().fork(device);
        device.seed(options.seed);
        let changes = LowRank::of_attentions(&unet, Layout::Diffusers, rank)?;
        let trainer = Trainer::new(changes, options.trainer, vec![device.clone()]);
        let learning = Learning::Changes(Box::new(trainer), Box::new(unet));
        Ok(Self::new(learning, frozen, options, device))
    }

    fn new(learning: Learning, frozen: Frozen, options: FineTuneOptions, device: &Device) -> Self {
        Self {
            learning,
            frozen,
            options,
            device: device.clone(),
        }
    }

    /// Steps made so far.
    pub fn steps(&self) -> usize {
        match &self.learning {
            Learning::Whole(trainer) => trainer.steps(),
            Learning::Changes(trainer, _) => trainer.steps(),
        }
    }

    /// Writes a checkpoint of what learns.
    ///
    /// # Errors
    ///
    /// [`Error::Diverged`] for weights that are no finite numbers, else as [`Checkpoint::write`].
    pub fn checkpoint(&self, folder: &Path) -> Result<PathBuf> {
        let checkpoint = match &self.learning {
            Learning::Whole(trainer) => trainer.checkpoint(&self.state())?,
            Learning::Changes(trainer, _) => trainer.checkpoint(&self.state())?,
        };
        checkpoint.write(folder)
    }

    /// Goes on where a checkpoint left off, on the same curve if the batches are the same.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::InvalidOption`] with the first value in which the checkpoint's run differs from this one.
    pub fn resume(&mut self, checkpoint: Checkpoint) -> Result<()> {
        let state = self.state();
        match &mut self.learning {
            Learning::Whole(trainer) => trainer.restore(checkpoint, &state),
            Learning::Changes(trainer, _) => trainer.restore(checkpoint, &state),
        }
    }

    /// What two runs must have in common for one to go on from the other.
    fn state(&self) -> Value {
        json!({
            "part": "fine-tune",
            "prediction": format!("{:?}", self.options.prediction),
            "snr_gamma": self.options.snr_gamma,
            "seed": self.options.seed,
            "identity": self.options.identity,
            "trainer": self.options.trainer.state(),
            "low_rank": matches!(self.learning, Learning::Changes(..)),
        })
    }

    /// The U-Net with averaged weights, or with averaged changes merged into it.
    pub fn unet(&self) -> UNet {
        match &self.learning {
            Learning::Whole(trainer) => trainer.averaged(),
            Learning::Changes(trainer, unet) => trainer.averaged().merged(unet.valid()),
        }
    }

    /// The averaged changes of a low-rank run.
    pub fn changes(&self) -> Option<LowRank> {
        match &self.learning {
            Learning::Whole(_) => None,
            Learning::Changes(trainer, _) => Some(trainer.averaged()),
        }
    }

    /// One step.
    ///
    /// # Shapes
    ///
    /// - `images`: `[batch, image channels, rows, columns]` in −1…1
    /// - `ids`: `[batch, tokens]`
    ///
    /// both outside autodiff.
    ///
    /// # Errors
    ///
    /// [`Error::Diverged`] when many steps in a row, or all of the run, had no finite loss and gradient.
    pub fn step(&mut self, images: Tensor<4>, ids: Tensor<2, Int>) -> Result<StepReport> {
        let task = self.task(images, ids);
        match &mut self.learning {
            Learning::Whole(trainer) => {
                let report = trainer.step(|unet, _, _| task.loss(unet));
                trainer.check().map(|()| report)
            }
            Learning::Changes(trainer, unet) => {
                let unet = std::sync::Mutex::new(unet.clone());
                let report = trainer.step(|changes, _, _| {
                    let unet = unet
                        .lock()
                        .unwrap_or_else(std::sync::PoisonError::into_inner);
                    task.loss(&changes.merged((**unet).clone()))
                });
                trainer.check().map(|()| report)
            }
        }
    }

    /// What the next step asks the model.
    fn task(&self, images: Tensor<4>, ids: Tensor<2, Int>) -> Task {
        let [batch, ..] = images.dims();
        let first = (self.steps() * batch) as u64;
        let random = NoiseSource::new(self.options.seed);
        let autoencoder = &self.frozen.autoencoder;
        let posterior = autoencoder.encode(images);
        let [_, channels, rows, columns] = posterior.mode().dims();
        let sources: Vec<NoiseSource> = (0..batch as u64)
            .map(|i| NoiseSource::new(self.options.seed.wrapping_add((first + i) << 16)))
            .collect();
        let inner = self.device.clone().inner();
        let draw = |stream| normal_batch(&sources, stream, [channels, rows, columns], &inner);
        let clean = autoencoder.to_latents(posterior.sample(draw(POSTERIOR_STREAM)));
        let noise = draw(FINE_TUNE_STREAM);
        let count = self.frozen.schedule.steps() as f64;
        let steps: Vec<usize> = (0..batch as u64)
            .map(|i| (random.uniform(streams::STEPS, first + i) * count) as usize)
            .collect();
        let context = self.frozen.text.last_hidden_state(ids);
        self.mixed(&steps, clean, noise, context)
    }

    fn mixed(
        &self,
        steps: &[usize],
        clean: Tensor<4>,
        noise: Tensor<4>,
        context: Tensor<3>,
    ) -> Task {
        let noised = noised(
            &self.frozen.schedule,
            self.options.prediction,
            steps,
            clean,
            noise,
        );
        let levels = steps.iter().map(|&t| self.frozen.schedule.noise_level(t));
        let snr: Vec<f64> = levels.map(|l| (l.signal / l.noise).powi(2)).collect();
        let weights = self.options.snr_gamma.map_or_else(
            || vec![1.0; steps.len()],
            |gamma| min_snr_weights(&snr, gamma, self.options.prediction),
        );
        let device = noised.sample.device();
        Task {
            sample: Tensor::from_inner(noised.sample),
            timesteps: Tensor::from_inner(noised.timesteps),
            context: Tensor::from_inner(context),
            target: Tensor::from_inner(noised.target),
            weights: Tensor::from_inner(each(weights, &device)),
        }
    }
}

/// Noisy latents, their steps, and what the model should say of them.
pub(super) struct Noised {
    /// `[batch, channels, rows, columns]`
    pub(super) sample: Tensor<4>,
    /// `[batch]`
    pub(super) timesteps: Tensor<1>,
    /// As `sample`.
    pub(super) target: Tensor<4>,
}

/// Mixes latents with noise, each as much as its step has.
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
fn each(values: Vec<f64>, device: &Device) -> Tensor<4> {
    let numbers: Vec<f32> = values.into_iter().map(|x| x as f32).collect();
    let count = numbers.len();
    Tensor::from_data(TensorData::new(numbers, [count, 1, 1, 1]), device)
}

/// Refuses what no step can be made with.
fn check(options: &FineTuneOptions) -> Result<()> {
    if options.prediction == Prediction::Flow {
        return Err(Error::Value(wake_nn::Error::Unsupported {
            option: "prediction of a fine-tuned model".to_owned(),
            value: "flow".to_owned(),
            supported: "noise, velocity, sample".to_owned(),
        }));
    }
    options.trainer.validate()
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

/// A batch of noisy latents and what the model should say of them.
struct Task {
    sample: Tensor<4>,
    timesteps: Tensor<1>,
    context: Tensor<3>,
    target: Tensor<4>,
    weights: Tensor<4>,
}

impl Task {
    fn loss(&self, unet: &UNet) -> Tensor<1> {
        let input = UNetInput {
            sample: self.sample.clone(),
            timesteps: self.timesteps.clone(),
            context: Some(self.context.clone()),
            condition: None,
        };
        let error = unet.forward(input) - self.target.clone();
        (error.square() * self.weights.clone()).mean()
    }
}

#[cfg(all(test, feature = "flex"))]
mod tests;
