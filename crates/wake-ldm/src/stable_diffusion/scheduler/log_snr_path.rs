//! Path of the exponential integrators: whole training steps, and levels in λ = ln(α/σ).

use super::sigmas::{SigmaOptions, SigmaTable, Spread, check_positive, round};
use super::spacing::{Steps, linspace};
use super::{NoiseLevel, NoiseSchedule};
use wake_nn::Result;

/// Steps and levels visited by an exponential integrator.
#[derive(Debug, Clone)]
pub(super) struct LogSnrPath {
    pub(super) timesteps: Vec<f64>,
    /// One more than `timesteps`.
    sigmas: Vec<f64>,
    flow: bool,
}

/// Options of a [`LogSnrPath`].
#[derive(Debug, Clone)]
pub(super) struct PathOptions {
    pub(super) steps: Steps,
    pub(super) sigmas: SigmaOptions,
    pub(super) end_at_zero: bool,
    /// Whether training steps of spread levels are rounded instead of truncated.
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

    /// Levels spread over the whole training range, and their training steps.
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

    /// Shifted levels of a straight path, and their training steps.
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

/// Exactly solved part of a step, x' = `sample` · x + …, with the factors of the rest.
#[derive(Debug, Clone, Copy)]
pub(super) struct ExactPart {
    pub(super) sample: f64,
    /// Factor of the integral over the predictions.
    pub(super) amplitude: f64,
    /// Step in λ, negative in terms of the clean image and positive in terms of the noise.
    pub(super) h: f64,
}

impl LogSnrPath {
    /// Number of steps.
    pub(super) fn len(&self) -> usize {
        self.timesteps.len()
    }

    /// Noise level before a step, or after the last.
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

    /// λ = ln(α/σ) before a step, or after the last; infinite without noise.
    pub(super) fn log_snr(&self, index: usize) -> f64 {
        let NoiseLevel { signal, noise } = self.level(index);
        signal.ln() - noise.ln()
    }

    /// Length of a step in λ; 0 between equal levels.
    pub(super) fn length(&self, index: usize) -> f64 {
        self.log_snr(index + 1) - self.log_snr(index)
    }

    /// Exact part of a step in terms of the clean image (`data`), or otherwise of the noise.
    pub(super) fn exact_part(&self, index: usize, data: bool) -> ExactPart {
        let (now, next) = (self.level(index), self.level(index + 1));
        let length = self.length(index);
        if data {
            ExactPart {
                sample: next.noise / now.noise,
                amplitude: next.signal,
                h: -length,
            }
        } else {
            ExactPart {
                sample: next.signal / now.signal,
                amplitude: next.noise,
                h: length,
            }
        }
    }

    /// Order that a step can have: at most `wanted` and as far as the `known` predictions go, without
    /// predictions from before a level that is visited twice, which would cause a division by zero.
    pub(super) fn order(&self, index: usize, wanted: usize, known: usize) -> usize {
        let moves = |back: &usize| {
            let from = index.checked_sub(*back);
            from.is_some_and(|from| self.length(from) > 0.0)
        };
        (0..wanted.min(known)).take_while(moves).count().max(1)
    }
}
