//! Noise levels σ = noise/signal of the visited training steps, for methods that work in σ.

use super::spacing::{Spacing, Steps, linspace};
use super::{NoiseLevel, NoiseSchedule};
use crate::options::Options;
use wake_nn::{Error, Result};

/// Spread of noise levels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Spread {
    /// Levels of the visited training steps.
    Steps,
    /// Even in σ^(1/7).
    ///
    /// Karras et al. (2022), "Elucidating the Design Space of Diffusion-Based Generative Models",
    /// Eq. 5.
    Karras,
    /// Even in ln σ.
    Exponential,
    /// Even in ln σ, with rounded training steps.
    ///
    /// Lu et al. (2022), "DPM-Solver++", appendix D.
    Lu,
    /// Levels of a straight path.
    Flow,
}

/// Choice of the noise levels of a run.
#[derive(Debug, Clone, Copy)]
pub(super) struct SigmaOptions {
    pub(super) spread: Spread,
    /// Ends of the spread, if they differ from the ends of the schedule.
    pub(super) min: Option<f64>,
    pub(super) max: Option<f64>,
    /// Shift of a straight path.
    pub(super) flow_shift: f64,
    /// Whether levels are first spaced evenly in ln σ over the whole training range, instead of at the visited steps.
    pub(super) log_linear: bool,
}

impl SigmaOptions {
    /// Levels of the visited steps.
    pub(super) const STEPS: Self = Self {
        spread: Spread::Steps,
        min: None,
        max: None,
        flow_shift: 1.0,
        log_linear: false,
    };

    /// Reads the chosen spread, one of `known`.
    pub(super) fn take(options: &mut Options, known: &[Spread]) -> Result<Self> {
        let mut spread = Spread::Steps;
        for (key, kind) in [
            ("use_karras_sigmas", Spread::Karras),
            ("use_exponential_sigmas", Spread::Exponential),
            ("use_lu_lambdas", Spread::Lu),
            ("use_flow_sigmas", Spread::Flow),
        ] {
            let asked = known.contains(&kind) && options.bool(key, false)?;
            if asked && spread != Spread::Steps {
                return Err(options.unsupported(key, &true.into(), "one kind of sigmas at a time"));
            }
            if asked {
                spread = kind;
            }
        }
        options.only("use_beta_sigmas", &[false])?;
        Ok(Self {
            spread,
            min: options.optional_f64("sigma_min")?,
            max: options.optional_f64("sigma_max")?,
            flow_shift: options.f64("flow_shift", 1.0)?,
            log_linear: false,
        })
    }

    /// Replaces noise levels from noisy to clean by the chosen spread between the same ends.
    pub(super) fn respread(&self, sigmas: &[f64], n: usize) -> Vec<f64> {
        let first = self.max.unwrap_or(sigmas[0]);
        let last = self.min.unwrap_or(sigmas[sigmas.len() - 1]);
        match self.spread {
            Spread::Karras => karras(first, last, n),
            Spread::Exponential | Spread::Lu => linspace(first.ln(), last.ln(), n)
                .into_iter()
                .map(f64::exp)
                .collect(),
            Spread::Steps | Spread::Flow => sigmas.to_vec(),
        }
    }
}

/// `σᵢ = (σ_max^{1/ρ} + i/(n−1) (σ_min^{1/ρ} − σ_max^{1/ρ}))^ρ` with ρ = 7.
fn karras(first: f64, last: f64, n: usize) -> Vec<f64> {
    const RHO: f64 = 7.0;
    let (first, last) = (first.powf(1.0 / RHO), last.powf(1.0 / RHO));
    linspace(0.0, 1.0, n)
        .into_iter()
        .map(|ramp| (first + ramp * (last - first)).powf(RHO))
        .collect()
}

/// Noise levels of all training steps, with interpolation between them.
#[derive(Debug)]
pub(super) struct SigmaTable {
    sigmas: Vec<f64>,
    logarithms: Vec<f64>,
}

impl SigmaTable {
    pub(super) fn new(schedule: &NoiseSchedule) -> Self {
        let sigmas = schedule.sigmas();
        Self {
            logarithms: sigmas.iter().map(|sigma| f64::from(sigma.ln())).collect(),
            sigmas: sigmas.into_iter().map(f64::from).collect(),
        }
    }

    /// Smallest noise level of training.
    pub(super) fn smallest(&self) -> f64 {
        self.sigmas[0]
    }

    /// All noise levels, from noisy to clean.
    pub(super) fn falling(&self) -> Vec<f64> {
        self.sigmas.iter().rev().copied().collect()
    }

    /// Noise level at a (fractional) training step, linear between steps and constant beyond the ends.
    pub(super) fn sigma(&self, t: f64) -> f64 {
        let last = self.sigmas.len() - 1;
        let below = (t.max(0.0).floor() as usize).min(last);
        let above = (below + 1).min(last);
        let weight = (t - below as f64).clamp(0.0, 1.0);
        self.sigmas[below] + (self.sigmas[above] - self.sigmas[below]) * weight
    }

    /// (Fractional) training step of a noise level, linear in ln σ and constant beyond the ends.
    pub(super) fn timestep(&self, sigma: f64) -> f64 {
        let logarithm = sigma.max(1e-10).ln();
        let at_most = self.logarithms.partition_point(|&entry| entry <= logarithm);
        let low = at_most.saturating_sub(1).min(self.logarithms.len() - 2);
        let (below, above) = (self.logarithms[low], self.logarithms[low + 1]);
        let weight = ((below - logarithm) / (below - above)).clamp(0.0, 1.0);
        (1.0 - weight) * low as f64 + weight * (low + 1) as f64
    }
}

/// Training steps visited by Euler's family, with one noise level more.
#[derive(Debug, Clone)]
pub(super) struct SigmaPath {
    pub(super) timesteps: Vec<f64>,
    pub(super) sigmas: Vec<f64>,
    leading: bool,
}

impl SigmaPath {
    /// Path of a method in σ, with fractional steps and levels spread between its own ends.
    pub(super) fn fractional(
        schedule: &NoiseSchedule,
        steps: Steps,
        options: &SigmaOptions,
        end_at_zero: bool,
        n: usize,
    ) -> Result<Self> {
        let table = SigmaTable::new(schedule);
        let end = if end_at_zero { 0.0 } else { table.smallest() };
        let mut timesteps: Vec<f64> = steps.fractional(n)?.into_iter().map(round).collect();
        let mut sigmas: Vec<f64> = if options.log_linear {
            let all = SigmaOptions {
                spread: Spread::Exponential,
                ..*options
            };
            all.respread(&table.falling(), n + 1)
        } else {
            timesteps.iter().map(|&t| table.sigma(t)).collect()
        };
        if options.spread != Spread::Steps {
            sigmas = options.respread(&sigmas, n);
            timesteps = sigmas
                .iter()
                .map(|&sigma| round(table.timestep(sigma)))
                .collect();
        }
        check_positive(&sigmas)?;
        sigmas.push(end);
        let sigmas = sigmas.into_iter().map(round).collect();
        Ok(Self {
            timesteps,
            sigmas,
            leading: steps.spacing == Spacing::Leading,
        })
    }

    /// Factor of the initial noise: σ, or √(σ² + 1) with leading spacing.
    pub(super) fn init_noise_sigma(&self) -> f64 {
        let largest = self.sigmas.iter().copied().fold(0.0, f64::max);
        if self.leading {
            largest.hypot(1.0)
        } else {
            largest
        }
    }

    /// Noise level before a step, of x = x₀ + σ n.
    pub(super) fn level(&self, index: usize) -> NoiseLevel {
        NoiseLevel {
            signal: 1.0,
            noise: self.sigmas[index],
        }
    }

    /// Factor of the model's input: 1/√(σ² + 1).
    pub(super) fn input_scale(&self, index: usize) -> f64 {
        1.0 / self.sigmas[index].hypot(1.0)
    }
}

/// Rounds to f32, as PyTorch does.
pub(super) fn round(x: f64) -> f64 {
    f64::from(x as f32)
}

/// Reads `final_sigmas_type`: whether a run ends at σ = 0 or at the smallest level of training.
pub(super) fn take_final_zero(options: &mut Options) -> Result<bool> {
    let known = [("zero", true), ("sigma_min", false)];
    options.choice("final_sigmas_type", "zero", &known)
}

/// Rejects a path on which a noise level is not a positive number.
pub(super) fn check_positive(sigmas: &[f64]) -> Result<()> {
    match sigmas
        .iter()
        .find(|sigma| !sigma.is_finite() || **sigma <= 0.0)
    {
        None => Ok(()),
        Some(&sigma) => Err(Error::OutOfRange {
            name: "sigma (from sigma_min, sigma_max and the schedule)".to_owned(),
            value: sigma,
            min: f64::MIN_POSITIVE,
            max: f64::MAX,
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stable_diffusion::scheduler::{BetaCurve, TerminalSnr};

    fn table() -> SigmaTable {
        let curve = BetaCurve::ScaledLinear(0.00085, 0.012);
        SigmaTable::new(&NoiseSchedule::new(&curve, 1000, TerminalSnr::Kept).unwrap())
    }

    /// Karras levels of Stable Diffusion's range in ten steps, against the four decimals that diffusers prints.
    #[test]
    fn karras_levels_are_those_of_diffusers() {
        let expected = [
            14.6146, 9.1029, 5.4784, 3.1686, 1.7494, 0.9141, 0.4469, 0.2014, 0.0819, 0.0292,
        ];
        for (sigma, expected) in karras(14.6146, 0.0291672, 10).into_iter().zip(expected) {
            assert!((sigma - expected).abs() < 6e-5, "{sigma} {expected}");
        }
    }

    #[test]
    fn sigma_and_timestep_are_inverse_at_training_steps_and_held_at_the_ends() {
        let table = table();
        for t in 0..1000 {
            let back = table.timestep(table.sigma(f64::from(t)));
            // ln σ is held in f32: 2^-24 · 4 over a slope of 2e-3 per step.
            assert!((back - f64::from(t)).abs() < 1e-3, "{t} {back}");
        }
        assert!(table.timestep(0.0).abs() < 1e-12);
        assert!((table.timestep(1e9) - 999.0).abs() < 1e-12);
        assert!((table.sigma(2000.0) - table.sigma(999.0)).abs() < 1e-12);
        assert!((table.sigma(0.5) * 2.0 - table.sigma(0.0) - table.sigma(1.0)).abs() < 1e-12);
    }
}
