//! Maximum-likelihood estimate of ship and wind near a guess, with error bars.

use super::ascent::{Ascent, Point, Until};
use super::echo::Echo;
use super::expected::ExpectedImage;
use super::observed::Observed;
use super::parameter::{Factors, Parameter};
use super::priors::Priors;
use super::value::Value;
use crate::error::{Error, Result};
use crate::linear::OpenSea;
use crate::measure::{angle_between, axis_between};
use crate::models::Models;
use crate::raster::Field;
use crate::scene::{Scene, Sea};
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
    /// Its mean image, in the unit of the estimated image.
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
    /// Power of the residual over its expectation in rings of wavenumbers, longest waves first; 1 for a perfect model.
    pub power: Vec<f64>,
    /// Velocity of the ship toward the radar by the displacement of its echo alone, and its standard deviation [m/s]; [`estimate`](super::estimate) uses it.
    pub by_echo: Option<[f64; 2]>,
    /// Whether the estimate passes the tests of [`refine`].
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

/// Ends of an ascent, of the first ascent with a wind, and of the ship before it: errors of the mean image are larger than the last steps.
const END: Until = Until {
    steps: 20,
    small: 0.4,
};
const FIRST: Until = Until {
    steps: 5,
    small: 2.0,
};
const SHIP: Until = Until {
    steps: 8,
    small: 2.0,
};

/// Ships that the wind is fitted to.
const FOLLOWED: usize = 2;

/// Starts around a guess: relative changes of the speed and changes of the heading \[deg\], about the width of a maximum.
const AROUND: [[f64; 2]; 5] = [
    [0.0, 0.0],
    [0.007, 0.0],
    [-0.007, 0.0],
    [0.0, 0.7],
    [0.0, -0.7],
];

/// Smallest log-likelihood ratio of a certain wake: fitting ten values to noise gains about 10 (chosen).
const CERTAIN: f64 = 20.0;

/// Largest acceptable misfit, and largest factors on brightness and texture in standard deviations of prior and estimate together (chosen).
const EXPLAINED: f64 = 1.25;
const USUAL: [f64; 2] = [3.0, 2.0];

/// Relative standard deviation above which the speed is unknown, and largest probability of other speeds (chosen).
const VAGUE: f64 = 0.15;
const DOUBT: f64 = 0.05;

/// Maximum-likelihood estimate of ship and wind near a guess.
///
/// Fisher scoring maximises the likelihood from five starts around the guess, then again from the opposite wind. Standard deviations are those of the
/// information times a factor for the error of the mean image (1.5 to 5, measured on simulated scenes). That of y also contains the shift by bright waves, which has another sign
/// if the wind is reversed.
///
/// The estimate is identifiable if the residual power is within 25 % and three standard deviations of the model's, the factors on brightness and texture agree with their priors (3 and 2
/// standard deviations of prior and estimate together), the ship raises the log-likelihood by more than 20, the standard deviation of the speed is below 15 %, and the probability of other speeds below 5 %.
///
/// - `image`: intensity with speckle, in the unit of σ⁰, `[rows, columns]` of the scene's grid
/// - `guess`: known radar, grid and water, and a guess of ship and wind
/// - `priors`: calibration of the brightness and knowledge of the texture
///
/// # Errors
///
/// An image of another size than the grid or with a value that is negative or no number, a scene without exactly one ship, or as
/// [`ExpectedImage::new`](super::ExpectedImage::new).
///
/// # Validity
///
/// Start within 1 % of the speed, 1 degree of the heading, and a tenth of the transverse wavelength (2πU²/g) of the position. Farther starts can converge to another
/// maximum with similar standard deviations; [`estimate`](super::estimate) searches for the start. One ship on a straight track. The mean image has the limits of
/// [`Likelihood`](super::Likelihood).
pub fn refine(image: &Field, guess: &Scene, priors: &Priors) -> Result<Estimate> {
    check(image, guess)?;
    let echo = Echo::of(image, guess);
    let observed = Observed::new(image.clone(), guess, |i, j| echo.shown(i, j));
    let around = AROUND.map(|[faster, turned]| {
        let mut start = guess.clone();
        start.ships[0].speed *= 1.0 + faster;
        start.ships[0].heading += turned;
        start
    });
    settled(&observed, &around, &[], priors)
}

/// Highest maximum that is reached from the starts, with its alternatives.
///
/// - `seas`: other seas that the likeliest ship is tried on
pub(super) fn settled(
    observed: &Observed,
    starts: &[Scene],
    seas: &[Sea],
    priors: &Priors,
) -> Result<Estimate> {
    let Some(ship) = starts.first().and_then(|start| start.ships.first()) else {
        return Err(no_start());
    };
    let ascent = Ascent {
        observed,
        parameters: &Parameter::OF_WAKE,
        priors,
        length: ship.length,
    };
    let of_ship = Parameter::OF_WAKE.into_iter().filter(|p| p.is_of_ship());
    let of_ship: Vec<Parameter> = of_ship.collect();
    let logarithmic = observed.logarithmic();
    let with_wind = Ascent {
        observed: &logarithmic,
        parameters: &of_ship,
        ..ascent
    };
    // The ship first, with the brightness of the image and the wind of the start: what they explain wrongly would be explained as texture.
    let mut ships = Vec::new();
    for start in starts {
        ships.push(with_wind.climb(start.clone(), as_bright(observed, start)?, SHIP)?);
    }
    sort(&mut ships);
    let mut points = Vec::new();
    if let Some(likeliest) = ships.first() {
        let own = likeliest.scene.sea.wind_toward;
        let other = |sea: &&Sea| axis_between(sea.wind_toward, own).abs() > 1.0;
        for sea in seas.iter().filter(other) {
            let mut scene = likeliest.scene.clone();
            scene.sea = sea.clone();
            let factors = as_bright(observed, &scene)?;
            points.push(ascent.climb(scene, factors, FIRST)?);
        }
    }
    for ship in ships.into_iter().take(FOLLOWED) {
        points.push(ascent.climb(ship.scene, ship.factors, FIRST)?);
    }
    sort(&mut points);
    let first = points.swap_remove(0);
    let first = ascent.climb(first.scene, first.factors, END)?;
    let mut opposite = first.scene.clone();
    opposite.sea.wind_toward = (opposite.sea.wind_toward + 180.0).rem_euclid(360.0);
    points.push(ascent.climb(opposite, first.factors, END)?);
    points.push(first);
    sort(&mut points);
    let open = without_ship(observed, &points[0], priors)?;
    concluded(&ascent, points, open)
}

/// The likeliest first.
fn sort(points: &mut [Point]) {
    points.sort_by(|a, b| b.log_posterior.total_cmp(&a.log_posterior));
}

/// Factors that give a scene the brightness of the image.
fn as_bright(observed: &Observed, scene: &Scene) -> Result<Factors> {
    let mean = ExpectedImage::new(scene, &[])?.intensity(scene)?;
    Ok(Factors {
        gain: observed.gain(&mean),
        ..Factors::default()
    })
}

fn no_start() -> Error {
    Error::Conflict {
        name: "ship".to_owned(),
        value: "no start".to_owned(),
        requirement: "but an estimate begins at one".to_owned(),
    }
}

/// Checks an image against the scene of its estimate.
pub(super) fn check(image: &Field, guess: &Scene) -> Result<()> {
    guess.validate()?;
    let conflict = |name: &str, value: String, requirement: String| {
        Err(Error::Conflict {
            name: name.to_owned(),
            value,
            requirement,
        })
    };
    let grid = &guess.grid;
    if [image.rows, image.columns] != [grid.rows, grid.columns] {
        let value = format!("{} x {} pixels", image.rows, image.columns);
        let requirement = format!("but the grid has {} x {}", grid.rows, grid.columns);
        return conflict("image", value, requirement);
    }
    if !image.values.iter().all(|v| v.is_finite() && *v >= 0.0) {
        let requirement = "but intensities are finite and not negative".to_owned();
        return conflict("image", "not an intensity".to_owned(), requirement);
    }
    if guess.ships.len() != 1 {
        let requirement = "but the guess has one ship".to_owned();
        return conflict("ship", format!("{} ships", guess.ships.len()), requirement);
    }
    Ok(())
}

/// Largest log-posterior of a sea without the ship.
fn without_ship(observed: &Observed, point: &Point, priors: &Priors) -> Result<f64> {
    let mut scene = point.scene.clone();
    scene.ships.clear();
    let of_sea = Parameter::OF_WAKE.into_iter().filter(|p| !p.is_of_ship());
    let ascent = Ascent {
        observed,
        parameters: &of_sea.collect::<Vec<_>>(),
        priors,
        length: 1.0,
    };
    let found = ascent.climb(scene, point.factors, FIRST)?;
    if point.log_posterior - found.log_posterior > 10.0 * CERTAIN {
        return Ok(found.log_posterior);
    }
    Ok(ascent.climb(found.scene, found.factors, END)?.log_posterior)
}

/// Root mean square ratio of error to standard deviation of the information, on 18 simulated scenes: the error of the mean image and the covariance.
fn model_error(parameter: Parameter) -> f64 {
    match parameter {
        Parameter::Value(Value::Speed) => 2.0,
        Parameter::Value(Value::Heading) => 3.5,
        Parameter::Value(Value::X) => 2.5,
        Parameter::Value(Value::Y) => 5.0,
        Parameter::Value(Value::WindSpeed) => 3.5,
        Parameter::Value(Value::WindToward) => 4.5,
        Parameter::Gain => 2.0,
        Parameter::Texture => 3.0,
        Parameter::Size | Parameter::Value(_) => 1.5,
    }
}

/// Factor on the difference of log-likelihood between opposite winds: about the inverse square of [`model_error`].
const BELIEVED: f64 = 0.05;

/// Estimate from maxima, the highest one first.
fn concluded(ascent: &Ascent<'_>, points: Vec<Point>, open: f64) -> Result<Estimate> {
    let mut points = points.into_iter();
    let first = points.next().ok_or_else(no_start)?;
    let top = first.log_posterior;
    let best = ascent.point(first.scene, first.factors)?;
    let mut others: Vec<Alternative> = Vec::new();
    for point in points {
        let seen = |other: &Alternative| same(&other.scene, &point.scene);
        if !same(&best.scene, &point.scene) && !others.iter().any(seen) {
            others.push(Alternative {
                weight: (BELIEVED * (point.log_posterior - top)).exp(),
                scene: point.scene,
            });
        }
    }
    let total = 1.0 + others.iter().map(|a| a.weight).sum::<f64>();
    for other in &mut others {
        other.weight /= total;
        other.scene = corrected(&other.scene);
    }
    let mut covariance = ascent.covariance(&best);
    if let Some(covariance) = &mut covariance {
        let factors: Vec<f64> = ascent.parameters.iter().map(|p| model_error(*p)).collect();
        let count = factors.len();
        for (n, value) in covariance.values.iter_mut().enumerate() {
            *value *= factors[n / count] * factors[n % count];
        }
        // The wind may be reversed, so the correction of the position is as uncertain as it is large.
        let y = Parameter::Value(Value::Y);
        if let Some(n) = ascent.parameters.iter().position(|p| *p == y) {
            covariance.add(n, n, drift(&best.scene).powi(2));
        }
    }
    let deviation = |n: usize| {
        let of = covariance.as_ref();
        of.map_or(f64::INFINITY, |c| c.at(n, n).max(0.0).sqrt())
    };
    let mut mean = ExpectedImage::new(&best.scene, &[])?.intensity(&best.scene)?;
    let factor = best.factors.gain as f32;
    mean.values.iter_mut().for_each(|v| *v *= factor);
    let scene = corrected(&best.scene);
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

/// Tests of [`refine`].
fn is_identifiable(found: &Estimate, best: &Point, priors: &Priors) -> bool {
    // Of a factor in standard deviations of its prior and of its estimate together.
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
    let is_other = |a: &&Alternative| (Value::Speed.of(&a.scene) / speed).ln().abs() > OTHER_SPEED;
    let others = found.alternatives.iter().filter(is_other);
    let doubt: f64 = others.map(|a| a.weight).sum();
    usual
        && explained
        && found.over_open_sea > CERTAIN
        && deviation < VAGUE * speed
        && doubt < DOUBT
}

/// The scene with directions from 0 to 360 degrees, and its ship where bright waves of the sea do not shift it.
fn corrected(scene: &Scene) -> Scene {
    let shift = drift(scene);
    let mut scene = scene.clone();
    scene.sea.wind_toward = scene.sea.wind_toward.rem_euclid(360.0) % 360.0;
    if let Some(ship) = scene.ships.first_mut() {
        ship.position[1] -= shift;
        ship.heading = ship.heading.rem_euclid(360.0) % 360.0;
    }
    scene
}

/// Azimuth shift of the mean image \[m\], to first order: brightness-weighted mean displacement by velocity bunching.
///
/// ```text
/// ⟨R s⟩ = (R/V) Σ ⟨ζ²⟩ Re m T_v*,     m tilt, hydrodynamic modulation and range bunching
/// ```
fn drift(scene: &Scene) -> f64 {
    let models = Models::new(scene);
    let open = OpenSea::new(&models);
    let transfer = open.modulation_of(&open.averaged(&models));
    let waves = open.waves.iter().map(|wave| {
        let m = transfer.at(wave.k, wave.omega);
        let radial = models.transfer.radial(wave.k, wave.omega);
        let brightness = m.tilt + m.hydrodynamic + m.range_bunching;
        wave.variance * (brightness * radial.conj()).re
    });
    models.range_to_velocity * waves.sum::<f64>()
}

/// Relative difference below which two speeds are the same, and above which they are fringes apart: a fringe is a transverse wavelength over twice the wake's length, some 4 %.
const SAME_SPEED: f64 = 0.005;
const OTHER_SPEED: f64 = 0.02;

/// Whether two scenes belong to the same maximum.
fn same(a: &Scene, b: &Scene) -> bool {
    let speed = (Value::Speed.of(a) / Value::Speed.of(b)).ln().abs();
    let turned = angle_between(a.sea.wind_toward, b.sea.wind_toward);
    speed < SAME_SPEED && turned.abs() < 20.0
}
