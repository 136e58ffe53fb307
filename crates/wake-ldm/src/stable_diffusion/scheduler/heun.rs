//! Heun's method in the noise level σ: second order, two calls per step.

use burn::tensor::Tensor;

use super::betas::{DEFAULTS, ScheduleDefaults};
use super::prediction::{Clipping, Prediction};
use super::sigma_sampler::{Call, SigmaConfig, SigmaMethod};
use super::sigmas::{SigmaOptions, SigmaPath, Spread};
use crate::options::Options;
use wake_nn::Result;

/// A trial step to the next level, then the same step with the mean of both slopes.
///
/// The step to σ = 0 is Euler's, so n steps take 2n − 1 calls.
///
/// # References
///
/// Karras et al. (2022), "Elucidating the Design Space of Diffusion-Based Generative Models",
/// algorithm 1.
#[derive(Debug, Clone)]
pub(super) struct Heun {
    /// Sample and slope at the start of the step, and its length, after the trial step.
    first: Option<(Tensor<4>, Tensor<4>, f64)>,
}

impl SigmaMethod for Heun {
    fn take(options: &mut Options) -> Result<SigmaConfig<Self>> {
        let defaults = ScheduleDefaults {
            ends: (0.00085, 0.012),
            further: Some("exp"),
            rescaled: None,
            ..DEFAULTS
        };
        let method = Self { first: None };
        let mut config = SigmaConfig::take_common(options, &defaults, &Prediction::CURVED, method)?;
        config.clipping = Clipping::take_range(options, false)?;
        config.sigmas = SigmaOptions::take(options, &[Spread::Karras, Spread::Exponential])?;
        Ok(config)
    }

    fn visited(&self, mut path: SigmaPath) -> SigmaPath {
        path.timesteps = doubled(&path.timesteps, 0);
        path.sigmas = doubled(&path.sigmas, 1);
        path
    }

    fn calls_per_step(&self) -> usize {
        2
    }

    fn advance(&mut self, call: Call<'_>) -> Tensor<4> {
        let (sigma, next) = call.ends();
        let Call { sample, slope, .. } = call;
        match self.first.take() {
            // 1. The trial step.
            None => {
                let length = next - sigma;
                self.first = Some((sample.clone(), slope.clone(), length));
                sample + slope * length
            }
            // 2. The real step.
            Some((start, first_slope, length)) => start + (first_slope + slope) * (0.5 * length),
        }
    }
}

/// Repeats every entry twice, except the first and the last few.
fn doubled(entries: &[f64], single_at_end: usize) -> Vec<f64> {
    let last = entries.len() - single_at_end;
    let twice = entries.iter().enumerate().flat_map(|(i, &entry)| {
        let times = if i == 0 || i >= last { 1 } else { 2 };
        std::iter::repeat_n(entry, times)
    });
    twice.collect()
}
