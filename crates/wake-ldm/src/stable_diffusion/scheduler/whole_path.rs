//! Path of methods that step between whole training steps.

use super::prediction::Prediction;
use super::{NoiseLevel, NoiseSchedule};
use wake_nn::{Error, Result};

/// Training steps at which such a method calls the model.
#[derive(Debug)]
pub(super) struct WholePath {
    pub(super) timesteps: Vec<f64>,
    visited: Vec<usize>,
    alphas: Vec<f64>,
}

impl WholePath {
    /// Rejects steps that training does not have, and a first step without signal if the clean image
    /// would be divided by it.
    pub(super) fn new(
        steps: &[i64],
        schedule: &NoiseSchedule,
        prediction: Prediction,
    ) -> Result<Self> {
        let visited = steps.iter().map(|&t| check_timestep(t, schedule.steps()));
        let visited: Vec<usize> = visited.collect::<Result<_>>()?;
        prediction.check_signal(schedule.noise_level(visited[0]).signal)?;
        Ok(Self {
            timesteps: visited.iter().map(|&t| t as f64).collect(),
            alphas: visited.iter().map(|&t| schedule.alpha_cumprod(t)).collect(),
            visited,
        })
    }

    /// Number of calls of the model.
    pub(super) fn len(&self) -> usize {
        self.visited.len()
    }

    /// Training step of a call.
    pub(super) fn step(&self, index: usize) -> usize {
        self.visited[index]
    }

    /// Signal ᾱ before a call, or `None` after the last.
    pub(super) fn alpha(&self, index: usize) -> Option<f64> {
        self.alphas.get(index).copied()
    }

    pub(super) fn level(&self, index: usize) -> NoiseLevel {
        NoiseLevel::from_alpha_cumprod(self.alphas[index])
    }
}

/// Returns an error for a training step that the schedule does not have.
fn check_timestep(t: i64, steps: usize) -> Result<usize> {
    match usize::try_from(t) {
        Ok(index) if index < steps => Ok(index),
        _ => Err(Error::OutOfRange {
            name: "timestep (from steps, steps_offset and timestep_spacing)".to_owned(),
            value: t as f64,
            min: 0.0,
            max: (steps - 1) as f64,
        }),
    }
}
