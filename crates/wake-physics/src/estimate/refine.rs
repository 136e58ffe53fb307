//! Maximum-likelihood estimate near a guess: ascents from several starts to the highest maximum.

use super::ascent::{Ascent, Point, Until, sort};
use super::echo::Echo;
use super::expected::ExpectedImage;
use super::noise::Noise;
use super::observed::Observed;
use super::parameter::{Factors, Parameter};
use super::priors::Priors;
use super::refined::{CERTAIN, Estimate, concluded, no_start};
use super::search::{Found, Search};
use super::sighting::Sighting;
use super::similar::Course;
use super::texture::Textures;
use crate::error::{Error, Result};
use crate::linear::OpenSea;
use crate::measure::axis_between;
use crate::models::Models;
use crate::raster::Field;
use crate::scene::{Scene, Sea};

/// Stopping criteria of the last ascent, of the first ascent with a wind, of the ship's ascent before it, and of ascents one
/// pixel away.
const END: Until = Until {
    steps: 20,
    small: 0.1,
    farther: 0.25,
};
const FIRST: Until = Until {
    steps: 5,
    small: 2.0,
    farther: 1.0,
};
const SHIP: Until = Until {
    steps: 8,
    small: 2.0,
    farther: 1.0,
};
const PIXEL: Until = Until {
    steps: 10,
    small: 0.5,
    farther: 0.25,
};

/// Drop in log-likelihood from the highest maximum beyond which a maximum is not followed to other pixels, and number of maxima
/// that are (chosen).
const POSSIBLE: f64 = 300.0;
const BY_PIXELS: usize = 5;

/// Number of ships for which the wind is fitted.
const FOLLOWED: usize = 2;

/// Starts around a guess: relative changes of the speed and changes of the heading \[deg\], about the width of a maximum.
const AROUND: [[f64; 2]; 5] = [
    [0.0, 0.0],
    [0.007, 0.0],
    [-0.007, 0.0],
    [0.0, 0.7],
    [0.0, -0.7],
];

/// Maximum-likelihood estimate of ship and wind near a guess.
///
/// Fisher scoring maximises the likelihood from five starts around the guess, then again from the opposite wind and from places
/// one pixel away. Standard deviations are those of the information times a factor for the error of the model (1.2 to 3.5,
/// chosen). They also include the spread over other maxima, weighted by probability: places one pixel away, and winds along other
/// axes. Opposite winds count for the ship, whose wake they shift differently, and are listed as alternatives.
///
/// The estimate is identifiable if the residual power is within 25 % and three standard deviations of the model's, the factors on
/// brightness and texture agree with their priors (within 3 and 2 standard deviations of prior and estimate combined), the ship
/// raises the log-likelihood by more than 20, the standard deviation of the speed is below 15 %, and the probability of other
/// speeds is below 5 %.
///
/// - `image`: intensity with speckle, in units of σ⁰, `[rows, columns]` of the scene's grid
/// - `guess`: known radar, grid and water, and a guess of ship and wind
/// - `priors`: calibration of the brightness and knowledge of the texture
///
/// # Errors
///
/// An image whose size differs from the grid's, a pixel that is negative or not finite, a scene without exactly one ship, or as
/// in [`ExpectedImage::new`](super::ExpectedImage::new).
///
/// # Validity
///
/// Start within 1 % of the speed, 1 degree of the heading, and a tenth of the transverse wavelength (2πU²/g) of the position.
/// Starts farther away can converge to another maximum with similar standard deviations; [`estimate`](super::estimate) searches
/// for the start. One ship on a straight track. The mean image has the limits of [`Likelihood`](super::Likelihood).
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
        let value = "negative or not finite in some pixels".to_owned();
        let requirement = "but intensities must be finite and at least 0".to_owned();
        return conflict("image", value, requirement);
    }
    if guess.ships.len() != 1 {
        let requirement = "but an estimate needs a scene with one ship".to_owned();
        return conflict(
            "number of ships",
            guess.ships.len().to_string(),
            requirement,
        );
    }
    Ok(())
}

/// Highest maximum reached from the starts, with its alternatives.
///
/// - `seas`: other seas on which the likeliest ship is tried
pub(super) fn settled(
    observed: &Observed,
    starts: &[Scene],
    seas: &[Sea],
    priors: &Priors,
) -> Result<Estimate> {
    let Some(ship) = starts.first().and_then(|start| start.ships.first()) else {
        return Err(no_start());
    };
    let textures = Textures::default();
    let ascent = Ascent {
        observed,
        parameters: &Parameter::OF_WAKE,
        priors,
        textures: &textures,
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
    // The ship first, with the brightness of the image and the wind of the start: errors of the ship would be fitted as texture.
    let mut ships = Vec::new();
    for start in starts {
        ships.push(with_wind.climb(start.clone(), as_bright(observed, start)?, SHIP)?);
    }
    sort(&mut ships);
    let mut points: Vec<Point> = Vec::new();
    if let Some(likeliest) = ships.first() {
        let own = likeliest.scene.sea.wind_toward;
        let other = |sea: &&Sea| axis_between(sea.wind_toward, own).abs() > 1.0;
        for sea in seas.iter().filter(other) {
            let scene = on_sea(&logarithmic, &likeliest.scene, sea.clone())?;
            let factors = as_bright(observed, &scene)?;
            points.push(ascent.climb(scene, factors, FIRST)?);
        }
    }
    for ship in ships.into_iter().take(FOLLOWED) {
        points.push(ascent.climb(ship.scene, ship.factors, FIRST)?);
    }
    sort(&mut points);
    let Point { scene, factors, .. } = points.swap_remove(0);
    // Waves of the sea shift a wake, so the ship is elsewhere with the opposite wind.
    for turned in [0.0, 180.0] {
        let mut sea = scene.sea.clone();
        sea.wind_toward = (sea.wind_toward + turned).rem_euclid(360.0);
        let start = on_sea(&logarithmic, &scene, sea)?;
        points.push(ascent.climb(start, factors, END)?);
    }
    sort(&mut points);
    let least = points[0].log_posterior - POSSIBLE;
    let each = points.into_iter().enumerate().map(|(n, point)| {
        match n < BY_PIXELS && point.log_posterior > least {
            true => ascent.over_pixels(point, PIXEL),
            false => Ok(vec![point]),
        }
    });
    let each = each.collect::<Result<Vec<_>>>()?;
    let mut points: Vec<Point> = each.into_iter().flatten().collect();
    sort(&mut points);
    let open = without_ship(&ascent, &points[0])?;
    concluded(&ascent, points, open)
}

/// The scene on another sea, with its ship moved to where that sea would put the wake of the image.
fn on_sea(observed: &Observed, scene: &Scene, sea: Sea) -> Result<Scene> {
    let mut other = scene.clone();
    other.sea = sea;
    let by = shift(scene) - shift(&other);
    for ship in &mut other.ships {
        ship.position[1] += by;
    }
    let Some(sighting) = Sighting::of_ship(&other) else {
        return Ok(other);
    };
    let mut open = other.clone();
    open.ships.clear();
    let mean = ExpectedImage::new(&open, &[])?.intensity(&open)?;
    let noise = Noise::new(&open)?;
    let search = Search::new(observed, &other, &noise, &mean, &sighting);
    let course = Course {
        speed: other.ships[0].speed,
        heading: sighting.heading,
    };
    let here = Found {
        course,
        place: sighting.place,
        gain: 0.0,
    };
    let found = search.beside(&here)?;
    Ok(found.course.on(&other, found.place))
}

/// Azimuth shift of a weak wake by the waves of the sea \[m\]: brightness-weighted mean displacement, to first order.
///
/// ```text
/// (R/V) Σ ⟨ζ²⟩ Re m T_v*,     m tilt and hydrodynamic modulation
/// ```
fn shift(scene: &Scene) -> f64 {
    let models = Models::new(scene);
    let open = OpenSea::new(&models);
    let transfer = open.modulation_of(&open.averaged(&models));
    let waves = open.waves.iter().map(|wave| {
        let m = transfer.at(wave.k, wave.omega);
        let radial = models.transfer.radial(wave.k, wave.omega);
        wave.variance * ((m.tilt + m.hydrodynamic) * radial.conj()).re
    });
    models.range_to_velocity * waves.sum::<f64>()
}

/// Factors that scale a scene to the brightness of the image.
fn as_bright(observed: &Observed, scene: &Scene) -> Result<Factors> {
    let mean = ExpectedImage::new(scene, &[])?.intensity(scene)?;
    Ok(Factors {
        gain: observed.gain(&mean),
        ..Factors::default()
    })
}

/// Largest log-posterior of a sea without the ship.
fn without_ship(of: &Ascent<'_>, point: &Point) -> Result<f64> {
    let mut scene = point.scene.clone();
    scene.ships.clear();
    let of_sea = Parameter::OF_WAKE.into_iter().filter(|p| !p.is_of_ship());
    let ascent = Ascent {
        parameters: &of_sea.collect::<Vec<_>>(),
        length: 1.0,
        ..*of
    };
    let found = ascent.climb(scene, point.factors, FIRST)?;
    if point.log_posterior - found.log_posterior > 10.0 * CERTAIN {
        return Ok(found.log_posterior);
    }
    Ok(ascent.climb(found.scene, found.factors, END)?.log_posterior)
}
