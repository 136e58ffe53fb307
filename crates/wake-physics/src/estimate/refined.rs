//! From a guess to the likeliest scene of an image, with error bars.

use super::ascent::{Ascent, Point};
use super::observed::Observed;
use super::parameter::{Factors, Parameter};
use super::priors::Priors;
use super::value::Value;
use crate::error::{Error, Result};
use crate::linear::OpenSea;
use crate::measure::angle_between;
use crate::models::Models;
use crate::raster::Field;
use crate::scene::Scene;
use serde::Serialize;

/// A value that was estimated.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Estimated {
    /// Which value.
    pub parameter: Parameter,
    /// The likeliest value, in [`Parameter::unit`]; of the factors the logarithm.
    pub value: f64,
    /// Standard deviation of its error; infinite where the image does not tell.
    pub deviation: f64,
}

/// Another maximum of the likelihood.
#[derive(Debug, Clone, PartialEq)]
pub struct Alternative {
    /// Its scene.
    pub scene: Scene,
    /// Its share of the probability, 0 to 1.
    pub weight: f64,
}

/// What an image says of ship and sea near a guess.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// The likeliest scene.
    pub scene: Scene,
    /// Its values with their deviations, in the order of [`Parameter::OF_WAKE`].
    pub values: Vec<Estimated>,
    /// Covariance of the values, row after row; empty where some value is not told at all.
    pub covariance: Vec<f64>,
    /// Share of the probability that this scene and its surroundings have, 0 to 1.
    pub weight: f64,
    /// The opposite wind, where it is another maximum.
    pub alternatives: Vec<Alternative>,
    /// ln likelihood, but for a constant of the image.
    pub log_likelihood: f64,
    /// ln likelihood above that of a sea without the ship.
    pub over_open_sea: f64,
    /// Power of the residual over its expectation by rings of wavenumbers, the longest waves first: 1 where the scene explains the
    /// image.
    pub power: Vec<f64>,
    /// Whether ship and sea can be told: see [`refine`].
    pub identifiable: bool,
}

impl Estimate {
    /// A value and its deviation; NaN for one that was not estimated.
    #[must_use]
    pub fn of(&self, parameter: Parameter) -> [f64; 2] {
        let found = self.values.iter().find(|v| v.parameter == parameter);
        found.map_or([f64::NAN; 2], |v| [v.value, v.deviation])
    }

    /// How far the image is from what the scene explains: the largest of [`Self::power`] and its inverses. 1 is perfect; 2 shows where
    /// the image has half as many looks.
    #[must_use]
    pub fn misfit(&self) -> f64 {
        let ratios = self.power.iter().map(|p| p.max(p.recip()));
        ratios.fold(1.0, f64::max)
    }
}

/// Steps of an ascent, and of those that begin around a guess.
const STEPS: usize = 20;
const FIRST_STEPS: usize = 4;

/// Starts around a guess: relative changes of the speed and turns of the heading \[deg\], as wide as basins are.
const AROUND: [[f64; 2]; 5] = [
    [0.0, 0.0],
    [0.007, 0.0],
    [-0.007, 0.0],
    [0.0, 0.7],
    [0.0, -0.7],
];

/// ln likelihood above the open sea from which a wake is certain: ten values take some 10, chance another 10 (chosen).
const CERTAIN: f64 = 20.0;

/// Largest misfit of a scene that explains its image, and largest factors on brightness and texture in standard deviations of their priors (chosen).
const EXPLAINED: f64 = 1.25;
const USUAL: [f64; 2] = [3.0, 2.0];

/// Relative deviation of the speed from which it is not known (chosen).
const VAGUE: f64 = 0.15;

/// The likeliest scene of an image near a guess: speed, heading, place and size of the ship, wind, brightness and texture, with standard
/// deviations.
///
/// Fisher scoring climbs from the guess and from four others around it to the highest maximum of the likelihood that it meets, and from there with the
/// opposite wind. What is said to be
/// identifiable explains the image (a residual like that of the model, factors that the priors allow), is certainly no sea without a
/// ship, and has a speed with a deviation below 15 %.
///
/// - `image`: intensity with speckle, in the unit of σ⁰, `[rows, columns]` of the scene's grid
/// - `guess`: radar, grid and water as they are; ship and wind near what they are
/// - `priors`: how well the brightness is calibrated and the texture known
///
/// # Errors
///
/// An image of another size than the grid or with a value that is negative or no number, a scene without a ship, or as
/// [`ExpectedImage::new`](super::ExpectedImage::new).
///
/// # Validity
///
/// The guess must be in the basin of the right maximum: waves a few hundred metres astern fit by chance where they are off by half a wavelength, so
/// speeds within about 1 %, headings within 1 degree and places within a tenth of the transverse waves (2πU²/g) are near enough. A guess
/// further off leads to another maximum with deviations just as small. One ship; the limits of the mean image are those of
/// [`Likelihood`](super::Likelihood).
pub fn refine(image: &Field, guess: &Scene, priors: &Priors) -> Result<Estimate> {
    check(image, guess)?;
    let observed = Observed::new(image.clone(), guess, |_, _| 1.0);
    let ascent = Ascent {
        observed: &observed,
        parameters: &Parameter::OF_WAKE,
        priors,
        length: guess.ships[0].length,
    };
    let first = around(&ascent, guess)?;
    let first = ascent.climb(first.scene, first.factors, STEPS)?;
    let mut opposite = first.scene.clone();
    opposite.sea.wind_toward = (opposite.sea.wind_toward + 180.0).rem_euclid(360.0);
    let second = ascent.climb(opposite, Factors::default(), STEPS)?;
    let points = match second.log_posterior > first.log_posterior {
        true => [second, first],
        false => [first, second],
    };
    let open = without_ship(&observed, &points[0], priors)?;
    concluded(&ascent, points, open)
}

/// The best of a few ascents that begin around a guess.
fn around(ascent: &Ascent<'_>, guess: &Scene) -> Result<Point> {
    let mut best: Option<Point> = None;
    for [faster, turned] in AROUND {
        let mut start = guess.clone();
        start.ships[0].speed *= 1.0 + faster;
        start.ships[0].heading += turned;
        let point = ascent.climb(start, Factors::default(), FIRST_STEPS)?;
        let better = |best: &Point| point.log_posterior > best.log_posterior;
        if best.as_ref().is_none_or(better) {
            best = Some(point);
        }
    }
    match best {
        Some(point) => Ok(point),
        None => ascent.point(guess.clone(), Factors::default()),
    }
}

fn check(image: &Field, guess: &Scene) -> Result<()> {
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

/// The largest ln posterior of a sea without the ship.
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
    Ok(ascent.climb(scene, point.factors, STEPS)?.log_posterior)
}

/// By how much errors exceed the deviations of the information, root of the mean square over simulated scenes: what the mean image and the covariance
/// are wrong by (`docs/physics/estimate.md`).
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

/// Share of a difference of ln likelihood between winds that is believed, as [`model_error`] squared says of curvatures.
const BELIEVED: f64 = 0.05;

/// Values, deviations and weights of two maxima, the likelier first.
fn concluded(ascent: &Ascent<'_>, [first, second]: [Point; 2], open: f64) -> Result<Estimate> {
    let other = match same(&first.scene, &second.scene) {
        true => 0.0,
        false => (BELIEVED * (second.log_posterior - first.log_posterior)).exp(),
    };
    let weight = 1.0 / (1.0 + other);
    let best = ascent.point(first.scene, first.factors)?;
    let mut covariance = ascent.covariance(&best);
    if let Some(covariance) = &mut covariance {
        let factors: Vec<f64> = ascent.parameters.iter().map(|p| model_error(*p)).collect();
        let count = factors.len();
        for (n, value) in covariance.values.iter_mut().enumerate() {
            *value *= factors[n / count] * factors[n % count];
        }
    }
    let deviation = |n: usize| {
        let of = covariance.as_ref();
        of.map_or(f64::INFINITY, |c| c.at(n, n).max(0.0).sqrt())
    };
    // The mean image lies where bright waves of the sea carry it; the ship does not.
    let mut scene = best.scene.clone();
    if let Some(ship) = scene.ships.first_mut() {
        ship.position[1] -= drift(&best.scene);
    }
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
    let priors = ascent.priors;
    let usual = gain.abs() < USUAL[0] * priors.gain && texture.abs() < USUAL[1] * priors.texture;
    let mut found = Estimate {
        scene,
        covariance: covariance.map_or(Vec::new(), |c| c.values),
        weight,
        alternatives: Vec::new(),
        log_likelihood: best.near.log_likelihood,
        over_open_sea,
        power: best.near.rings.iter().map(|ring| ring[0]).collect(),
        identifiable: false,
        values,
    };
    if other > 0.0 {
        found.alternatives.push(Alternative {
            scene: second.scene,
            weight: 1.0 - weight,
        });
    }
    let [speed, deviation] = found.of(Parameter::Value(Value::Speed));
    found.identifiable =
        usual && over_open_sea > CERTAIN && found.misfit() < EXPLAINED && deviation < VAGUE * speed;
    Ok(found)
}

/// How far bright waves of the open sea carry an image toward larger azimuth \[m\]: mean displacement of sources, weighed with their brightness,
/// to first order.
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

/// Whether two scenes are one maximum.
fn same(a: &Scene, b: &Scene) -> bool {
    let speed = (Value::Speed.of(a) / Value::Speed.of(b)).ln().abs();
    let turned = angle_between(a.sea.wind_toward, b.sea.wind_toward);
    speed < 0.005 && turned.abs() < 20.0
}
