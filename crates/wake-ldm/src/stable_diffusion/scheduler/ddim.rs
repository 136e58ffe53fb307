//! Denoising diffusion implicit models: deterministic, or with a chosen amount of noise.

use super::betas::{DEFAULTS, ScheduleDefaults};
use super::prediction::{Clipping, Prediction};
use super::schedule::posterior_variance;
use super::spacing::Steps;
use super::whole_path::WholePath;
use super::{
    Method, NoiseLevel, NoiseSchedule, Scheduler, StepInput, StepOutput, TerminalSnr, required,
};
use crate::options::Options;
use wake_nn::{Result, check_range};

/// Options of [`Ddim`].
#[derive(Debug, Clone)]
pub(super) struct DdimConfig {
    schedule: NoiseSchedule,
    steps: Steps,
    prediction: Prediction,
    clipping: Clipping,
    /// ᾱ after the last step: 1 if `true`, ᾱ of the first training step if `false`.
    end_at_one: bool,
    eta: f64,
    /// Whether the noise is computed from the clipped clean image instead of the prediction.
    noise_from_clipped: bool,
}

impl Method for DdimConfig {
    fn take(options: &mut Options) -> Result<Self> {
        let defaults = ScheduleDefaults {
            rescaled: Some(TerminalSnr::Zero),
            ..DEFAULTS
        };
        let schedule = NoiseSchedule::take(options, &defaults)?;
        let eta = options.f64("eta", 0.0)?;
        check_range("eta", eta, 0.0, 1.0)?;
        Ok(Self {
            steps: Steps::take(options, schedule.steps(), "leading")?,
            prediction: Prediction::take(options, &Prediction::CURVED)?,
            clipping: Clipping::take(options, true)?,
            end_at_one: options.bool("set_alpha_to_one", true)?,
            eta,
            noise_from_clipped: options.bool("use_clipped_model_output", false)?,
            schedule,
        })
    }

    fn schedule(&self) -> Option<&NoiseSchedule> {
        Some(&self.schedule)
    }

    fn start(&self, n: usize) -> Result<Box<dyn Scheduler>> {
        let steps = self.steps.whole(n)?;
        Ok(Box::new(Ddim {
            path: WholePath::new(&steps, &self.schedule, self.prediction)?,
            stride: self.schedule.steps() / n,
            config: self.clone(),
        }))
    }
}

/// Sampler that follows the predicted noise back along a straight line in (√ᾱ x₀, √(1−ᾱ) n).
///
/// | here | paper |
/// | --- | --- |
/// | `now`, `next` | αₜ, αₜ₋₁ (the paper's α is the usual ᾱ) |
/// | `deviation` | σₜ(η) |
///
/// # References
///
/// Song et al. (2021), "Denoising Diffusion Implicit Models", Eqs. 9, 12 and 16.
#[derive(Debug)]
struct Ddim {
    config: DdimConfig,
    path: WholePath,
    stride: usize,
}

impl Ddim {
    /// ᾱ at a step, and one stride below it.
    fn alphas(&self, index: usize) -> (f64, f64) {
        let DdimConfig {
            schedule,
            end_at_one,
            ..
        } = &self.config;
        let t = self.path.step(index);
        let next = t as i64 - self.stride as i64;
        (
            schedule.alpha_cumprod(t),
            schedule.alpha_or_end(next, *end_at_one),
        )
    }

    /// Standard deviation of the noise that a step adds, Eq. 16.
    fn deviation(&self, now: f64, next: f64) -> f64 {
        self.config.eta * posterior_variance(now, next).max(0.0).sqrt()
    }
}

impl Scheduler for Ddim {
    fn timesteps(&self) -> &[f64] {
        &self.path.timesteps
    }

    fn noise_level(&self, index: usize) -> NoiseLevel {
        self.path.level(index)
    }

    fn needs_noise(&self, _index: usize) -> bool {
        self.config.eta > 0.0
    }

    fn step(&mut self, input: StepInput) -> StepOutput {
        let DdimConfig {
            prediction,
            clipping,
            ..
        } = self.config;
        let (now, next) = self.alphas(input.index);
        let level = self.noise_level(input.index);
        // 1. The clean image, Eq. 9, clipped.
        let denoised = input.denoised(level, prediction, clipping);
        // 2. The noise.
        let direction = if self.config.noise_from_clipped {
            Prediction::Sample.noise(level, input.sample, denoised.clone())
        } else {
            input.direction(level, prediction)
        };
        // 3. Both again at the next level, Eq. 12; rounding may leave −1e-17 under the root.
        let deviation = self.deviation(now, next);
        let remaining = (1.0 - next - deviation * deviation).max(0.0).sqrt();
        let mut sample = denoised.clone() * next.sqrt() + direction * remaining;
        // 4. Fresh noise.
        if self.needs_noise(input.index) {
            sample = sample + required(input.noise) * deviation;
        }
        StepOutput { sample, denoised }
    }
}
