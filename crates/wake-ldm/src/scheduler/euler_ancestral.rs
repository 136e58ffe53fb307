//! Euler's method with fresh noise at every step.

use burn::tensor::Tensor;

use super::prediction::Prediction;
use super::schedule::DEFAULTS;
use super::sigmas::{SigmaOptions, SigmaPath};
use super::spacing::Steps;
use super::{NoiseLevel, NoiseSchedule, Scheduler, StepInput, StepOutput, required};
use crate::error::Result;
use crate::options::Options;

/// Options of [`EulerAncestral`].
#[derive(Debug, Clone)]
pub(super) struct EulerAncestralConfig {
    pub(super) schedule: NoiseSchedule,
    steps: Steps,
    prediction: Prediction,
    sigmas: SigmaOptions,
}

impl EulerAncestralConfig {
    pub(super) fn take(options: &mut Options) -> Result<Self> {
        let schedule = NoiseSchedule::take(options, &DEFAULTS)?;
        Ok(Self {
            steps: Steps::take(options, schedule.steps(), "linspace")?,
            prediction: Prediction::take(options, &[Prediction::Epsilon, Prediction::Velocity])?,
            sigmas: SigmaOptions::STEPS,
            schedule,
        })
    }

    pub(super) fn init(&self, n: usize) -> Result<EulerAncestral> {
        let path = SigmaPath::fractional(&self.schedule, self.steps, &self.sigmas, true, n)?;
        Ok(EulerAncestral {
            path,
            prediction: self.prediction,
        })
    }
}

/// Steps further down than the next level, and adds noise to come back up to it.
///
/// ```text
/// σ_up² = σ'² (σ² − σ'²)/σ²        σ_down² = σ'² − σ_up²
/// ```
///
/// # References
///
/// Song et al. (2021), "Denoising Diffusion Implicit Models", Eq. 16 with η = 1, written in σ.
#[derive(Debug)]
pub(super) struct EulerAncestral {
    path: SigmaPath,
    prediction: Prediction,
}

impl Scheduler for EulerAncestral {
    fn timesteps(&self) -> &[f64] {
        &self.path.timesteps
    }

    fn init_noise_sigma(&self) -> f64 {
        self.path.init_noise_sigma()
    }

    fn noise_level(&self, index: usize) -> NoiseLevel {
        self.path.level(index)
    }

    fn scale_model_input(&self, sample: Tensor<4>, index: usize) -> Tensor<4> {
        sample * self.path.input_scale(index)
    }

    fn needs_noise(&self, _index: usize) -> bool {
        true
    }

    fn step(&mut self, input: StepInput) -> StepOutput {
        let StepInput {
            index,
            prediction,
            sample,
            noise,
        } = input;
        let (sigma, next) = (self.path.sigmas[index], self.path.sigmas[index + 1]);
        let (up, down) = ancestral_step(sigma, next);
        // 1. The clean image and the slope towards it.
        let level = self.path.level(index);
        let denoised = self.prediction.denoised(level, sample.clone(), prediction);
        let slope = (sample.clone() - denoised.clone()) / sigma;
        // 2. Down along the slope, and up with noise.
        let sample = sample + slope * (down - sigma) + required(noise) * up;
        StepOutput { sample, denoised }
    }
}

/// The levels `σ_up` and `σ_down` of a step from σ to σ'.
fn ancestral_step(sigma: f64, next: f64) -> (f64, f64) {
    let up = (next * next * (sigma * sigma - next * next) / (sigma * sigma))
        .max(0.0)
        .sqrt();
    (up, (next * next - up * up).max(0.0).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_and_remainder_add_up_to_the_next_level() {
        for (sigma, next) in [(14.6, 9.1), (1.0, 1.0), (0.03, 0.0), (4096.0, 20.0)] {
            let (up, down) = ancestral_step(sigma, next);
            assert!((up.hypot(down) - next).abs() < 1e-12 * (1.0 + next));
            assert!(up >= 0.0 && down >= 0.0 && down <= next);
        }
    }
}
