//! Euler's method on straight paths from noise to image.

use super::prediction::{Clipping, Prediction};
use super::sigmas::{SigmaOptions, Spread, check_positive, round};
use super::spacing::linspace;
use super::{Method, NoiseLevel, NoiseSchedule, Scheduler, StepInput, StepOutput, required};
use crate::options::Options;
use wake_nn::{Result, check_range};

/// Options of [`FlowMatchEuler`].
#[derive(Debug, Clone)]
pub(super) struct FlowMatchEulerConfig {
    train: usize,
    shift: f64,
    /// Noise level to which the last step is stretched.
    terminal: Option<f64>,
    sigmas: SigmaOptions,
    /// Whether the path runs from image to noise.
    inverted: bool,
    /// Whether every step denoises fully and adds fresh noise.
    stochastic: bool,
}

impl Method for FlowMatchEulerConfig {
    fn take(options: &mut Options) -> Result<Self> {
        let train = options.usize("num_train_timesteps", 1000)?;
        check_range("num_train_timesteps", train as f64, 2.0, 1e5)?;
        let shift = options.f64("shift", 1.0)?;
        check_range("shift", shift, 1e-3, 1e3)?;
        let terminal = options
            .optional_f64("shift_terminal")?
            .filter(|&sigma| sigma > 0.0);
        check_range("shift_terminal", terminal.unwrap_or(0.0), 0.0, 0.999)?;
        options.only("use_dynamic_shifting", &[false])?;
        Ok(Self {
            train,
            shift,
            terminal,
            sigmas: SigmaOptions::take(options, &[Spread::Karras, Spread::Exponential])?,
            inverted: options.bool("invert_sigmas", false)?,
            stochastic: options.bool("stochastic_sampling", false)?,
        })
    }

    fn schedule(&self) -> Option<&NoiseSchedule> {
        None
    }

    fn start(&self, n: usize) -> Result<Box<dyn Scheduler>> {
        check_range("steps", n as f64, 1.0, self.train as f64)?;
        let mut sigmas = self.levels(n);
        check_positive(&sigmas)?;
        if self.inverted {
            sigmas
                .iter_mut()
                .for_each(|sigma| *sigma = round(1.0 - *sigma));
        }
        let timesteps = sigmas
            .iter()
            .map(|sigma| round(sigma * self.train as f64))
            .collect();
        sigmas.push(if self.inverted { 1.0 } else { 0.0 });
        Ok(Box::new(FlowMatchEuler {
            timesteps,
            sigmas,
            stochastic: self.stochastic,
        }))
    }
}

impl FlowMatchEulerConfig {
    /// Noise levels, falling from 1. diffusers shifts twice: the ends of its range, then every level.
    fn levels(&self, n: usize) -> Vec<f64> {
        let train = self.train as f64;
        let (first, last) = (
            round(self.shifted(1.0)),
            round(self.shifted(round(1.0 / train))),
        );
        let even = linspace(first * train, last * train, n);
        let mut sigmas: Vec<f64> = even.into_iter().map(|t| self.shifted(t / train)).collect();
        if let Some(terminal) = self.terminal {
            stretch(&mut sigmas, terminal);
        }
        self.sigmas
            .respread(&sigmas, n)
            .into_iter()
            .map(round)
            .collect()
    }

    /// σ' = k σ/(1 + (k − 1) σ).
    fn shifted(&self, sigma: f64) -> f64 {
        self.shift * sigma / (1.0 + (self.shift - 1.0) * sigma)
    }
}

/// Stretches 1 − σ so that the last level becomes `terminal`.
fn stretch(sigmas: &mut [f64], terminal: f64) {
    let scale = (1.0 - sigmas[sigmas.len() - 1]) / (1.0 - terminal);
    if scale > 0.0 {
        sigmas
            .iter_mut()
            .for_each(|sigma| *sigma = 1.0 - (1.0 - *sigma) / scale);
    }
}

/// Follows the velocity v = n − x₀ along x = (1 − σ) x₀ + σ n.
///
/// # References
///
/// Lipman et al. (2023), "Flow Matching for Generative Modeling", Eq. 20. Esser et al. (2024),
/// "Scaling Rectified Flow Transformers for High-Resolution Image Synthesis", Eq. 23 (shift).
#[derive(Debug)]
struct FlowMatchEuler {
    timesteps: Vec<f64>,
    sigmas: Vec<f64>,
    stochastic: bool,
}

impl Scheduler for FlowMatchEuler {
    fn timesteps(&self) -> &[f64] {
        &self.timesteps
    }

    fn noise_level(&self, index: usize) -> NoiseLevel {
        let sigma = self.sigmas[index];
        NoiseLevel {
            signal: 1.0 - sigma,
            noise: sigma,
        }
    }

    fn needs_noise(&self, _index: usize) -> bool {
        self.stochastic
    }

    fn step(&mut self, input: StepInput) -> StepOutput {
        let (level, end) = (
            self.noise_level(input.index),
            self.noise_level(input.index + 1),
        );
        let denoised = input.denoised(level, Prediction::Flow, Clipping::Off);
        let sample = if self.stochastic {
            end.mix(denoised.clone(), required(input.noise))
        } else {
            input.sample + input.prediction * (end.noise - level.noise)
        };
        StepOutput { sample, denoised }
    }
}
