//! Fisher scoring: from a start to the nearest mode of the likelihood, with the covariance there.

use super::echo::Echo;
use super::expected::{Expected, ExpectedImage};
use super::likelihood::{Near, Observed, Texture};
use super::matrix::Matrix;
use super::parameter::{Parameter, State};
use super::value::Value;
use crate::error::Result;
use crate::raster::Field;
use crate::scene::Scene;

/// Standard deviations of what is known beforehand of the nuisance values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Priors {
    /// Of the logarithm of the factor on the image: calibration of the radar and error of the mean image. Infinite for an image
    /// that is not calibrated.
    pub gain: f64,
    /// Of the logarithm of the factor on the variance of the texture: how far the first-order theory of the sea is trusted.
    pub texture: f64,
}

impl Default for Priors {
    /// 3 % of the brightness and 20 % of the variance: what the expected image and the first-order sea are off by against means
    /// over many simulated seas.
    fn default() -> Self {
        Self {
            gain: 0.03,
            texture: 0.2,
        }
    }
}

impl Priors {
    pub(super) fn precision(&self, parameter: Parameter) -> f64 {
        match parameter {
            Parameter::Gain => self.gain.powi(-2),
            Parameter::Texture => self.texture.powi(-2),
            _ => 0.0,
        }
    }

    pub(super) fn matrix(&self, parameters: &[Parameter]) -> Matrix {
        let mut matrix = Matrix::zero(parameters.len());
        for (n, &parameter) in parameters.iter().enumerate() {
            matrix.add(n, n, self.precision(parameter));
        }
        matrix
    }

    /// ln of the density at a state, and its slope.
    fn at(&self, parameter: Parameter, state: &State) -> [f64; 2] {
        let precision = self.precision(parameter);
        if precision == 0.0 {
            return [0.0; 2];
        }
        let value = state.get(parameter);
        [-0.5 * precision * value * value, -precision * value]
    }
}

/// Values that derivatives are needed by.
pub(super) fn values_of(parameters: &[Parameter]) -> Vec<Value> {
    let mut values: Vec<Value> = parameters
        .iter()
        .flat_map(|p| p.values())
        .copied()
        .collect();
    values.sort_unstable();
    values.dedup();
    values
}

/// A mode of the likelihood.
pub(super) struct Fit {
    pub(super) state: State,
    pub(super) parameters: Vec<Parameter>,
    /// Covariance of the parameters; `None` where some are not determined.
    pub(super) covariance: Option<Matrix>,
    /// ln of likelihood and prior.
    pub(super) log_posterior: f64,
    pub(super) near: Near,
    pub(super) expected: Expected,
    pub(super) converged: bool,
}

impl Fit {
    /// Standard deviation of a parameter; infinite where it is not determined.
    pub(super) fn deviation(&self, parameter: Parameter) -> f64 {
        let at = self.parameters.iter().position(|p| *p == parameter);
        match (at, &self.covariance) {
            (Some(n), Some(covariance)) => covariance.at(n, n).max(0.0).sqrt(),
            _ => f64::INFINITY,
        }
    }
}

/// Covariance (J + Π)⁻¹(V + Π)(J + Π)⁻¹ with the precision Π of what is known besides the image.
pub(super) fn covariance(
    information: &super::likelihood::Information,
    known: &Matrix,
) -> Option<Matrix> {
    let inverse = information.slope.clone().plus(known).inverse()?;
    let variance = information.variance.clone().plus(known);
    Some(inverse.times(&variance).times(&inverse))
}

/// Farthest that one step may go.
fn longest(parameter: Parameter, state: &State) -> f64 {
    let at = state.get(parameter).abs();
    match parameter {
        Parameter::Value(Value::Speed) => 0.04 * at,
        Parameter::Value(Value::Heading) => 2.0,
        Parameter::Value(Value::X | Value::Y) => 15.0,
        Parameter::Value(Value::WindToward) => 15.0,
        Parameter::Value(Value::Incidence) => 2.0,
        Parameter::Gain => 0.2,
        Parameter::Texture => 0.5,
        _ => 0.25 * at,
    }
}

/// Looks for modes of one image.
pub(super) struct Fitter<'a> {
    pub(super) observed: &'a Observed,
    pub(super) priors: Priors,
    /// Steps at most.
    pub(super) steps: usize,
    /// The ship's echo, whose place is evidence of its own.
    pub(super) echo: Option<Echo>,
}

/// How far wind may move before the texture is computed again: relative speed, direction \[deg\].
const STALE: [f64; 2] = [0.02, 2.0];

impl Fitter<'_> {
    /// Follows the likelihood uphill from a start.
    pub(super) fn mode(
        &self,
        start: &State,
        parameters: &[Parameter],
        finish: bool,
    ) -> Result<Fit> {
        let values = values_of(parameters);
        let mut frozen = ExpectedImage::new(&start.scene, &values)?;
        let mut frozen_at = start.scene.clone();
        let mut state = start.clone();
        let mut texture = Texture::new(&state.scene, parameters)?;
        let mut texture_at = state.scene.clone();
        let mut expected = frozen.at(&state.scene)?;
        let mut near = self
            .observed
            .near(parameters, (&state, &expected), &texture, false);
        let mut posterior = self.posterior(parameters, &state, &near);
        let (mut damping, mut converged) = (1e-3, false);
        for _ in 0..self.steps {
            let Some((next, size)) = self.step(parameters, &state, &near, damping) else {
                break;
            };
            if size < 0.03 {
                converged = true;
                break;
            }
            if far(&frozen_at, &next.scene) {
                frozen = ExpectedImage::new(&next.scene, &values)?;
                frozen_at = next.scene.clone();
            }
            let candidate = frozen.at(&next.scene)?;
            let moved = stale(&texture_at, &next.scene);
            let newer = if moved {
                Some(Texture::new(&next.scene, parameters)?)
            } else {
                None
            };
            let used = newer.as_ref().unwrap_or(&texture);
            let there = self
                .observed
                .near(parameters, (&next, &candidate), used, false);
            let found = self.posterior(parameters, &next, &there);
            if found > posterior - 0.05 {
                damping = (damping * 0.2f64).max(1e-6);
                if let Some(newer) = newer {
                    (texture, texture_at) = (newer, next.scene.clone());
                }
                (state, expected, near, posterior) = (next, candidate, there, found);
            } else {
                damping = damping.max(1e-3) * 10.0;
                if damping > 1e3 {
                    break;
                }
            }
        }
        if finish {
            let texture = Texture::new(&state.scene, parameters)?;
            near = self
                .observed
                .near(parameters, (&state, &expected), &texture, true);
            posterior = self.posterior(parameters, &state, &near);
        }
        Ok(Fit {
            covariance: covariance(&near.information, &self.known(parameters, &state)),
            parameters: parameters.to_vec(),
            log_posterior: posterior,
            state,
            near,
            expected,
            converged,
        })
    }

    fn posterior(&self, parameters: &[Parameter], state: &State, near: &Near) -> f64 {
        let prior = parameters.iter().map(|p| self.priors.at(*p, state)[0]);
        let echo = self.echo.as_ref().filter(|_| !state.scene.ships.is_empty());
        let echo = echo.map_or(0.0, |e| {
            -0.5 * e.residual(state).iter().map(|r| r * r).sum::<f64>()
        });
        near.log_likelihood + prior.sum::<f64>() + echo
    }

    /// Precision of what is known besides the image: priors and the place of the echo.
    fn known(&self, parameters: &[Parameter], state: &State) -> Matrix {
        let mut matrix = self.priors.matrix(parameters);
        if let Some(echo) = &self.echo {
            let slopes: Vec<[f64; 2]> = parameters.iter().map(|p| echo.slope(state, *p)).collect();
            for (p, a) in slopes.iter().enumerate() {
                for (q, b) in slopes.iter().enumerate() {
                    matrix.add(p, q, a[0] * b[0] + a[1] * b[1]);
                }
            }
        }
        matrix
    }

    /// Slope of ln of what is known besides the image.
    fn known_slope(&self, parameter: Parameter, state: &State) -> f64 {
        let echo = self.echo.as_ref().map_or(0.0, |echo| {
            let pairs = echo
                .residual(state)
                .into_iter()
                .zip(echo.slope(state, parameter));
            pairs.map(|(r, slope)| r * slope).sum()
        });
        self.priors.at(parameter, state)[1] + echo
    }

    /// The next state, and the largest step in standard deviations; `None` where the information is singular.
    fn step(
        &self,
        parameters: &[Parameter],
        state: &State,
        near: &Near,
        damping: f64,
    ) -> Option<(State, f64)> {
        let mut slope = near
            .information
            .slope
            .clone()
            .plus(&self.known(parameters, state));
        let plain = slope.inverse();
        for n in 0..parameters.len() {
            let own = slope.at(n, n);
            slope.add(n, n, damping * own);
        }
        let score: Vec<f64> = parameters
            .iter()
            .zip(&near.score)
            .map(|(p, g)| g + self.known_slope(*p, state))
            .collect();
        let inverse = slope.inverse()?;
        let step = inverse.product(&score);
        let too_far = parameters
            .iter()
            .zip(&step)
            .map(|(p, s)| s.abs() / longest(*p, state))
            .fold(1.0, f64::max);
        let mut next = state.clone();
        let mut size = 0.0f64;
        for (n, (&parameter, step)) in parameters.iter().zip(&step).enumerate() {
            next.advance(parameter, step / too_far);
            let deviation = plain.as_ref().map_or(0.0, |m| m.at(n, n)).max(0.0).sqrt();
            size = size.max(step.abs() / deviation.max(1e-12));
        }
        Some((next, size))
    }
}

/// Whether a frozen plan no longer holds for a scene.
fn far(frozen: &Scene, scene: &Scene) -> bool {
    let moved = |value: Value| (value.of(frozen) - value.of(scene)).abs();
    let turned = (moved(Value::Heading) + 180.0).rem_euclid(360.0) - 180.0;
    moved(Value::Speed) > 0.05 * Value::Speed.of(frozen)
        || turned.abs() > 3.0
        || moved(Value::X).hypot(moved(Value::Y)) > 40.0
        || moved(Value::Length) > 0.3 * Value::Length.of(frozen)
        || moved(Value::WindSpeed) > 0.2 * frozen.sea.wind_speed
}

fn stale(texture: &Scene, scene: &Scene) -> bool {
    let turned = scene.sea.wind_toward - texture.sea.wind_toward;
    let turned = (turned + 180.0).rem_euclid(360.0) - 180.0;
    (scene.sea.wind_speed / texture.sea.wind_speed - 1.0).abs() > STALE[0]
        || turned.abs() > STALE[1]
}

/// Relative intensity that a fit leaves, and the image that it makes.
pub(super) fn fitted(fit: &Fit) -> Field {
    let gain = fit.state.gain.exp() as f32;
    let mut field = fit.expected.intensity.clone();
    field.values.iter_mut().for_each(|v| *v *= gain);
    field
}
