//! Fisher scoring: ascent to the nearest maximum of the likelihood.

use super::expected::ExpectedImage;
use super::matrix::Matrix;
use super::observed::{Directions, Near, Observed};
use super::parameter::{Factors, Parameter};
use super::priors::{Priors, values_of};
use super::texture::Textures;
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

/// Pixels along azimuth that higher maxima are looked for within, parts of the change by which all other values follow the place, and how often (chosen).
const FARTHEST: i32 = 2;
const FOLLOWING: [f64; 4] = [0.0, 0.33, 0.67, 1.0];
const HOPS: usize = 3;

/// Where an ascent ends.
#[derive(Clone, Copy)]
pub(super) struct Until {
    /// Largest number of steps.
    pub(super) steps: usize,
    /// Length of the last step, in standard deviations of the information.
    pub(super) small: f64,
    /// Largest distance between the winds of scene and texture: [`Textures::of`].
    pub(super) farther: f64,
}

/// Limits of the wind speed [m/s], and of the ship's length relative to the guess.
const WINDS: [f64; 2] = [1.5, 20.0];
const LENGTHS: [f64; 2] = [0.3, 3.0];

/// Image, parameters and priors of an ascent.
#[derive(Clone, Copy)]
pub(super) struct Ascent<'a> {
    pub(super) observed: &'a Observed,
    pub(super) parameters: &'a [Parameter],
    pub(super) priors: &'a Priors,
    pub(super) textures: &'a Textures,
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
    /// Largest distance between the winds of scene and texture.
    farther: f64,
    /// Derivatives of the mean image at a point before.
    directions: Directions,
}

impl Ascent<'_> {
    /// Likelihood at a scene, with the variance of the score.
    pub(super) fn point(&self, scene: Scene, factors: Factors) -> Result<Point> {
        let mut path = self.path(&scene, 0.0)?;
        self.linearised(&mut path, scene, factors, true)
    }

    /// A path that begins at a scene.
    ///
    /// - `farther`: as [`Textures::of`]
    fn path(&self, start: &Scene, farther: f64) -> Result<Path> {
        Ok(Path {
            image: ExpectedImage::new(start, &values_of(self.parameters))?,
            farther,
            directions: Directions::default(),
        })
    }

    /// Likelihood at a scene, with its own derivatives.
    ///
    /// - `last`: compute the variance of the score
    fn linearised(
        &self,
        path: &mut Path,
        scene: Scene,
        factors: Factors,
        last: bool,
    ) -> Result<Point> {
        let expected = path.image.at(&scene)?;
        let texture = self.textures.of(&scene, self.parameters, path.farther)?;
        path.directions = self
            .observed
            .towards(self.parameters, &expected, &texture.noise);
        self.point_by(path, scene, factors, &expected.intensity, last)
    }

    /// Likelihood at a scene, with the derivatives of the path.
    fn beside(&self, path: &Path, (scene, factors): (Scene, Factors)) -> Result<Point> {
        let mean = path.image.intensity(&scene)?;
        self.point_by(path, scene, factors, &mean, false)
    }

    fn point_by(
        &self,
        path: &Path,
        scene: Scene,
        factors: Factors,
        mean: &Field,
        last: bool,
    ) -> Result<Point> {
        let texture = self.textures.of(&scene, self.parameters, path.farther)?;
        let (parameters, directions) = (self.parameters, &path.directions);
        let near = self
            .observed
            .near_by(parameters, &factors, mean, directions, &texture);
        let near = match last {
            true => self
                .observed
                .with_variance(near, parameters, &factors, directions, &texture),
            false => near,
        };
        Ok(Point {
            log_posterior: near.log_likelihood + self.log_prior(&factors),
            scene,
            factors,
            near,
        })
    }

    /// Log-prior of factors.
    fn log_prior(&self, factors: &Factors) -> f64 {
        let prior = |parameter: &Parameter| {
            let off = match parameter {
                Parameter::Gain => factors.gain.ln(),
                Parameter::Texture => factors.texture.ln(),
                _ => 0.0,
            };
            -0.5 * self.priors.precision(*parameter) * off * off
        };
        self.parameters.iter().map(prior).sum()
    }

    /// Ascent from a start.
    pub(super) fn climb(&self, start: Scene, factors: Factors, until: Until) -> Result<Point> {
        let mut path = self.path(&start, until.farther)?;
        let here = self.linearised(&mut path, start, factors, false)?;
        self.ascend(&mut path, here, until)
    }

    /// Highest of the maxima beside a maximum: short waves are sampled alike a pixel farther along azimuth, so that the likelihood has maxima a pixel apart.
    pub(super) fn over_pixels(&self, from: Point, until: Until) -> Result<Point> {
        let mut here = from;
        for _ in 0..HOPS {
            let Some((scene, factors)) = self.higher_pixel(&here)? else {
                break;
            };
            let there = self.climb(scene, factors, until)?;
            if there.log_posterior <= here.log_posterior {
                break;
            }
            here = there;
        }
        Ok(here)
    }

    /// The likeliest place some pixels along azimuth, if it is likelier than a maximum.
    fn higher_pixel(&self, here: &Point) -> Result<Option<(Scene, Factors)>> {
        let Some(step) = self.by_pixel(here) else {
            return Ok(None);
        };
        let image = ExpectedImage::new(&here.scene, &[])?;
        let expected = image.at(&here.scene)?;
        let texture = self.textures.of(&here.scene, self.parameters, 1.0)?;
        let directions = self.observed.towards(&[], &expected, &texture.noise);
        let is_y = |p: &Parameter| *p == Parameter::Value(Value::Y);
        let mut best = (here.log_posterior, None);
        for pixels in (-FARTHEST..=FARTHEST).filter(|n| *n != 0) {
            for part in FOLLOWING {
                let parameters = self.parameters.iter().zip(&step);
                let step = parameters.map(|(p, s)| if is_y(p) { *s } else { part * s });
                let step: Vec<f64> = step.collect();
                let (scene, factors) = self.moved(here, &step, f64::from(pixels));
                let mean = image.intensity(&scene)?;
                let noise = &self.textures.of(&scene, self.parameters, 1.0)?.noise;
                let observed = self.observed;
                let found = observed.log_likelihood_by(&factors, &mean, &directions, noise)
                    + self.log_prior(&factors);
                if found > best.0 {
                    best = (found, Some((scene, factors)));
                }
            }
        }
        Ok(best.1)
    }

    /// Step of all parameters with which the likelihood falls least while the ship moves a pixel along azimuth.
    fn by_pixel(&self, here: &Point) -> Option<Vec<f64>> {
        let covariance = self.precision(here).inverse()?;
        let is_y = |p: &Parameter| *p == Parameter::Value(Value::Y);
        let y = self.parameters.iter().position(is_y)?;
        let scale = here.scene.grid.spacing / covariance.at(y, y);
        let steps = (0..self.parameters.len()).map(|n| scale * covariance.at(n, y));
        Some(steps.collect())
    }

    /// Ascent of at most `steps` steps.
    ///
    /// Derivatives cost several images, so they are kept as long as they predict what a step gains.
    fn ascend(
        &self,
        path: &mut Path,
        mut here: Point,
        Until { steps, small, .. }: Until,
    ) -> Result<Point> {
        let (mut fresh, mut part) = (true, 1.0);
        for _ in 0..steps {
            let Step { by, size, rise } = self.step(&here);
            let there = self.beside(path, self.moved(&here, &by, part))?;
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
                here = self.linearised(path, here.scene, here.factors, false)?;
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
