//! Latent consistency models: a few large jumps straight to the clean image.

use super::betas::{DEFAULTS, ScheduleDefaults};
use super::prediction::{Clipping, Prediction};
use super::whole_path::WholePath;
use super::{
    Method, NoiseLevel, NoiseSchedule, Scheduler, StepInput, StepOutput, TerminalSnr, required,
};
use crate::options::Options;
use wake_nn::{Result, check_range};

/// Standard deviation of the data that the boundary condition assumes.
const SIGMA_DATA: f64 = 0.5;

/// Options of [`Lcm`].
#[derive(Debug, Clone)]
pub(super) struct LcmConfig {
    schedule: NoiseSchedule,
    prediction: Prediction,
    clipping: Clipping,
    original_steps: usize,
    timestep_scaling: f64,
}

impl Method for LcmConfig {
    fn take(options: &mut Options) -> Result<Self> {
        let defaults = ScheduleDefaults {
            curve: "scaled_linear",
            ends: (0.00085, 0.012),
            rescaled: Some(TerminalSnr::Zero),
            ..DEFAULTS
        };
        let schedule = NoiseSchedule::take(options, &defaults)?;
        let original_steps = options.usize("original_inference_steps", 50)?;
        check_range(
            "original_inference_steps",
            original_steps as f64,
            1.0,
            schedule.steps() as f64,
        )?;
        Ok(Self {
            prediction: Prediction::take(options, &Prediction::CURVED)?,
            clipping: Clipping::take(options, false)?,
            timestep_scaling: options.f64("timestep_scaling", 10.0)?,
            original_steps,
            schedule,
        })
    }

    fn schedule(&self) -> Option<&NoiseSchedule> {
        Some(&self.schedule)
    }

    fn start(&self, n: usize) -> Result<Box<dyn Scheduler>> {
        check_range("steps", n as f64, 1.0, self.original_steps as f64)?;
        let steps = visited(self.schedule.steps(), self.original_steps, n);
        Ok(Box::new(Lcm {
            path: WholePath::new(&steps, &self.schedule, self.prediction)?,
            prediction: self.prediction,
            clipping: self.clipping,
            timestep_scaling: self.timestep_scaling,
        }))
    }
}

/// Chooses n of the distillation steps, from noisy to clean.
fn visited(train: usize, original: usize, n: usize) -> Vec<i64> {
    let stride = train / original;
    let nth = |i: usize| (i as f64 * (original as f64 / n as f64)).floor() as usize;
    (0..n)
        .map(|i| ((original - nth(i)) * stride) as i64 - 1)
        .collect()
}

/// Sampler of a consistency model, which denoises and adds noise again up to the next level.
///
/// ```text
/// f(x, t) = c_skip x + c_out x₀        τ = 10 t
/// c_skip = ¼/(τ² + ¼)        c_out = τ/√(τ² + ¼)
/// ```
///
/// # References
///
/// Luo et al. (2023), "Latent Consistency Models", algorithm 3 and appendix C.
#[derive(Debug)]
struct Lcm {
    path: WholePath,
    prediction: Prediction,
    clipping: Clipping,
    timestep_scaling: f64,
}

impl Scheduler for Lcm {
    fn timesteps(&self) -> &[f64] {
        &self.path.timesteps
    }

    fn noise_level(&self, index: usize) -> NoiseLevel {
        self.path.level(index)
    }

    fn needs_noise(&self, index: usize) -> bool {
        index + 1 < self.path.len()
    }

    fn step(&mut self, input: StepInput) -> StepOutput {
        // 1. The clean image of the prediction, clipped.
        let level = self.noise_level(input.index);
        let clean = input.denoised(level, self.prediction, self.clipping);
        // 2. The boundary condition: at t = 0 the result is the sample itself.
        let tau = self.path.timesteps[input.index] * self.timestep_scaling;
        let skip = SIGMA_DATA * SIGMA_DATA / (tau * tau + SIGMA_DATA * SIGMA_DATA);
        let denoised = clean * (tau / tau.hypot(SIGMA_DATA)) + input.sample * skip;
        // 3. Up to the next level, except in the last step.
        let sample = if self.needs_noise(input.index) {
            self.noise_level(input.index + 1)
                .mix(denoised.clone(), required(input.noise))
        } else {
            denoised.clone()
        };
        StepOutput { sample, denoised }
    }
}
