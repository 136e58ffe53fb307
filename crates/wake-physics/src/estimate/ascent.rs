//! Fisher scoring: ascent to the nearest maximum of the likelihood.

use super::expected::ExpectedImage;
use super::matrix::Matrix;
use super::observed::{Near, Observed};
use super::parameter::{Factors, Parameter};
use super::priors::{Priors, values_of};
use super::texture::Texture;
use super::torus::Spectrum;
use super::value::Value;
use crate::error::Result;
use crate::raster::Field;
use crate::scene::Scene;

/// Scene, factors on its image, and its likelihood.
pub(super) struct Point {
    pub(super) scene: Scene,
    pub(super) factors: Factors,
    pub(super) near: Near,
    /// Log-likelihood plus log-prior of the factors.
    pub(super) log_posterior: f64,
}

/// Smallest part of a step that is tried (chosen).
const SHORTEST: f64 = 0.05;

/// Smallest gain relative to its prediction with which derivatives are kept (chosen).
const TRUSTED: f64 = 0.6;

/// Where an ascent ends.
#[derive(Clone, Copy)]
pub(super) struct Until {
    /// Largest number of steps.
    pub(super) steps: usize,
    /// Length of the last step, in standard deviations of the information.
    pub(super) small: f64,
}

/// Limits of the wind speed [m/s], and of the ship's length relative to the guess.
const WINDS: [f64; 2] = [1.5, 20.0];
const LENGTHS: [f64; 2] = [0.3, 3.0];

/// Texture of a sea, and its wind.
struct Known {
    wind: [f64; 2],
    texture: Texture,
}

/// Changes of wind speed (relative) and direction \[deg\] that need a new texture, over the length of the last step.
const OTHER: [f64; 2] = [0.025, 2.5];

/// Image, parameters and priors of an ascent.
#[derive(Clone, Copy)]
pub(super) struct Ascent<'a> {
    pub(super) observed: &'a Observed,
    pub(super) parameters: &'a [Parameter],
    pub(super) priors: &'a Priors,
    /// Length of the guessed ship \[m\].
    pub(super) length: f64,
}

/// A step of an ascent.
struct Step {
    /// Of each parameter.
    by: Vec<f64>,
    /// Length in standard deviations.
    size: f64,
    /// First order of what it gains.
    rise: f64,
}

/// Frozen plan of an ascent, with what its last points needed.
struct Path {
    image: ExpectedImage,
    /// Length of its last step in standard deviations.
    small: f64,
    texture: Option<Known>,
    /// Derivatives of the mean image at a point before.
    spectra: Vec<Spectrum>,
}

impl Ascent<'_> {
    /// Likelihood at a scene, with the variance of the score.
    pub(super) fn point(&self, scene: Scene, factors: Factors) -> Result<Point> {
        let mut path = self.path(&scene, 0.0)?;
        self.linearised(&mut path, (scene, factors), true)
    }

    /// A path that begins at a scene.
    fn path(&self, start: &Scene, small: f64) -> Result<Path> {
        Ok(Path {
            image: ExpectedImage::new(start, &values_of(self.parameters))?,
            small,
            texture: None,
            spectra: Vec::new(),
        })
    }

    /// Likelihood at a scene, with its own derivatives.
    ///
    /// - `last`: compute the variance of the score
    fn linearised(
        &self,
        path: &mut Path,
        (scene, factors): (Scene, Factors),
        last: bool,
    ) -> Result<Point> {
        let expected = path.image.at(&scene)?;
        path.spectra = self.observed.spectra(self.parameters, &expected);
        self.point_by(path, (scene, factors, &expected.intensity), last)
    }

    /// Likelihood at a scene, with the derivatives of the path.
    fn beside(&self, path: &mut Path, (scene, factors): (Scene, Factors)) -> Result<Point> {
        let mean = path.image.intensity(&scene)?;
        self.point_by(path, (scene, factors, &mean), false)
    }

    fn point_by(
        &self,
        path: &mut Path,
        (scene, factors, mean): (Scene, Factors, &Field),
        last: bool,
    ) -> Result<Point> {
        let wind = [scene.sea.wind_speed, scene.sea.wind_toward];
        let is_near = |known: &Known| {
            (wind[0] / known.wind[0] - 1.0).abs() < path.small * OTHER[0]
                && (wind[1] - known.wind[1]).abs() < path.small * OTHER[1]
        };
        let texture = match path.texture.take().filter(is_near) {
            Some(known) => known,
            None => Known {
                texture: Texture::new(&scene, self.parameters)?,
                wind,
            },
        };
        let texture = &path.texture.insert(texture).texture;
        let here = (&factors, mean, &path.spectra[..]);
        let near = self.observed.near_by(self.parameters, here, texture, last);
        let prior = |parameter: &Parameter| {
            let off = match parameter {
                Parameter::Gain => factors.gain.ln(),
                Parameter::Texture => factors.texture.ln(),
                _ => 0.0,
            };
            -0.5 * self.priors.precision(*parameter) * off * off
        };
        Ok(Point {
            log_posterior: near.log_likelihood + self.parameters.iter().map(prior).sum::<f64>(),
            scene,
            factors,
            near,
        })
    }

    /// Ascent from a start, of at most `steps` steps.
    ///
    /// Derivatives cost several images, so they are kept as long as they predict what a step gains.
    pub(super) fn climb(
        &self,
        start: Scene,
        factors: Factors,
        Until { steps, small }: Until,
    ) -> Result<Point> {
        let mut path = self.path(&start, small)?;
        let mut here = self.linearised(&mut path, (start, factors), false)?;
        let (mut fresh, mut part) = (true, 1.0);
        for _ in 0..steps {
            let Step { by, size, rise } = self.step(&here);
            let there = self.beside(&mut path, self.moved(&here, &by, part))?;
            let gain = there.log_posterior - here.log_posterior;
            let trusted = gain > TRUSTED * (part * rise - 0.5 * (part * size).powi(2));
            if gain > 0.0 {
                here = there;
            }
            if part * size < small {
                break;
            }
            if gain <= 0.0 && fresh {
                part *= 0.3;
                if part < SHORTEST {
                    break;
                }
                continue;
            }
            part = 1.0;
            fresh = !trusted;
            if fresh {
                here = self.linearised(&mut path, (here.scene, here.factors), false)?;
            }
        }
        Ok(here)
    }

    /// Expected curvature of the posterior.
    pub(super) fn precision(&self, point: &Point) -> Matrix {
        let priors = self.priors.matrix(self.parameters);
        point.near.information.slope.clone().plus(&priors)
    }

    /// Covariance of the estimate, (J + Π)⁻¹(V + Π)(J + Π)⁻¹; `None` where the image does not tell.
    pub(super) fn covariance(&self, point: &Point) -> Option<Matrix> {
        let inverse = self.precision(point).inverse()?;
        let priors = self.priors.matrix(self.parameters);
        let variance = point.near.information.variance.clone().plus(&priors);
        Some(inverse.around(&variance))
    }

    fn step(&self, here: &Point) -> Step {
        let count = self.parameters.len();
        let mut slope = here
            .near
            .information
            .slope
            .clone()
            .plus(&self.priors.matrix(self.parameters));
        let mut score = here.near.score.clone();
        for (n, parameter) in self.parameters.iter().enumerate() {
            let precision = self.priors.precision(*parameter);
            score[n] -= precision
                * match parameter {
                    Parameter::Gain => here.factors.gain.ln(),
                    Parameter::Texture => here.factors.texture.ln(),
                    _ => 0.0,
                };
            // Damping: parameters that the image hardly determines keep their values.
            slope.add(n, n, self.longest(*parameter, &here.scene).powi(-2));
        }
        let Some(inverse) = slope.inverse() else {
            return Step {
                by: vec![0.0; count],
                size: 0.0,
                rise: 0.0,
            };
        };
        let product = |n: usize| (0..count).map(|m| inverse.at(n, m) * score[m]).sum::<f64>();
        let mut step: Vec<f64> = (0..count).map(product).collect();
        let over = step
            .iter()
            .zip(self.parameters)
            .map(|(step, p)| step.abs() / self.longest(*p, &here.scene))
            .fold(1.0, f64::max);
        step.iter_mut().for_each(|s| *s /= over);
        Step {
            size: quadratic(&slope, &step).sqrt(),
            rise: step.iter().zip(&score).map(|(s, g)| s * g).sum(),
            by: step,
        }
    }

    /// Longest step of a parameter.
    fn longest(&self, parameter: Parameter, scene: &Scene) -> f64 {
        match parameter {
            Parameter::Value(Value::Speed) => 0.01 * Value::Speed.of(scene),
            Parameter::Value(Value::Heading) => 1.5,
            Parameter::Value(Value::X | Value::Y) => {
                0.03 * Value::Speed.of(scene).powi(2).max(100.0)
            }
            Parameter::Value(Value::WindSpeed) => 0.1 * scene.sea.wind_speed,
            Parameter::Value(Value::WindToward) => 15.0,
            Parameter::Gain => 0.1,
            Parameter::Texture => 0.3,
            Parameter::Size | Parameter::Value(_) => 0.15 * self.length,
        }
    }

    fn moved(&self, here: &Point, step: &[f64], part: f64) -> (Scene, Factors) {
        let (mut scene, mut factors) = (here.scene.clone(), here.factors);
        for (parameter, step) in self.parameters.iter().zip(step) {
            let by = part * step;
            match parameter {
                Parameter::Gain => factors.gain *= by.exp(),
                Parameter::Texture => factors.texture *= by.exp(),
                Parameter::Size | Parameter::Value(_) => {
                    for value in parameter.values() {
                        let to = value.of(&scene) + by;
                        let to = match value {
                            Value::WindSpeed => to.clamp(WINDS[0], WINDS[1]),
                            Value::Size => {
                                to.clamp(LENGTHS[0] * self.length, LENGTHS[1] * self.length)
                            }
                            Value::Speed => to.max(0.5),
                            _ => to,
                        };
                        value.set(&mut scene, to);
                    }
                }
            }
        }
        (scene, factors)
    }
}

/// xᵀ A x.
fn quadratic(matrix: &Matrix, x: &[f64]) -> f64 {
    let size = matrix.size;
    let row = |n: usize| (0..size).map(|m| matrix.at(n, m) * x[m]).sum::<f64>();
    (0..size).map(|n| x[n] * row(n)).sum::<f64>().max(0.0)
}
