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

/// Smallest fraction of a step that is tried (chosen).
const SHORTEST: f64 = 0.05;

/// Smallest ratio of actual to predicted gain at which derivatives are kept (chosen).
const TRUSTED: f64 = 0.6;

/// Fractions of the correlated change of the other values that are tried when the ship moves one pixel along azimuth, and largest
/// number of maxima whose neighbours are searched (chosen).
const FOLLOWING: [f64; 4] = [0.0, 0.33, 0.67, 1.0];
const HOPS: usize = 5;

/// Drop in log-likelihood from the highest maximum beyond which a maximum's neighbours are not searched, and drop from a maximum
/// beyond which a neighbouring place is left out (chosen).
const BESIDE: f64 = 60.0;
const FAR: f64 = 160.0;

/// Stopping criteria of an ascent.
#[derive(Clone, Copy)]
pub(super) struct Until {
    /// Largest number of steps.
    pub(super) steps: usize,
    /// Length of a step below which the ascent ends, in standard deviations of the information.
    pub(super) small: f64,
    /// Largest distance between the winds of scene and texture, as in [`Textures::of`].
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

struct Step {
    /// Change of each parameter.
    by: Vec<f64>,
    /// Length in standard deviations.
    size: f64,
    /// First-order gain in log-posterior.
    rise: f64,
}

/// Frozen plan of an ascent, and the derivatives that its points share.
struct Path {
    image: ExpectedImage,
    /// Largest distance between the winds of scene and texture.
    farther: f64,
    /// Derivatives of the mean image at an earlier point.
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

    /// Climbs from a start to the nearest maximum.
    pub(super) fn climb(&self, start: Scene, factors: Factors, until: Until) -> Result<Point> {
        let mut path = self.path(&start, until.farther)?;
        let here = self.linearised(&mut path, start, factors, false)?;
        self.ascend(&mut path, here, until)
    }

    /// Maxima around a maximum, in descending order of log-posterior.
    ///
    /// Short waves have almost the same samples one pixel farther along azimuth, so the likelihood has maxima one pixel apart.
    /// The neighbours of maxima about as likely as the highest are searched, too.
    pub(super) fn over_pixels(&self, from: Point, until: Until) -> Result<Vec<Point>> {
        let mut known = vec![from];
        let mut done: Vec<Scene> = Vec::new();
        for _ in 0..HOPS {
            let top = highest(&known);
            let is_new = |point: &&Point| {
                point.log_posterior > top - BESIDE
                    && !done.iter().any(|scene| same_pixel(scene, &point.scene))
            };
            let next = known.iter().filter(is_new);
            let Some(here) = next.max_by(|a, b| a.log_posterior.total_cmp(&b.log_posterior)) else {
                break;
            };
            done.push(here.scene.clone());
            for (scene, factors) in self.pixels_beside(here, &known)? {
                known.push(self.climb(scene, factors, until)?);
            }
        }
        sort(&mut known);
        Ok(known)
    }

    /// Places one pixel along azimuth from a maximum that are about as likely and not at a known maximum.
    fn pixels_beside(&self, here: &Point, known: &[Point]) -> Result<Vec<(Scene, Factors)>> {
        let Some(step) = self.by_pixel(here) else {
            return Ok(Vec::new());
        };
        let image = ExpectedImage::new(&here.scene, &[])?;
        let expected = image.at(&here.scene)?;
        let texture = self.textures.of(&here.scene, self.parameters, 1.0)?;
        let directions = self.observed.towards(&[], &expected, &texture.noise);
        let is_y = |p: &Parameter| *p == Parameter::Value(Value::Y);
        let mut beside = Vec::new();
        for pixels in [-1.0, 1.0] {
            let mut best = (here.log_posterior - FAR, None);
            for part in FOLLOWING {
                let parameters = self.parameters.iter().zip(&step);
                let step = parameters.map(|(p, s)| if is_y(p) { *s } else { part * s });
                let step: Vec<f64> = step.collect();
                let (scene, factors) = self.moved(here, &step, pixels);
                if known.iter().any(|point| same_pixel(&point.scene, &scene)) {
                    continue;
                }
                let mean = image.intensity(&scene)?;
                let noise = &self.textures.of(&scene, self.parameters, 1.0)?.noise;
                let observed = self.observed;
                let found = observed.log_likelihood_by(&factors, &mean, &directions, noise)
                    + self.log_prior(&factors);
                if found > best.0 {
                    best = (found, Some((scene, factors)));
                }
            }
            beside.extend(best.1);
        }
        Ok(beside)
    }

    /// Step of all parameters that lowers the likelihood least while the ship moves one pixel along azimuth.
    fn by_pixel(&self, here: &Point) -> Option<Vec<f64>> {
        let covariance = self.precision(here).inverse()?;
        let is_y = |p: &Parameter| *p == Parameter::Value(Value::Y);
        let y = self.parameters.iter().position(is_y)?;
        let scale = here.scene.grid.spacing / covariance.at(y, y);
        let steps = (0..self.parameters.len()).map(|n| scale * covariance.at(n, y));
        Some(steps.collect())
    }

    /// Ascends by at most `steps` steps.
    ///
    /// Derivatives cost several images, so they are reused as long as they predict the gain of a step.
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

    /// Covariance of the estimate, (J + Π)⁻¹(V + Π)(J + Π)⁻¹; `None` where the image does not determine the parameters.
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

/// True if the ships of two scenes are less than half a pixel apart along azimuth.
pub(super) fn same_pixel(a: &Scene, b: &Scene) -> bool {
    (Value::Y.of(a) - Value::Y.of(b)).abs() < 0.5 * a.grid.spacing
}

/// Sorts points in descending order of log-posterior.
pub(super) fn sort(points: &mut [Point]) {
    points.sort_by(|a, b| b.log_posterior.total_cmp(&a.log_posterior));
}

/// Highest log-posterior.
fn highest(points: &[Point]) -> f64 {
    let each = points.iter().map(|point| point.log_posterior);
    each.fold(f64::NEG_INFINITY, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::simulate;

    /// Starting at a maximum one pixel off, the search finds the one at the ship's place and keeps both.
    #[test]
    fn maxima_a_pixel_apart_are_found_from_each_other() {
        let keys = [
            "grid.rows=96",
            "grid.columns=96",
            "grid.spacing=4",
            "ship.heading=60",
            "ship.position=[100, 60]",
            "sea.wind_speed=5",
            "model.tolerance=1e-2",
        ];
        let truth = Scene::default().with_assignments(&keys).unwrap();
        let image = simulate(&truth).unwrap().speckled;
        let observed = Observed::new(image, &truth, |_, _| 1.0);
        let ascent = Ascent {
            observed: &observed,
            parameters: &Parameter::OF_WAKE,
            priors: &Priors::default(),
            textures: &Textures::default(),
            length: truth.ships[0].length,
        };
        let until = Until {
            steps: 10,
            small: 0.5,
            farther: 0.25,
        };
        let mut aside = truth.clone();
        aside.ships[0].position[1] += truth.grid.spacing;
        let aside = ascent.climb(aside, Factors::default(), until).unwrap();
        assert!(!same_pixel(&aside.scene, &truth), "{:?}", aside.scene.ships);
        let (place, lower) = (Value::Y.of(&aside.scene), aside.log_posterior);
        let found = ascent.over_pixels(aside, until).unwrap();
        assert!(found.is_sorted_by(|a, b| a.log_posterior >= b.log_posterior));
        assert!(found[0].log_posterior > lower);
        assert!(
            same_pixel(&found[0].scene, &truth),
            "{:?}",
            found[0].scene.ships
        );
        let is_kept = |point: &Point| (Value::Y.of(&point.scene) - place).abs() < 1e-9;
        assert!(found.iter().any(is_kept));
    }
}
