//! Noise added per training step, and the schedulers' default assumptions about it.

use serde_json::Value;

use crate::options::{Options, list};
use wake_nn::{Result, check_range};

/// Shape of the noise added per training step, βₜ.
#[derive(Debug, Clone, PartialEq)]
pub enum BetaCurve {
    /// Evenly spaced between two numbers.
    Linear(f64, f64),
    /// Squares of evenly spaced square roots, as in Stable Diffusion.
    ScaledLinear(f64, f64),
    /// From a signal that falls as a squared cosine, at most 0.999.
    SquaredCosine,
    /// From a signal that falls as exp(−12 t), at most 0.999.
    Exponential,
    /// A logistic curve between two numbers.
    Sigmoid(f64, f64),
    /// Numbers given one by one.
    Trained(Vec<f64>),
}

impl BetaCurve {
    pub(super) fn betas(&self, steps: usize) -> Result<Vec<f32>> {
        if let Self::Linear(first, last)
        | Self::ScaledLinear(first, last)
        | Self::Sigmoid(first, last) = *self
        {
            check_range("beta_start", first, 1e-8, 0.9999)?;
            check_range("beta_end", last, 1e-8, 0.9999)?;
        }
        Ok(match self {
            Self::Linear(first, last) => linspace(*first, *last, steps),
            Self::ScaledLinear(first, last) => linspace(first.sqrt(), last.sqrt(), steps)
                .iter()
                .map(|root| root * root)
                .collect(),
            Self::SquaredCosine => betas_of(squared_cosine, steps),
            Self::Exponential => betas_of(|t| (-12.0 * t).exp(), steps),
            Self::Sigmoid(first, last) => sigmoid_betas(*first, *last, steps),
            Self::Trained(betas) => trained(betas, steps)?,
        })
    }

    /// Reads `beta_schedule`, `beta_start`, `beta_end` and `trained_betas`.
    pub(super) fn take(options: &mut Options, defaults: &ScheduleDefaults) -> Result<Self> {
        let first = options.f64("beta_start", defaults.ends.0)?;
        let last = options.f64("beta_end", defaults.ends.1)?;
        let numbers = |value: &Value| list(value, Value::as_f64);
        if let Some(betas) = options.read("trained_betas", "a list of numbers", numbers)? {
            return Ok(Self::Trained(betas));
        }
        let mut known = vec![
            ("linear", Self::Linear(first, last)),
            ("scaled_linear", Self::ScaledLinear(first, last)),
            ("squaredcos_cap_v2", Self::SquaredCosine),
        ];
        known.extend(defaults.further.map(|name| match name {
            "exp" => (name, Self::Exponential),
            _ => (name, Self::Sigmoid(first, last)),
        }));
        options.choice("beta_schedule", defaults.curve, &known)
    }
}

/// Treatment of the signal remaining at the last training step.
///
/// # References
///
/// Lin et al. (2024), "Common Diffusion Noise Schedules and Sample Steps are Flawed", algorithm 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TerminalSnr {
    /// The signal is kept.
    Kept,
    /// The schedule is stretched until no signal remains.
    Zero,
    /// As `Zero`, with 2⁻²⁴ kept in the last step, so that σ stays finite.
    AlmostZero,
}

/// Schedule that a scheduler assumes for missing options.
#[derive(Debug)]
pub(super) struct ScheduleDefaults {
    /// Name of the default curve.
    pub(super) curve: &'static str,
    /// First and last β.
    pub(super) ends: (f64, f64),
    /// Curve that only this scheduler supports.
    pub(super) further: Option<&'static str>,
    /// Effect of rescaling to zero terminal SNR; `None` if the scheduler does not support it.
    pub(super) rescaled: Option<TerminalSnr>,
}

/// Defaults of most schedulers.
pub(super) const DEFAULTS: ScheduleDefaults = ScheduleDefaults {
    curve: "linear",
    ends: (1e-4, 0.02),
    further: None,
    rescaled: Some(TerminalSnr::AlmostZero),
};

/// Evenly spaced f32 numbers, counted from both ends as PyTorch does.
fn linspace(first: f64, last: f64, steps: usize) -> Vec<f32> {
    let (first, last) = (first as f32, last as f32);
    let step = (last - first) / (steps - 1) as f32;
    let value = |i: usize| {
        if i < steps / 2 {
            first + step * i as f32
        } else {
            last - step * (steps - 1 - i) as f32
        }
    };
    (0..steps).map(value).collect()
}

/// β for which the signal falls as a function of t in [0, 1], at most 0.999.
fn betas_of(signal: impl Fn(f64) -> f64, steps: usize) -> Vec<f32> {
    let at = |i: usize| signal(i as f64 / steps as f64);
    (0..steps)
        .map(|i| (1.0 - at(i + 1) / at(i)).min(0.999) as f32)
        .collect()
}

fn squared_cosine(t: f64) -> f64 {
    ((t + 0.008) / 1.008 * std::f64::consts::FRAC_PI_2)
        .cos()
        .powi(2)
}

fn sigmoid_betas(first: f64, last: f64, steps: usize) -> Vec<f32> {
    let rise = (last - first) as f32;
    let logistic = |x: f32| 1.0 / (1.0 + (-x).exp());
    linspace(-6.0, 6.0, steps)
        .into_iter()
        .map(|x| logistic(x) * rise + first as f32)
        .collect()
}

fn trained(betas: &[f64], steps: usize) -> Result<Vec<f32>> {
    check_range(
        "length of trained_betas",
        betas.len() as f64,
        steps as f64,
        steps as f64,
    )?;
    for (i, &beta) in betas.iter().enumerate() {
        let (min, max) = if i == 0 { (1e-8, 0.9999) } else { (0.0, 1.0) };
        check_range("trained_betas", beta, min, max)?;
    }
    Ok(betas.iter().map(|&beta| beta as f32).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stable_diffusion::scheduler::NoiseSchedule;

    /// The closed form of the cosine curve at both ends and in the middle: with the well-known bug of integer
    /// division, all betas but the last are zero.
    #[test]
    fn cosine_betas_match_their_closed_form() {
        let schedule =
            NoiseSchedule::new(&BetaCurve::SquaredCosine, 1000, TerminalSnr::Kept).unwrap();
        let ratio = squared_cosine(0.5) / squared_cosine(0.0);
        assert!((schedule.alpha_cumprod(499) / ratio - 1.0).abs() < 1e-5);
        assert!((f64::from(schedule.betas()[0]) - 4.1284e-5).abs() < 1e-8);
        assert!((schedule.betas()[999] - 0.999).abs() < 1e-7);
    }
}
