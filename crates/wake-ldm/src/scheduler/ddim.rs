//! Denoising diffusion implicit models: deterministic, or with as much noise as is asked for.

use super::prediction::{Clipping, Prediction};
use super::schedule::{DEFAULTS, ScheduleDefaults, check_timestep};
use super::spacing::Steps;
use super::{NoiseLevel, NoiseSchedule, Scheduler, StepInput, StepOutput, TerminalSnr, required};
use crate::error::{Result, check_range};
use crate::options::Options;

/// Options of [`Ddim`].
#[derive(Debug, Clone)]
pub(super) struct DdimConfig {
    pub(super) schedule: NoiseSchedule,
    steps: Steps,
    prediction: Prediction,
    clipping: Clipping,
    /// ᾱ after the last step is 1, or else that of the first training step.
    end_at_one: bool,
    eta: f64,
    /// The noise follows from the limited clean image, not from the prediction.
    noise_from_clipped: bool,
}

impl DdimConfig {
    pub(super) fn take(options: &mut Options) -> Result<Self> {
        let defaults = ScheduleDefaults {
            rescaled: Some(TerminalSnr::Zero),
            ..DEFAULTS
        };
        let schedule = NoiseSchedule::take(options, &defaults)?;
        let known = [
            Prediction::Epsilon,
            Prediction::Sample,
            Prediction::Velocity,
        ];
        let eta = options.f64("eta", 0.0)?;
        check_range("eta", eta, 0.0, 1.0)?;
        Ok(Self {
            steps: Steps::take(options, schedule.steps(), "leading")?,
            prediction: Prediction::take(options, &known)?,
            clipping: Clipping::take(options, true)?,
            end_at_one: options.bool("set_alpha_to_one", true)?,
            eta,
            noise_from_clipped: options.bool("use_clipped_model_output", false)?,
            schedule,
        })
    }

    pub(super) fn init(&self, n: usize) -> Result<Ddim> {
        let steps = self.steps.whole(n)?;
        let train = self.schedule.steps();
        let visited: Vec<usize> = steps
            .iter()
            .map(|&t| check_timestep(t, train))
            .collect::<Result<_>>()?;
        self.prediction
            .check_signal(self.schedule.noise_level(visited[0]).signal)?;
        Ok(Ddim {
            config: self.clone(),
            timesteps: steps.iter().map(|&t| t as f64).collect(),
            stride: train / n,
            visited,
        })
    }
}

/// The sampler that follows the model's noise back along a straight line in (√ᾱ x₀, √(1−ᾱ) n).
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
pub(super) struct Ddim {
    config: DdimConfig,
    timesteps: Vec<f64>,
    visited: Vec<usize>,
    stride: usize,
}

impl Ddim {
    /// ᾱ at a step and one stride further down.
    fn alphas(&self, index: usize) -> (f64, f64) {
        let t = self.visited[index];
        (
            self.config.schedule.alpha_cumprod(t),
            self.config.alpha_after(t, self.stride),
        )
    }

    /// The standard deviation of the noise that a step adds, Eq. 16.
    fn deviation(&self, now: f64, next: f64) -> f64 {
        self.config.eta
            * ((1.0 - next) / (1.0 - now) * (1.0 - now / next))
                .max(0.0)
                .sqrt()
    }
}

impl DdimConfig {
    fn alpha_after(&self, t: usize, stride: usize) -> f64 {
        match t.checked_sub(stride) {
            Some(next) => self.schedule.alpha_cumprod(next),
            None if self.end_at_one => 1.0,
            None => self.schedule.alpha_cumprod(0),
        }
    }
}

impl Scheduler for Ddim {
    fn timesteps(&self) -> &[f64] {
        &self.timesteps
    }

    fn noise_level(&self, index: usize) -> NoiseLevel {
        self.config.schedule.noise_level(self.visited[index])
    }

    fn needs_noise(&self, _index: usize) -> bool {
        self.config.eta > 0.0
    }

    fn step(&mut self, input: StepInput) -> StepOutput {
        let StepInput {
            index,
            prediction,
            sample,
            noise,
        } = input;
        let DdimConfig {
            prediction: kind,
            clipping,
            ..
        } = self.config;
        let (now, next) = self.alphas(index);
        let level = self.noise_level(index);
        // 1. The clean image, Eq. 9, limited.
        let denoised = clipping.apply(kind.denoised(level, sample.clone(), prediction.clone()));
        // 2. The noise.
        let direction = if self.config.noise_from_clipped {
            Prediction::Sample.noise(level, sample, denoised.clone())
        } else {
            kind.noise(level, sample, prediction)
        };
        // 3. Both again at the next level, Eq. 12; rounding may leave −1e-17 under the root.
        let deviation = self.deviation(now, next);
        let remaining = (1.0 - next - deviation * deviation).max(0.0).sqrt();
        let mut sample = denoised.clone() * next.sqrt() + direction * remaining;
        // 4. Fresh noise.
        if self.needs_noise(index) {
            sample = sample + required(noise) * deviation;
        }
        StepOutput { sample, denoised }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scheduler::BetaCurve;

    /// Published variances of the linear schedule.
    #[test]
    fn variances_are_the_published_ones() {
        let curve = BetaCurve::Linear(1e-4, 0.02);
        let schedule = NoiseSchedule::new(&curve, 1000, TerminalSnr::Kept).unwrap();
        for (t, next, expected) in [
            (420, 400, 0.14771),
            (980, 960, 0.32460),
            (487, 486, 0.00979),
            (999, 998, 0.02),
        ] {
            let (now, next) = (schedule.alpha_cumprod(t), schedule.alpha_cumprod(next));
            let variance = (1.0 - next) / (1.0 - now) * (1.0 - now / next);
            assert!((variance - expected).abs() < 1e-5, "{t}: {variance}");
        }
    }
}
