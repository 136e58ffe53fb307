//! What the exponential integrators share: whole training steps, and levels in λ = ln(α/σ).

use super::sigmas::{SigmaOptions, SigmaTable, Spread, check_positive, round};
use super::spacing::{Steps, linspace};
use super::{NoiseLevel, NoiseSchedule};
use crate::error::Result;

/// What an exponential integrator visits.
#[derive(Debug, Clone)]
pub(super) struct LogSnrPath {
    pub(super) timesteps: Vec<f64>,
    /// One more than timesteps.
    sigmas: Vec<f64>,
    flow: bool,
}

/// Options of a [`LogSnrPath`].
#[derive(Debug, Clone)]
pub(super) struct PathOptions {
    pub(super) steps: Steps,
    pub(super) sigmas: SigmaOptions,
    pub(super) end_at_zero: bool,
    /// Training steps of spread levels are rounded, and not cut off.
    pub(super) round_steps: bool,
}

impl PathOptions {
    pub(super) fn path(&self, schedule: &NoiseSchedule, n: usize) -> Result<LogSnrPath> {
        let table = SigmaTable::new(schedule);
        let whole = self.steps.whole_and_beyond(n)?;
        let (mut sigmas, timesteps) = match self.sigmas.spread {
            Spread::Steps => {
                let timesteps: Vec<f64> = whole.into_iter().map(|t| t as f64).collect();
                (
                    timesteps.iter().map(|&t| table.sigma(t)).collect(),
                    timesteps,
                )
            }
            Spread::Flow => self.flow(schedule.steps() as f64, n),
            _ => self.spread(&table, n),
        };
        check_positive(&sigmas)?;
        sigmas.push(if self.end_at_zero {
            0.0
        } else {
            table.smallest()
        });
        let sigmas = sigmas.into_iter().map(round).collect();
        Ok(LogSnrPath {
            timesteps,
            sigmas,
            flow: self.sigmas.spread == Spread::Flow,
        })
    }

    /// Levels spread over all of training, and their training steps.
    fn spread(&self, table: &SigmaTable, n: usize) -> (Vec<f64>, Vec<f64>) {
        let sigmas = self.sigmas.respread(&table.falling(), n);
        let whole = |t: f64| {
            let rounds = self.round_steps && self.sigmas.spread != Spread::Exponential;
            if rounds {
                t.round_ties_even()
            } else {
                t.trunc()
            }
        };
        let timesteps = sigmas
            .iter()
            .map(|&sigma| whole(table.timestep(sigma)))
            .collect();
        (sigmas, timesteps)
    }

    /// Levels of a straight path, shifted, and their training steps.
    fn flow(&self, train: f64, n: usize) -> (Vec<f64>, Vec<f64>) {
        let shift = self.sigmas.flow_shift;
        let mut alphas = linspace(1.0, 1.0 / train, n + 1);
        alphas.reverse();
        alphas.truncate(n);
        let shifted = |alpha: f64| shift * (1.0 - alpha) / (1.0 + (shift - 1.0) * (1.0 - alpha));
        let sigmas: Vec<f64> = alphas.into_iter().map(shifted).collect();
        let timesteps = sigmas.iter().map(|sigma| (sigma * train).trunc()).collect();
        (sigmas, timesteps)
    }
}

impl LogSnrPath {
    /// Number of steps.
    pub(super) fn len(&self) -> usize {
        self.timesteps.len()
    }

    /// The level before a step, or after the last.
    pub(super) fn level(&self, index: usize) -> NoiseLevel {
        let sigma = self.sigmas[index];
        if self.flow {
            return NoiseLevel {
                signal: 1.0 - sigma,
                noise: sigma,
            };
        }
        let signal = 1.0 / sigma.hypot(1.0);
        NoiseLevel {
            signal,
            noise: sigma * signal,
        }
    }

    /// λ = ln(α/σ) before a step, or after the last; infinite where there is no noise.
    pub(super) fn log_snr(&self, index: usize) -> f64 {
        let NoiseLevel { signal, noise } = self.level(index);
        signal.ln() - noise.ln()
    }

    /// How many levels before `index` a polynomial may lean on: at most `wanted`, and none from
    /// before a level that is visited twice.
    pub(super) fn usable_before(&self, index: usize, wanted: usize) -> usize {
        let distinct = |back: &usize| {
            index
                .checked_sub(*back)
                .is_some_and(|i| self.log_snr(i) < self.log_snr(i + 1))
        };
        (1..=wanted).take_while(distinct).count()
    }
}
