//! Denoising diffusion probabilistic models: the ancestral sampler.

use burn::tensor::Tensor;

use super::betas::{DEFAULTS, ScheduleDefaults};
use super::prediction::{Clipping, Prediction};
use super::schedule::posterior_variance;
use super::spacing::Steps;
use super::whole_path::WholePath;
use super::{
    Method, NoiseLevel, NoiseSchedule, Scheduler, StepInput, StepOutput, TerminalSnr, required,
};
use crate::options::Options;
use wake_nn::Result;

/// Variance of the fresh noise of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Variance {
    /// β̃ₜ = (1 − ᾱₜ₋₁)/(1 − ᾱₜ) βₜ, with √β̃ₜ as the noise's factor.
    Small,
    /// βₜ.
    Large,
}

/// Options of [`Ddpm`].
#[derive(Debug, Clone)]
pub(super) struct DdpmConfig {
    schedule: NoiseSchedule,
    steps: Steps,
    prediction: Prediction,
    clipping: Clipping,
    variance: Variance,
}

impl Method for DdpmConfig {
    fn take(options: &mut Options) -> Result<Self> {
        let defaults = ScheduleDefaults {
            further: Some("sigmoid"),
            rescaled: Some(TerminalSnr::Zero),
            ..DEFAULTS
        };
        let schedule = NoiseSchedule::take(options, &defaults)?;
        let known = [
            ("fixed_small", Variance::Small),
            ("fixed_small_log", Variance::Small),
            ("fixed_large", Variance::Large),
        ];
        let variance = options.choice("variance_type", "fixed_small", &known)?;
        Ok(Self {
            steps: Steps::take(options, schedule.steps(), "leading")?,
            prediction: Prediction::take(options, &Prediction::CURVED)?,
            clipping: Clipping::take(options, true)?,
            variance,
            schedule,
        })
    }

    fn schedule(&self) -> Option<&NoiseSchedule> {
        Some(&self.schedule)
    }

    fn start(&self, n: usize) -> Result<Box<dyn Scheduler>> {
        let steps = self.steps.whole(n)?;
        Ok(Box::new(Ddpm {
            path: WholePath::new(&steps, &self.schedule, self.prediction)?,
            prediction: self.prediction,
            clipping: self.clipping,
            variance: self.variance,
        }))
    }
}

/// Sampler that follows the reverse chain of the diffusion model.
///
/// | here | paper |
/// | --- | --- |
/// | `now`, `next` | ᾱₜ, ᾱₜ₋₁ |
/// | `added` | βₜ = 1 − ᾱₜ/ᾱₜ₋₁ |
///
/// # References
///
/// Ho et al. (2020), "Denoising Diffusion Probabilistic Models", Eqs. 6, 7 and 15, algorithm 2.
#[derive(Debug)]
struct Ddpm {
    path: WholePath,
    prediction: Prediction,
    clipping: Clipping,
    variance: Variance,
}

impl Ddpm {
    /// ᾱ at a step, and at the next (1 after the last).
    fn alphas(&self, index: usize) -> [f64; 2] {
        [index, index + 1].map(|index| self.path.alpha(index).unwrap_or(1.0))
    }

    /// Standard deviation of the noise that a step adds.
    fn deviation(&self, now: f64, next: f64) -> f64 {
        let variance = match self.variance {
            Variance::Small => posterior_variance(now, next).max(1e-20),
            Variance::Large => 1.0 - now / next,
        };
        variance.sqrt()
    }
}

impl Scheduler for Ddpm {
    fn timesteps(&self) -> &[f64] {
        &self.path.timesteps
    }

    fn noise_level(&self, index: usize) -> NoiseLevel {
        self.path.level(index)
    }

    fn needs_noise(&self, index: usize) -> bool {
        self.path.step(index) > 0
    }

    fn step(&mut self, input: StepInput) -> StepOutput {
        let [now, next] = self.alphas(input.index);
        let added = 1.0 - now / next;
        // 1. The clean image, Eq. 15, clipped.
        let level = self.noise_level(input.index);
        let denoised = input.denoised(level, self.prediction, self.clipping);
        // 2. The mean of the reverse step, Eq. 7.
        let of_clean = next.sqrt() * added / (1.0 - now);
        let of_sample = (now / next).sqrt() * (1.0 - next) / (1.0 - now);
        let mean: Tensor<4> = denoised.clone() * of_clean + input.sample * of_sample;
        // 3. Fresh noise, except in the last step.
        let sample = if self.needs_noise(input.index) {
            mean + required(input.noise) * self.deviation(now, next)
        } else {
            mean
        };
        StepOutput { sample, denoised }
    }
}
