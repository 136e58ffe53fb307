//! Modes of the likelihood of one image, by Fisher scoring.

use super::matrix::Matrix;
use super::observed::Observed;
use super::parameter::Parameter;
use super::priors::Priors;
use super::scorer::{Scorer, SeaNoise, Told, log_likelihood, mean};
use super::state::State;
use crate::error::Result;
use crate::raster::Field;
use crate::simulate::Simulator;

/// An image, the window it is looked at through, and what is known beforehand.
pub(super) struct Problem<'a> {
    pub(super) image: &'a Field,
    pub(super) view: &'a Observed,
    pub(super) priors: Priors,
}

/// A mode.
#[derive(Debug, Clone)]
pub(super) struct Mode {
    pub(super) state: State,
    /// ln of likelihood and priors.
    pub(super) log_posterior: f64,
}

/// The likelihood to second order around a state.
pub(super) struct Around<'a> {
    pub(super) scorer: Scorer<'a>,
    pub(super) told: Told,
    /// (J + Π)⁻¹; `None` where a value is not determined.
    pub(super) inverse: Option<Matrix>,
}

/// Step in deviations at which a fit ends, and the largest damping.
const LEAST_STEP: f64 = 0.1;
const MOST_DAMPING: f64 = 1e3;

impl Problem<'_> {
    fn log_prior(&self, state: &State) -> f64 {
        let one = |p: Parameter| -0.5 * self.priors.precision(p) * state.get(p).powi(2);
        one(Parameter::Gain) + one(Parameter::Texture)
    }

    /// A score with that of the priors.
    pub(super) fn score(&self, score: &[f64], state: &State, parameters: &[Parameter]) -> Vec<f64> {
        let pairs = parameters.iter().zip(score);
        let with_prior = |(p, g): (&Parameter, &f64)| match self.priors.precision(*p) {
            precision if precision > 0.0 => g - precision * state.get(*p),
            _ => *g,
        };
        pairs.map(with_prior).collect()
    }

    /// The likelihood around a state.
    pub(super) fn around(
        &self,
        state: &State,
        parameters: &[Parameter],
        texture: &SeaNoise,
    ) -> Result<Around<'_>> {
        let mean = mean(&mut Simulator::default(), state)?;
        let scorer = Scorer::new(self.view, (state, mean), (parameters, texture))?;
        let slope = scorer.slope.clone().plus(&self.priors.matrix(parameters));
        Ok(Around {
            told: scorer.of(self.image),
            inverse: slope.inverse(),
            scorer,
        })
    }

    pub(super) fn log_posterior(&self, state: &State, texture: &SeaNoise) -> Result<f64> {
        let mean = mean(&mut Simulator::default(), state)?;
        let factor = state.factors.texture;
        let images = (self.image, &mean);
        Ok(log_likelihood(self.view, images, (texture, factor)) + self.log_prior(state))
    }

    /// Follows the likelihood uphill from a start.
    pub(super) fn climb(
        &self,
        start: &State,
        parameters: &[Parameter],
        steps: usize,
    ) -> Result<Mode> {
        let mut state = start.clone();
        let mut texture = SeaNoise::new(&state, parameters)?;
        let mut around = self.around(&state, parameters, &texture)?;
        let mut log_posterior = self.log_posterior(&state, &texture)?;
        let mut damping = 1e-3;
        for _ in 0..steps {
            let score = self.score(&around.told.score, &state, parameters);
            let slope = around
                .scorer
                .slope
                .clone()
                .plus(&self.priors.matrix(parameters));
            let Some((next, size)) = stepped(&state, parameters, (slope, &score), damping) else {
                break;
            };
            if size < LEAST_STEP {
                break;
            }
            let newer = match texture.holds(&next.scene) {
                true => None,
                false => Some(SeaNoise::new(&next, parameters)?),
            };
            let found = self.log_posterior(&next, newer.as_ref().unwrap_or(&texture))?;
            if found > log_posterior - 0.02 {
                damping = (0.2 * damping).max(1e-5);
                texture = newer.unwrap_or(texture);
                (state, log_posterior) = (next, found);
                around = self.around(&state, parameters, &texture)?;
            } else {
                damping = damping.max(1e-3) * 10.0;
                if damping > MOST_DAMPING {
                    break;
                }
            }
        }
        Ok(Mode {
            state,
            log_posterior,
        })
    }
}

/// The next state, and the largest step in deviations; `None` where the slope has no inverse.
fn stepped(
    state: &State,
    parameters: &[Parameter],
    (mut slope, score): (Matrix, &[f64]),
    damping: f64,
) -> Option<(State, f64)> {
    let plain = slope.inverse()?;
    for n in 0..parameters.len() {
        let own = slope.at(n, n);
        slope.add(n, n, damping * own);
    }
    let step = slope.inverse()?.product(score);
    Some(along(state, parameters, (&step, &plain)))
}

/// A state some steps away, none longer than allowed, and the largest in deviations.
pub(super) fn along(
    state: &State,
    parameters: &[Parameter],
    (step, covariance): (&[f64], &Matrix),
) -> (State, f64) {
    let ratios = parameters.iter().zip(step);
    let too_far = ratios
        .map(|(p, s)| s.abs() / state.longest(*p))
        .fold(1.0, f64::max);
    let mut next = state.clone();
    let mut size = 0.0f64;
    for (n, (&parameter, step)) in parameters.iter().zip(step).enumerate() {
        next = next.moved(parameter, step / too_far);
        size = size.max(step.abs() / covariance.at(n, n).max(1e-300).sqrt());
    }
    (next, size)
}
