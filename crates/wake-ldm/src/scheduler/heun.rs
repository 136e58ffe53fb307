//! Heun's method in the noise level σ: second order, two calls per step.

use burn::tensor::Tensor;

use super::prediction::{Clipping, Prediction};
use super::schedule::{DEFAULTS, ScheduleDefaults};
use super::sigmas::{SigmaOptions, SigmaPath, Spread};
use super::spacing::Steps;
use super::{NoiseLevel, NoiseSchedule, Scheduler, StepInput, StepOutput};
use crate::error::Result;
use crate::options::Options;

/// Options of [`Heun`].
#[derive(Debug, Clone)]
pub(super) struct HeunConfig {
    pub(super) schedule: NoiseSchedule,
    steps: Steps,
    prediction: Prediction,
    clipping: Clipping,
    sigmas: SigmaOptions,
}

impl HeunConfig {
    pub(super) fn take(options: &mut Options) -> Result<Self> {
        let defaults = ScheduleDefaults {
            ends: (0.00085, 0.012),
            further: Some("exp"),
            rescaled: None,
            ..DEFAULTS
        };
        let schedule = NoiseSchedule::take(options, &defaults)?;
        let known = [
            Prediction::Epsilon,
            Prediction::Sample,
            Prediction::Velocity,
        ];
        Ok(Self {
            steps: Steps::take(options, schedule.steps(), "linspace")?,
            prediction: Prediction::take(options, &known)?,
            clipping: Clipping::take_range(options, false)?,
            sigmas: SigmaOptions::take(options, &[Spread::Karras, Spread::Exponential])?,
            schedule,
        })
    }

    pub(super) fn init(&self, n: usize) -> Result<Heun> {
        let mut path = SigmaPath::fractional(&self.schedule, self.steps, &self.sigmas, true, n)?;
        path.timesteps = doubled(&path.timesteps, 0);
        path.sigmas = doubled(&path.sigmas, 1);
        let Self {
            prediction,
            clipping,
            ..
        } = *self;
        Ok(Heun {
            path,
            prediction,
            clipping,
            first: None,
        })
    }
}

/// Every entry twice but the first and the last few.
fn doubled(entries: &[f64], single_at_end: usize) -> Vec<f64> {
    let last = entries.len() - single_at_end;
    let twice = entries.iter().enumerate().flat_map(|(i, &entry)| {
        let times = if i == 0 || i >= last { 1 } else { 2 };
        std::iter::repeat_n(entry, times)
    });
    twice.collect()
}

/// A trial step to the next level, then the same step with the mean of both slopes.
///
/// The step to σ = 0 is Euler's, so n steps take 2n − 1 calls.
///
/// # References
///
/// Karras et al. (2022), "Elucidating the Design Space of Diffusion-Based Generative Models",
/// algorithm 1.
#[derive(Debug)]
pub(super) struct Heun {
    path: SigmaPath,
    prediction: Prediction,
    clipping: Clipping,
    /// Sample and slope at the start of the step, and its length, after the trial step.
    first: Option<(Tensor<4>, Tensor<4>, f64)>,
}

impl Scheduler for Heun {
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

    fn calls_per_step(&self) -> usize {
        2
    }

    fn step(&mut self, input: StepInput) -> StepOutput {
        let StepInput {
            index,
            prediction,
            sample,
            ..
        } = input;
        let (sigma, next) = (self.path.sigmas[index], self.path.sigmas[index + 1]);
        // 1. The clean image and the slope, at the start or at the trial's end.
        let level = self.path.level(index);
        let denoised = self.prediction.denoised(level, sample.clone(), prediction);
        let denoised = self.clipping.apply(denoised);
        let slope = (sample.clone() - denoised.clone()) / sigma;
        let sample = match self.first.take() {
            // 2. The trial step.
            None => {
                let length = next - sigma;
                self.first = Some((sample.clone(), slope.clone(), length));
                sample + slope * length
            }
            // 3. The real step.
            Some((start, first_slope, length)) => start + (first_slope + slope) * (0.5 * length),
        };
        StepOutput { sample, denoised }
    }
}
