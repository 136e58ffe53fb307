//! Euler's method in the noise level σ.

use burn::tensor::Tensor;
use serde_json::Value;

use super::prediction::Prediction;
use super::schedule::DEFAULTS;
use super::sigmas::{SigmaOptions, SigmaPath, Spread, round, take_final_zero};
use super::spacing::Steps;
use super::{NoiseLevel, NoiseSchedule, Scheduler, StepInput, StepOutput};
use crate::error::Result;
use crate::options::Options;

/// Options of [`Euler`].
#[derive(Debug, Clone)]
pub(super) struct EulerConfig {
    pub(super) schedule: NoiseSchedule,
    steps: Steps,
    prediction: Prediction,
    sigmas: SigmaOptions,
    end_at_zero: bool,
    /// The model is told ln σ / 4 in place of the training step.
    continuous: bool,
}

impl EulerConfig {
    pub(super) fn take(options: &mut Options) -> Result<Self> {
        let schedule = NoiseSchedule::take(options, &DEFAULTS)?;
        let known = [
            Prediction::Epsilon,
            Prediction::Sample,
            Prediction::Velocity,
        ];
        let prediction = Prediction::take(options, &known)?;
        let mut sigmas = SigmaOptions::take(options, &[Spread::Karras, Spread::Exponential])?;
        sigmas.log_linear = take_choice(options, "interpolation_type", ["linear", "log_linear"])?;
        let continuous = take_choice(options, "timestep_type", ["discrete", "continuous"])?;
        Ok(Self {
            steps: Steps::take(options, schedule.steps(), "linspace")?,
            end_at_zero: take_final_zero(options)?,
            continuous: continuous && prediction == Prediction::Velocity,
            sigmas,
            prediction,
            schedule,
        })
    }

    pub(super) fn init(&self, n: usize) -> Result<Euler> {
        let mut path = SigmaPath::fractional(
            &self.schedule,
            self.steps,
            &self.sigmas,
            self.end_at_zero,
            n,
        )?;
        if self.continuous {
            path.timesteps = path.sigmas[..n]
                .iter()
                .map(|sigma| round(0.25 * sigma.ln()))
                .collect();
        }
        Ok(Euler {
            path,
            prediction: self.prediction,
        })
    }
}

/// Whether an option has the second of two values.
fn take_choice(options: &mut Options, key: &str, [first, second]: [&str; 2]) -> Result<bool> {
    let name = options.string(key, first)?;
    if name == first || name == second {
        return Ok(name == second);
    }
    Err(options.unsupported(key, &Value::from(name), &format!("{first}, {second}")))
}

/// Follows dx/dσ = (x − x₀)/σ by straight lines.
///
/// # References
///
/// Karras et al. (2022), "Elucidating the Design Space of Diffusion-Based Generative Models",
/// algorithm 2 without churn.
#[derive(Debug)]
pub(super) struct Euler {
    path: SigmaPath,
    prediction: Prediction,
}

impl Scheduler for Euler {
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

    fn step(&mut self, input: StepInput) -> StepOutput {
        let StepInput {
            index,
            prediction,
            sample,
            ..
        } = input;
        let (sigma, next) = (self.path.sigmas[index], self.path.sigmas[index + 1]);
        let level = self.path.level(index);
        // 1. The clean image.
        let denoised = self.prediction.denoised(level, sample.clone(), prediction);
        // 2. The slope of the path.
        let slope = (sample.clone() - denoised.clone()) / sigma;
        // 3. Along it to the next level.
        StepOutput {
            sample: sample + slope * (next - sigma),
            denoised,
        }
    }
}
