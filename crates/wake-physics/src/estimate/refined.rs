//! Maximum-likelihood estimate of ship and wind, with error bars.

use super::ascent::{Ascent, Point, same_pixel};
use super::expected::ExpectedImage;
use super::parameter::Parameter;
use super::priors::Priors;
use super::value::Value;
use crate::error::{Error, Result};
use crate::measure::{angle_between, axis_between};
use crate::raster::Field;
use crate::scene::Scene;
use serde::Serialize;

/// Estimate of one value.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Estimated {
    /// The estimated parameter.
    pub parameter: Parameter,
    /// Maximum-likelihood value, in [`Parameter::unit`]; for factors the logarithm.
    pub value: f64,
    /// Standard deviation; infinite if the image does not determine the value.
    pub deviation: f64,
}

/// Another maximum of the likelihood: the opposite wind, or another speed.
#[derive(Debug, Clone, PartialEq)]
pub struct Alternative {
    /// Scene at the maximum.
    pub scene: Scene,
    /// Posterior probability, 0 to 1.
    pub weight: f64,
}

/// Estimate of ship and sea: values, covariance, alternatives and goodness of fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Maximum-likelihood scene.
    pub scene: Scene,
    /// Mean image of this scene, in the unit of the estimated image.
    pub mean: Field,
    /// Estimated values, in the order of [`Parameter::OF_WAKE`].
    pub values: Vec<Estimated>,
    /// Covariance of the values, row after row; empty if the image does not determine one of them.
    pub covariance: Vec<f64>,
    /// Posterior probability of this maximum, 0 to 1.
    pub weight: f64,
    /// Other maxima: the opposite wind, and other speeds that were found.
    pub alternatives: Vec<Alternative>,
    /// Log-likelihood, up to a constant of the image.
    pub log_likelihood: f64,
    /// Log-likelihood ratio to the best sea without the ship.
    pub over_open_sea: f64,
    /// Power of the residual over its expectation in rings of wavenumbers, longest waves first; 1 for a perfect model. As
    /// [`Score::power`](super::Score::power).
    pub power: Vec<f64>,
    /// Velocity of the ship toward the radar and its standard deviation [m/s], from the displacement of its echo alone; used by
    /// [`estimate`](super::estimate).
    pub by_echo: Option<[f64; 2]>,
    /// True if the estimate passes the tests of [`refine`](super::refine).
    pub identifiable: bool,
}

impl Estimate {
    /// Value and standard deviation of a parameter; NaN if it was not estimated.
    #[must_use]
    pub fn of(&self, parameter: Parameter) -> [f64; 2] {
        let found = self.values.iter().find(|v| v.parameter == parameter);
        found.map_or([f64::NAN; 2], |v| [v.value, v.deviation])
    }

    /// Largest deviation of [`Self::power`] from 1, as a factor: 1 for a perfect model, 2 for an image with half the looks.
    #[must_use]
    pub fn misfit(&self) -> f64 {
        let ratios = self.power.iter().map(|p| p.max(p.recip()));
        ratios.fold(1.0, f64::max)
    }
}

/// Smallest log-likelihood ratio of a certain wake (chosen): fitting ten values to noise gains about 10.
pub(super) const CERTAIN: f64 = 20.0;

/// Largest acceptable misfit, and largest logarithms of the factors on brightness and texture in standard deviations of prior and
/// estimate combined (chosen).
const EXPLAINED: f64 = 1.25;
const USUAL: [f64; 2] = [3.0, 2.0];

/// Relative standard deviation above which the speed is unknown, and largest probability of other speeds (chosen).
const VAGUE: f64 = 0.15;
const DOUBT: f64 = 0.05;

pub(super) fn no_start() -> Error {
    Error::Conflict {
        name: "list of starts".to_owned(),
        value: "empty".to_owned(),
        requirement: "but an estimate needs at least one start with a ship".to_owned(),
    }
}

/// Factor on the standard deviation of the information, for errors of mean and covariance (chosen, from errors of 23 simulated
/// scenes outside the evaluation).
fn model_error(parameter: Parameter) -> f64 {
    match parameter {
        Parameter::Texture => 3.5,
        Parameter::Value(Value::WindSpeed) => 2.5,
        Parameter::Gain => 2.0,
        Parameter::Value(Value::X | Value::WindToward) => 1.5,
        _ => 1.2,
    }
}

/// Factor on the difference of log-likelihood between maxima (chosen): the likelier of two opposite winds, or of two places one
/// pixel apart, can be wrong.
const BELIEVED: f64 = 0.05;

/// Estimate from maxima in descending order of log-posterior.
pub(super) fn concluded(ascent: &Ascent<'_>, points: Vec<Point>, open: f64) -> Result<Estimate> {
    let mut points = points.into_iter();
    let first = points.next().ok_or_else(no_start)?;
    let top = first.log_posterior;
    let best = ascent.point(first.scene, first.factors)?;
    // Maxima of the same speed and wind some pixels apart, and all other maxima.
    let mut beside: Vec<Alternative> = Vec::new();
    let mut others: Vec<Alternative> = Vec::new();
    for point in points {
        let one = Alternative {
            weight: (BELIEVED * (point.log_posterior - top)).exp(),
            scene: point.scene,
        };
        if !same(&best.scene, &one.scene) {
            if !others.iter().any(|other| same(&other.scene, &one.scene)) {
                others.push(one);
            }
        } else if !same_pixel(&best.scene, &one.scene)
            && !beside
                .iter()
                .any(|other| same_pixel(&other.scene, &one.scene))
        {
            beside.push(one);
        }
    }
    normalise(&mut beside);
    let total = normalise(&mut others);
    let mut covariance = ascent.covariance(&best);
    if let Some(covariance) = &mut covariance {
        let factors: Vec<f64> = ascent.parameters.iter().map(|p| model_error(*p)).collect();
        let count = factors.len();
        for (n, value) in covariance.values.iter_mut().enumerate() {
            *value *= factors[n / count] * factors[n % count];
        }
        // Another wind moves the ship, and the ship can be a pixel farther.
        for other in beside.iter().chain(&others) {
            let away = ascent
                .parameters
                .iter()
                .map(|p| away(*p, &best.scene, &other.scene));
            let away: Vec<f64> = away.collect();
            for (n, value) in covariance.values.iter_mut().enumerate() {
                *value += other.weight * away[n / count] * away[n % count];
            }
        }
    }
    let deviation = |n: usize| {
        let of = covariance.as_ref();
        of.map_or(f64::INFINITY, |c| c.at(n, n).max(0.0).sqrt())
    };
    let mut mean = ExpectedImage::new(&best.scene, &[])?.intensity(&best.scene)?;
    let factor = best.factors.gain as f32;
    mean.values.iter_mut().for_each(|v| *v *= factor);
    let scene = wrapped(&best.scene);
    let (gain, texture) = (best.factors.gain.ln(), best.factors.texture.ln());
    let value = |parameter: Parameter| match parameter {
        Parameter::Gain => gain,
        Parameter::Texture => texture,
        Parameter::Size => Value::Size.of(&scene),
        Parameter::Value(value) => value.of(&scene),
    };
    let values = ascent.parameters.iter().enumerate();
    let values: Vec<Estimated> = values
        .map(|(n, &parameter)| Estimated {
            parameter,
            value: value(parameter),
            deviation: deviation(n),
        })
        .collect();
    let over_open_sea = best.log_posterior - open;
    let mut found = Estimate {
        scene,
        mean,
        covariance: covariance.map_or(Vec::new(), |c| c.values),
        weight: total.recip(),
        alternatives: others.into_iter().filter(|a| a.weight > 0.0).collect(),
        log_likelihood: best.near.log_likelihood,
        over_open_sea,
        power: best.near.rings.iter().map(|ring| ring[0]).collect(),
        by_echo: None,
        identifiable: false,
        values,
    };
    found.identifiable = is_identifiable(&found, &best, ascent.priors);
    Ok(found)
}

/// Turns weights relative to the best maximum's, 1, into probabilities; returns the sum of all weights.
fn normalise(others: &mut [Alternative]) -> f64 {
    let total = 1.0 + others.iter().map(|other| other.weight).sum::<f64>();
    for other in others {
        other.weight /= total;
        other.scene = wrapped(&other.scene);
    }
    total
}

/// Difference of a value at another maximum, 0 if the speed of the ship differs there. Opposite winds are alternatives, so they
/// do not add to the deviations of the wind; of directions of the wind, the axes are compared.
fn away(parameter: Parameter, best: &Scene, other: &Scene) -> f64 {
    let value = match parameter {
        Parameter::Size => Value::Size,
        Parameter::Value(value) => value,
        Parameter::Gain | Parameter::Texture => return 0.0,
    };
    if is_other_speed(best, other) || !value.is_of_ship() && are_opposite(best, other) {
        return 0.0;
    }
    let [there, here] = [other, best].map(|scene| value.of(scene));
    match value {
        Value::Heading => angle_between(there, here),
        Value::WindToward => axis_between(there, here),
        _ => there - here,
    }
}

/// True if the winds of two scenes are opposite.
fn are_opposite(a: &Scene, b: &Scene) -> bool {
    let [a, b] = [a, b].map(|scene| scene.sea.wind_toward);
    angle_between(a, b).abs() > 90.0 && axis_between(a, b).abs() < SAME_WIND
}

/// Tests of [`refine`](super::refine).
fn is_identifiable(found: &Estimate, best: &Point, priors: &Priors) -> bool {
    // Compares a factor with the standard deviations of its prior and its estimate combined.
    let is_usual = |parameter: Parameter, prior: f64, limit: f64| {
        let [value, deviation] = found.of(parameter);
        value.abs() < limit * prior.hypot(deviation)
    };
    let usual = is_usual(Parameter::Gain, priors.gain, USUAL[0])
        && is_usual(Parameter::Texture, priors.texture, USUAL[1]);
    // Largest acceptable misfit, and three standard deviations of the mean over a ring.
    let explained =
        best.near.rings.iter().all(|&[power, count]| {
            power.max(power.recip()) < EXPLAINED + 3.0 / count.max(1.0).sqrt()
        });
    let [speed, deviation] = found.of(Parameter::Value(Value::Speed));
    let is_other = |a: &&Alternative| is_other_speed(&found.scene, &a.scene);
    let others = found.alternatives.iter().filter(is_other);
    let doubt: f64 = others.map(|a| a.weight).sum();
    usual
        && explained
        && found.over_open_sea > CERTAIN
        && deviation < VAGUE * speed
        && doubt < DOUBT
}

/// The scene with directions wrapped to 0 to 360 degrees.
fn wrapped(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.sea.wind_toward = scene.sea.wind_toward.rem_euclid(360.0) % 360.0;
    if let Some(ship) = scene.ships.first_mut() {
        ship.heading = ship.heading.rem_euclid(360.0) % 360.0;
    }
    scene
}

/// Relative difference below which two speeds are the same, and above which they are fringes apart: a fringe is a transverse
/// wavelength over twice the wake's length, some 4 %.
const SAME_SPEED: f64 = 0.005;
const OTHER_SPEED: f64 = 0.02;

/// Difference of two winds' directions below which they are the same \[deg\].
const SAME_WIND: f64 = 20.0;

fn is_other_speed(a: &Scene, b: &Scene) -> bool {
    (Value::Speed.of(a) / Value::Speed.of(b)).ln().abs() > OTHER_SPEED
}

/// Whether two scenes belong to the same maximum.
fn same(a: &Scene, b: &Scene) -> bool {
    let speed = (Value::Speed.of(a) / Value::Speed.of(b)).ln().abs();
    let turned = angle_between(a.sea.wind_toward, b.sea.wind_toward);
    speed < SAME_SPEED && turned.abs() < SAME_WIND
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Winds along other axes add to the deviation of the wind, opposite winds and other speeds of the ship do not.
    #[test]
    fn winds_along_other_axes_are_away() {
        let [speed, toward] = [Value::WindSpeed, Value::WindToward].map(Parameter::Value);
        let scene = |wind: f64, to: f64, ship: f64| {
            let mut scene = Scene::default();
            (scene.sea.wind_speed, scene.sea.wind_toward) = (wind, to);
            scene.ships[0].speed = ship;
            scene
        };
        let best = scene(5.0, 350.0, 8.0);
        for (other, expected) in [
            (scene(7.0, 100.0, 8.0), [2.0, -70.0]),
            (scene(7.0, 10.0, 8.0), [2.0, 20.0]),
            (scene(7.0, 175.0, 8.0), [0.0, 0.0]),
            (scene(7.0, 100.0, 9.0), [0.0, 0.0]),
        ] {
            for (parameter, expected) in [speed, toward].into_iter().zip(expected) {
                let found = away(parameter, &best, &other);
                assert!((found - expected).abs() < 1e-9, "{found} {expected}");
            }
        }
        let turned = away(
            Parameter::Value(Value::Speed),
            &best,
            &scene(5.0, 175.0, 8.1),
        );
        assert!((turned - 0.1).abs() < 1e-9);
    }
}
