//! One image: which ship and which wind made it, how well that is known, and what else may have.

use super::coarse::Coarse;
use super::echo::Echo;
use super::fit::{Fit, Fitter, Priors, fitted};
use super::likelihood::Observed;
use super::noise::Noise;
use super::options::{Detection, Options};
use super::parameter::{Parameter, State};
use super::report::{Alternative, Estimate, Estimated, Fitted, GoodnessOfFit};
use super::search::{Filters, Start, Wind, winds};
use super::value::Value;
use crate::error::{Error, Result};
use crate::measure::angle_between;
use crate::raster::{Field, Raster};
use crate::scene::Scene;

/// ln likelihood ratio of wake to none that counts as a wake: of 200 images without one the largest is lower.
const LEAST_ABOVE_SEA: f64 = 20.0;

/// Share of the speed, and degrees of heading, above which a deviation says that the image does not tell.
const WIDEST: [f64; 2] = [0.1, 5.0];

/// Largest weight of other modes of the ship.
const OTHERS: f64 = 0.1;

/// Deviations from which a fit is called inconsistent.
const INCONSISTENT: [f64; 2] = [6.0, 4.0];

/// Reads an image of intensity with speckle.
///
/// - `image`: linear, in the unit of σ⁰, or times an unknown factor if the prior of the gain is infinitely wide
/// - `known`: grid and radar of the image, fetch, depth and the ship's proportions; its values that are estimated do not
///   matter, only the length is a start
///
/// # Errors
///
/// A scene out of range, without a ship or with one that turns, an image of another size than the grid, or an image without
/// light.
pub fn estimate(image: &Field, known: &Scene, options: &Options) -> Result<Estimate> {
    let known = prepared(image, known)?;
    let echo = Echo::of(image, &known);
    let torus = Noise::new(&known)?.size;
    let shown = |i: usize, j: usize| echo.as_ref().map_or(1.0, |echo| echo.shown(&known, i, j));
    let observed = Observed::new(image.clone(), torus, shown);
    let fitter = Fitter {
        observed: &observed,
        priors: options.priors,
        steps: 12,
        echo,
    };
    let winds = winds(&observed, &known, options.priors.gain.is_finite())?;
    let sea = sea(&fitter, &known, &winds)?;
    let detection = options.detection.unwrap_or(Detection {
        position: [0.0; 2],
        within: ANYWHERE,
        heading: None,
    });
    let mut modes = ships(image, &known, (&sea, echo.as_ref()), (&detection, options))?;
    if modes.is_empty() {
        return Ok(nothing(&sea, &known));
    }
    let first = sea_with(&sea, &modes.remove(0));
    let mut best = fitter.mode(&first, &Parameter::OF_WAKE, true)?;
    let others = modes;
    let mut winds_of = Vec::new();
    if let Some(wind) = other_wind(&best, &winds) {
        let mut state = best.state.clone();
        (state.scene.sea.wind_speed, state.scene.sea.wind_toward) = (wind.speed, wind.toward);
        let turned = fitter.mode(&state, &Parameter::OF_WAKE, true)?;
        winds_of.push(match turned.log_posterior > best.log_posterior {
            true => std::mem::replace(&mut best, turned),
            false => turned,
        });
    }
    Ok(report(
        best,
        &sea,
        (&winds_of, &others),
        (echo.as_ref(), options),
    ))
}

/// Distance from the middle of the image within which a ship is looked for where no detection says where \[m\].
const ANYWHERE: f64 = 150.0;

/// Values of the ship alone: the wind stays.
const OF_SHIP: [Parameter; 5] = [
    Parameter::Value(Value::Speed),
    Parameter::Value(Value::Heading),
    Parameter::Value(Value::X),
    Parameter::Value(Value::Y),
    Parameter::Size,
];

/// Values of a sea without ships.
const OF_SEA: [Parameter; 4] = [
    Parameter::Value(Value::WindSpeed),
    Parameter::Value(Value::WindToward),
    Parameter::Gain,
    Parameter::Texture,
];

/// The scene that is known, checked against the image.
fn prepared(image: &Field, known: &Scene) -> Result<Scene> {
    known.validate()?;
    let conflict = |name: &str, value: String, requirement: &str| {
        Err(Error::Conflict {
            name: name.to_owned(),
            value,
            requirement: requirement.to_owned(),
        })
    };
    let size = [known.grid.rows, known.grid.columns];
    if [image.rows, image.columns] != size {
        let value = format!("{} x {} pixels", size[0], size[1]);
        let requirement = format!("but the image has {} x {}", image.rows, image.columns);
        return conflict("grid", value, &requirement);
    }
    let lit = image.values.iter().all(|v| v.is_finite() && *v >= 0.0) && image.mean() > 0.0;
    if !lit {
        let requirement = "but intensities are finite, not negative, and not all 0";
        return conflict(
            "image",
            "dark or not a number somewhere".to_owned(),
            requirement,
        );
    }
    if known.ships.is_empty() {
        let requirement = "but an estimate needs the proportions of one";
        return conflict("ship", "missing".to_owned(), requirement);
    }
    let mut scene = known.clone();
    scene.ships.truncate(1);
    scene.ships[0].echo = false;
    Ok(scene)
}

/// The sea without a wake.
fn sea(fitter: &Fitter<'_>, known: &Scene, winds: &[Wind]) -> Result<Fit> {
    let mut state = State::of(known);
    state.scene.ships.clear();
    if let Some(wind) = winds.first() {
        (state.scene.sea.wind_speed, state.scene.sea.wind_toward) = (wind.speed, wind.toward);
    }
    fitter.mode(&state, &OF_SEA, false)
}

/// A ship that may have made the wake, and ln of its likelihood less that of the best one.
struct Ship {
    speed: f64,
    heading: f64,
    position: [f64; 2],
    length: f64,
    /// A ship of the same proportions.
    proportions: crate::scene::Ship,
    below_best: f64,
}

/// Ships at modes of the likelihood of the image at half its resolution, the wind held; the best first.
fn ships(
    image: &Field,
    known: &Scene,
    (sea, echo): (&Fit, Option<&Echo>),
    (detection, options): (&Detection, &Options),
) -> Result<Vec<Ship>> {
    let coarse = Coarse::of(image, known);
    let [x, y] = coarse.origin;
    let mut template = State {
        scene: coarse.scene.clone(),
        ..sea.state.clone()
    };
    template.scene.sea = sea.state.scene.sea.clone();
    let moved = |[a, b]: [f64; 2]| [a - x, b - y];
    let echo = echo.map(|echo| echo.moved(moved));
    let shown = |i: usize, j: usize| {
        echo.as_ref()
            .map_or(1.0, |e| e.shown(&template.scene, i, j))
    };
    let torus = Noise::new(&template.scene)?.size;
    let observed = Observed::new(coarse.image, torus, shown);
    let fitter = Fitter {
        observed: &observed,
        priors: options.priors,
        steps: 8,
        echo,
    };
    let filters = Filters::new(&observed, &template.scene)?;
    let near = Detection {
        position: moved(detection.position),
        ..*detection
    };
    let mut modes = Vec::new();
    for start in filters.starts(&near, options.starts) {
        modes.push(fitter.mode(&started(&template, &start), &OF_SHIP, false)?);
    }
    modes.sort_by(|a, b| b.log_posterior.total_cmp(&a.log_posterior));
    let best = modes.first().map_or(0.0, |fit| fit.log_posterior);
    let ship = |fit: &Fit| {
        let [speed, heading, a, b] =
            [Value::Speed, Value::Heading, Value::X, Value::Y].map(|v| v.of(&fit.state.scene));
        Ship {
            speed,
            heading,
            position: [a + x, b + y],
            length: fit.state.get(Parameter::Size),
            proportions: known.ships[0].clone(),
            below_best: best - fit.log_posterior,
        }
    };
    Ok(modes.iter().map(ship).collect())
}

/// The sea of a fit with a ship.
fn sea_with(sea: &Fit, ship: &Ship) -> State {
    let mut state = sea.state.clone();
    state.scene.ships = vec![crate::scene::Ship {
        speed: ship.speed,
        heading: ship.heading,
        position: ship.position,
        ..ship.proportions.clone()
    }];
    let longer = ship.length - state.get(Parameter::Size);
    state.advance(Parameter::Size, longer);
    state
}

fn started(template: &State, start: &Start) -> State {
    let mut state = template.clone();
    for ship in &mut state.scene.ships {
        (ship.speed, ship.heading, ship.position) = (start.speed, start.heading, start.position);
    }
    state
}

/// The most likely wind that is not the one of a fit.
fn other_wind(best: &Fit, winds: &[Wind]) -> Option<Wind> {
    let toward = best.state.scene.sea.wind_toward;
    let other = |wind: &&Wind| angle_between(wind.toward, toward).abs() > 60.0;
    winds.iter().find(other).copied()
}

/// An estimate without a wake.
fn nothing(sea: &Fit, known: &Scene) -> Estimate {
    let mut scene = sea.state.scene.clone();
    scene.ships.clone_from(&known.ships);
    Estimate {
        wakes: Vec::new(),
        fit: fitted(sea),
        residual: sea.near.residual.clone(),
        scene,
    }
}

/// A fit as an estimate.
fn report(
    best: Fit,
    sea: &Fit,
    (winds, ships): (&[Fit], &[Ship]),
    (echo, options): (Option<&Echo>, &Options),
) -> Estimate {
    let above_sea = best.log_posterior - sea.log_posterior;
    if above_sea < LEAST_ABOVE_SEA {
        return nothing(sea, &best.state.scene);
    }
    let alternatives = alternatives(&best, winds, ships);
    let read = |parameter: Parameter| Fitted {
        value: best.state.get(parameter),
        deviation: best.deviation(parameter),
    };
    let [speed, heading, x, y] =
        [Value::Speed, Value::Heading, Value::X, Value::Y].map(|v| read(Parameter::Value(v)));
    let other_ships: f64 = alternatives
        .iter()
        .filter(|a| {
            (a.speed / speed.value - 1.0).abs() > 0.02
                || angle_between(a.heading, heading.value).abs() > 2.0
        })
        .map(|a| a.weight)
        .sum();
    let scene = best.state.scene.clone();
    let raster = Raster::image(scene.grid.rows, scene.grid.columns, scene.grid.spacing);
    let forward = crate::track::direction(heading.value);
    let half = 0.5 * best.state.get(Parameter::Size);
    let radial = echo.and_then(|e| e.radial_velocity(&scene, [y.value, y.deviation]));
    let estimated = Estimated {
        tip: raster.pixel(x.value + half * forward[0], y.value + half * forward[1]),
        position: [x, y],
        heading,
        speed,
        length: read(Parameter::Size),
        wind_speed: read(Parameter::Value(Value::WindSpeed)),
        wind_toward: read(Parameter::Value(Value::WindToward)),
        nuisance: [Parameter::Gain, Parameter::Texture].map(read),
        names: best.parameters.iter().map(|p| p.name()).collect(),
        covariance: best
            .covariance
            .as_ref()
            .map_or_else(Vec::new, |m| m.values.clone()),
        radial_velocity: radial.map(|[value, deviation]| Fitted { value, deviation }),
        log_likelihood: best.log_posterior,
        above_sea,
        identifiable: best.converged
            && speed.deviation < WIDEST[0] * speed.value
            && heading.deviation < WIDEST[1]
            && other_ships < OTHERS,
        alternatives,
        goodness_of_fit: goodness(&best, &options.priors),
    };
    Estimate {
        fit: fitted(&best),
        residual: best.near.residual.clone(),
        scene,
        wakes: vec![estimated],
    }
}

/// Other modes by their weights, those of less than a thousandth left out: winds by the likelihood of the whole image, ships by
/// that at half its resolution.
fn alternatives(best: &Fit, winds: &[Fit], ships: &[Ship]) -> Vec<Alternative> {
    let sea = &best.state.scene.sea;
    let winds = winds.iter().map(|fit| {
        let [speed, heading, wind_speed, wind_toward] = [
            Value::Speed,
            Value::Heading,
            Value::WindSpeed,
            Value::WindToward,
        ]
        .map(|v| v.of(&fit.state.scene));
        Alternative {
            weight: (fit.log_posterior - best.log_posterior).min(50.0).exp(),
            speed,
            heading,
            wind_speed,
            wind_toward,
        }
    });
    let ships = ships.iter().map(|ship| Alternative {
        weight: (-ship.below_best).exp(),
        speed: ship.speed,
        heading: ship.heading,
        wind_speed: sea.wind_speed,
        wind_toward: sea.wind_toward,
    });
    let differs = |other: &Alternative| {
        let scene = &best.state.scene;
        let off = |one: f64, value: Value| angle_between(one, value.of(scene)).abs();
        off(other.wind_toward, Value::WindToward) > 20.0
            || off(other.heading, Value::Heading) > 2.0
            || (other.speed / Value::Speed.of(scene) - 1.0).abs() > 0.02
    };
    let mut all: Vec<Alternative> = winds.chain(ships).filter(differs).collect();
    let total = 1.0 + all.iter().map(|a| a.weight).sum::<f64>();
    all.iter_mut().for_each(|a| a.weight /= total);
    all.retain(|a| a.weight > 1e-3);
    all
}

fn goodness(best: &Fit, priors: &Priors) -> GoodnessOfFit {
    let deviations = best.near.rings.iter().map(|[ratio, count]| {
        let peakedness = 1.0;
        (ratio - 1.0) / (2.0 * peakedness / count.max(1.0)).sqrt()
    });
    let largest = deviations.fold(
        0.0,
        |most: f64, d| if d.abs() > most.abs() { d } else { most },
    );
    let [gain, texture] = [
        (Parameter::Gain, priors.gain),
        (Parameter::Texture, priors.texture),
    ]
    .map(|(parameter, deviation)| best.state.get(parameter) / deviation);
    GoodnessOfFit {
        power: best.near.rings.iter().map(|r| r[0]).collect(),
        largest,
        priors: [gain, texture],
        consistent: largest.abs() < INCONSISTENT[0]
            && gain.abs() < INCONSISTENT[1]
            && texture.abs() < INCONSISTENT[1],
    }
}
