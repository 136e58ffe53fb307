//! Pseudo numerical methods for diffusion models: Runge-Kutta and linear multistep on a manifold.

use burn::tensor::Tensor;

use super::betas::{DEFAULTS, ScheduleDefaults};
use super::prediction::Prediction;
use super::spacing::{Steps, steps_out_of_range};
use super::whole_path::WholePath;
use super::{Method, NoiseLevel, NoiseSchedule, Scheduler, StepInput, StepOutput};
use crate::options::Options;
use wake_nn::Result;

/// Steps needed by the Runge-Kutta start.
const ORDER: usize = 4;

/// Options of [`Pndm`].
#[derive(Debug, Clone)]
pub(super) struct PndmConfig {
    schedule: NoiseSchedule,
    steps: Steps,
    prediction: Prediction,
    skip_runge_kutta: bool,
    end_at_one: bool,
}

impl Method for PndmConfig {
    fn take(options: &mut Options) -> Result<Self> {
        let defaults = ScheduleDefaults {
            rescaled: None,
            ..DEFAULTS
        };
        let schedule = NoiseSchedule::take(options, &defaults)?;
        Ok(Self {
            steps: Steps::take(options, schedule.steps(), "leading")?,
            prediction: Prediction::take(options, &[Prediction::Epsilon, Prediction::Velocity])?,
            skip_runge_kutta: options.bool("skip_prk_steps", false)?,
            end_at_one: options.bool("set_alpha_to_one", false)?,
            schedule,
        })
    }

    fn schedule(&self) -> Option<&NoiseSchedule> {
        Some(&self.schedule)
    }

    fn start(&self, n: usize) -> Result<Box<dyn Scheduler>> {
        let steps = self.steps.whole(n)?;
        let train = self.schedule.steps();
        let stride = train / n;
        let (calls, runge_kutta_calls) = if self.skip_runge_kutta {
            (multistep_calls(&steps), 0)
        } else if n < ORDER {
            return Err(steps_out_of_range(n, ORDER, train));
        } else {
            with_runge_kutta(&steps, stride / 2)
        };
        Ok(Box::new(Pndm {
            path: WholePath::new(&calls, &self.schedule, self.prediction)?,
            config: self.clone(),
            stride,
            runge_kutta_calls,
            calls: 0,
            history: Vec::new(),
            saved: None,
            sum: None,
        }))
    }
}

/// All steps, with the second one repeated.
fn multistep_calls(steps: &[i64]) -> Vec<i64> {
    let second = steps.get(1).copied();
    steps
        .iter()
        .take(1)
        .copied()
        .chain(second)
        .chain(steps.iter().skip(1).copied())
        .collect()
}

/// Four calls for each of the first three steps and one for each later step; also returns the number of the first calls.
fn with_runge_kutta(steps: &[i64], half: usize) -> (Vec<i64>, usize) {
    let mut calls = Vec::new();
    for i in 0..ORDER - 1 {
        let middle = steps[i + 1] + half as i64;
        calls.extend([steps[i], middle, middle, steps[i + 1]]);
    }
    let first = calls.len();
    calls.extend(&steps[ORDER - 1..]);
    (calls, first)
}

/// Multistep sampler of Stable Diffusion v1.4.
///
/// It starts with four Runge-Kutta calls for each of three steps or (as in Stable Diffusion) with
/// one step taken twice; it then fits a cubic through the last four predictions.
///
/// Started in the middle (from an image), it follows diffusers: the second call repeats the first
/// step, so the sample stays one step behind the timesteps.
///
/// # References
///
/// Liu et al. (2022), "Pseudo Numerical Methods for Diffusion Models on Manifolds", Eqs. 11 to 13.
#[derive(Debug)]
struct Pndm {
    config: PndmConfig,
    path: WholePath,
    stride: usize,
    runge_kutta_calls: usize,
    /// Calls made so far.
    calls: usize,
    /// The last predictions, newest last.
    history: Vec<Tensor<4>>,
    /// Sample at the start of a Runge-Kutta step, or of the step that is taken twice.
    saved: Option<Tensor<4>>,
    /// Weighted sum of the predictions of a Runge-Kutta step.
    sum: Option<Tensor<4>>,
}

impl Pndm {
    /// Moves a sample from one training step to another, Eq. 11.
    fn transfer(&self, sample: Tensor<4>, from: i64, to: i64, prediction: Tensor<4>) -> StepOutput {
        let PndmConfig {
            schedule,
            end_at_one,
            ..
        } = &self.config;
        let [now, next] = [from, to].map(|t| schedule.alpha_or_end(t, *end_at_one));
        let level = NoiseLevel::from_alpha_cumprod(now);
        let kind = self.config.prediction;
        let denoised = kind.denoised(level, sample.clone(), prediction.clone());
        let noise = kind.noise(level, sample.clone(), prediction);
        let divisor = now * (1.0 - next).sqrt() + (now * (1.0 - now) * next).sqrt();
        let sample = sample * (next / now).sqrt() - noise * ((next - now) / divisor);
        StepOutput { sample, denoised }
    }

    /// One of the four calls of a Runge-Kutta step, Eq. 13.
    fn runge_kutta(&mut self, t: i64, sample: Tensor<4>, prediction: Tensor<4>) -> StepOutput {
        let stage = self.calls % 4;
        let half = if stage.is_multiple_of(2) {
            self.stride / 2
        } else {
            0
        };
        if stage == 0 {
            self.history.push(prediction.clone());
            self.saved = Some(sample.clone());
        }
        let weight = [1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0][stage];
        let weighted = prediction.clone() * weight;
        let sum = match self.sum.take() {
            Some(sum) => sum + weighted,
            None => weighted,
        };
        let direction = if stage == 3 {
            sum
        } else {
            self.keep_sum(sum, prediction)
        };
        let start = self.saved.clone().unwrap_or(sample);
        let first = self.path.step(self.calls / 4 * 4) as i64;
        self.transfer(start, first, t - half as i64, direction)
    }

    fn keep_sum(&mut self, sum: Tensor<4>, prediction: Tensor<4>) -> Tensor<4> {
        self.sum = Some(sum);
        prediction
    }

    /// A call of the multistep part, Eq. 12.
    fn multistep(&mut self, t: i64, sample: Tensor<4>, prediction: Tensor<4>) -> StepOutput {
        let stride = self.stride as i64;
        if self.calls == 1
            && let (Some(start), [first]) = (self.saved.take(), self.history.as_slice())
        {
            let mean = (prediction + first.clone()) / 2.0;
            return self.transfer(start, t + stride, t, mean);
        }
        if self.history.len() >= ORDER {
            self.history.remove(0);
        }
        self.history.push(prediction);
        if self.calls == 0 {
            self.saved = Some(sample.clone());
        }
        let direction = adams_bashforth(&self.history);
        self.transfer(sample, t, t - stride, direction)
    }
}

/// Integral over the next step of the polynomial through the last predictions.
fn adams_bashforth(history: &[Tensor<4>]) -> Tensor<4> {
    let weights: &[f64] = match history.len() {
        1 => &[1.0],
        2 => &[3.0 / 2.0, -1.0 / 2.0],
        3 => &[23.0 / 12.0, -16.0 / 12.0, 5.0 / 12.0],
        _ => &[55.0 / 24.0, -59.0 / 24.0, 37.0 / 24.0, -9.0 / 24.0],
    };
    let newest = history[history.len() - 1].clone() * weights[0];
    let older = history.iter().rev().zip(weights).skip(1);
    older.fold(newest, |sum, (prediction, &weight)| {
        sum + prediction.clone() * weight
    })
}

impl Scheduler for Pndm {
    fn timesteps(&self) -> &[f64] {
        &self.path.timesteps
    }

    fn noise_level(&self, index: usize) -> NoiseLevel {
        self.path.level(index)
    }

    fn step(&mut self, input: StepInput) -> StepOutput {
        let StepInput {
            index,
            prediction,
            sample,
            ..
        } = input;
        let t = self.path.step(index) as i64;
        let output = if self.calls < self.runge_kutta_calls {
            self.runge_kutta(t, sample, prediction)
        } else {
            self.multistep(t, sample, prediction)
        };
        self.calls += 1;
        output
    }
}
