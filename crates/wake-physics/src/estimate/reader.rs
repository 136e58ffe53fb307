//! One image: which ship and which wind made it, how well that is known, and what else may have.

use super::answer::{Alternative, Estimate, Fitted, GoodnessOfFit, Wake};
use super::calibration::Calibration;
use super::matrix::Matrix;
use super::mode::{Mode, Problem, along};
use super::observed::Observed;
use super::options::{Detection, Options};
use super::parameter::Parameter;
use super::part::Part;
use super::priors::Priors;
use super::scorer::SeaNoise;
use super::search::{Candidate, Wind, apart_winds, calm, ships, winds};
use super::state::State;
use super::value::Value;
use crate::error::{Error, Result};
use crate::measure::angle_between;
use crate::raster::{Field, Raster};
use crate::scene::Scene;
use crate::simulate::expected_intensity;

/// ln likelihood ratio of ship to none from which on a wake counts as one.
const LEAST_ABOVE_SEA: f64 = 20.0;
/// The same, from which on no other sea can explain the image.
const PLAIN: f64 = 500.0;

/// Share of the speed, and degrees of heading, above which a deviation says that the image does not tell.
const WIDEST: [f64; 2] = [0.1, 5.0];

/// Largest weight of other modes of the ship.
const OTHERS: f64 = 0.1;

/// Deviations of a ring and of a nuisance value from which on a fit is called inconsistent.
const INCONSISTENT: [f64; 2] = [5.0, 4.0];

/// Candidates that are followed in the part around the ship and in the whole image, and steps of each fit at most.
const FOLLOWED: [usize; 2] = [3, 2];
const STEPS: [usize; 2] = [8, 5];

/// Winds that are fitted, and steps of each at most.
const WINDS: usize = 3;
const WIND_STEPS: usize = 4;

/// Side of the part around the ship [pixels].
const SIDE: usize = 128;

/// Simulated images of the first rounds of the calibration, and the last step [deviations] from which on it has not settled.
const SCOUTS: usize = 8;
const LAST_STEP: f64 = 2.0;

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

/// Reads an image of intensity with speckle.
///
/// - `image`: linear, in the unit of σ⁰, or times an unknown factor if the prior of the gain is infinitely wide
/// - `known`: grid and radar of the image, fetch, depth and the ship's proportions; its values that are estimated do not
///   matter, only the length is a start
///
/// # Validity
///
/// A sea that is the same everywhere, one ship that goes straight. The coverage of the standard deviations has not been measured on
/// a set of scenes.
///
/// # Errors
///
/// A scene out of range, without a ship, without wind or with a ship that turns, an image of another size than the grid, or one
/// that is dark or holds a value that is negative or no number.
pub fn estimate(image: &Field, known: &Scene, options: &Options) -> Result<Estimate> {
    let known = prepared(image, known)?;
    let calibrated = options.priors.gain.is_finite();
    let whole = Part::whole(image, &known);
    let detection = options.detection.unwrap_or(Detection {
        position: [0.0; 2],
        within: f64::INFINITY,
        heading: None,
    });
    let winds = winds(&whole, calibrated)?;
    let view = Observed::new(image.clone(), &known, |_, _| 1.0);
    let problem = Problem {
        image,
        view: &view,
        priors: options.priors,
    };
    let seas = seas(&whole, options.priors, &winds)?;
    let mut start = State::of(known.clone());
    if let Some(sea) = seas.first() {
        start.scene.sea = sea.state.scene.sea.clone();
        start.factors = sea.state.factors;
    }
    let mut sea = start.clone();
    sea.scene.ships.clear();
    let sea = Mode {
        log_posterior: problem.log_posterior(&sea, &SeaNoise::new(&sea, &[])?)?,
        state: sea,
    };
    let place = (detection.position, detection.within);
    let lit = Part {
        image: scaled(image, 1.0 / start.factors.gain),
        scene: start.scene.clone(),
        ..whole.clone()
    };
    let candidates = ships(&lit, place, detection.heading)?;
    let near = followed(&lit, &start, &candidates)?;
    let mut modes = Vec::new();
    for candidate in near.iter().take(FOLLOWED[1]) {
        modes.push(problem.climb(candidate, &OF_SHIP, STEPS[1])?);
    }
    modes.sort_by(|a, b| b.log_posterior.total_cmp(&a.log_posterior));
    let Some(first) = modes.first() else {
        return nothing(&known, &sea, f64::NEG_INFINITY);
    };
    let best = problem.climb(&first.state, &Parameter::OF_WAKE, WIND_STEPS)?;
    let mut above_sea = best.log_posterior - sea.log_posterior;
    if above_sea < PLAIN {
        // The sea alone with the wind and the factors that fit it best.
        let mut alone = best.state.clone();
        alone.scene.ships.clear();
        let alone = problem.climb(&alone, &OF_SEA, WIND_STEPS)?;
        above_sea = above_sea.min(best.log_posterior - alone.log_posterior);
    }
    if above_sea < LEAST_ABOVE_SEA {
        return nothing(&known, &sea, above_sea);
    }
    let best = other_wind(&problem, best, &seas)?;
    let calibrated = Calibrated::new(&problem, &best.0, (known.seed, options.simulations))?;
    report((&known, options), &calibrated, (&best, &modes), above_sea)
}

/// Winds fitted in the calmest part of the image, the best first.
fn seas(whole: &Part, priors: Priors, winds: &[Wind]) -> Result<Vec<Mode>> {
    let Some(part) = calm(whole).into_iter().next() else {
        return Ok(Vec::new());
    };
    let view = Observed::new(part.image.clone(), &part.scene, |_, _| 1.0);
    let problem = Problem {
        image: &part.image,
        view: &view,
        priors,
    };
    let mut modes = Vec::new();
    for wind in apart_winds(winds, WINDS) {
        let mut state = State::of(part.scene.clone());
        state.scene.ships.clear();
        (state.scene.sea.wind_speed, state.scene.sea.wind_toward) = (wind.speed, wind.toward);
        if priors.gain.is_infinite() {
            let mean = expected_intensity(&state.scene)?.mean();
            state.factors.gain = part.image.mean() / mean;
        }
        modes.push(problem.climb(&state, &OF_SEA, WIND_STEPS)?);
    }
    modes.sort_by(|a, b| b.log_posterior.total_cmp(&a.log_posterior));
    Ok(modes)
}

/// Candidates fitted in the part around them, the best first.
fn followed(whole: &Part, start: &State, candidates: &[Candidate]) -> Result<Vec<State>> {
    let mut found: Vec<(f64, State)> = Vec::new();
    let astern = |heading: f64| crate::sar::geometry::direction(heading + 180.0);
    for candidate in candidates.iter().take(FOLLOWED[0]) {
        let reach = 0.25 * SIDE as f64 * whole.scene.grid.spacing;
        let middle = [0, 1].map(|n| candidate.position[n] + reach * astern(candidate.heading)[n]);
        let part = whole.around(middle, SIDE);
        let view = Observed::new(part.image.clone(), &part.scene, |_, _| 1.0);
        let problem = Problem {
            image: &part.image,
            view: &view,
            priors: Priors::default(),
        };
        let mut state = State::of(part.scene.clone());
        let mut bare = state.clone();
        bare.scene.ships.clear();
        for ship in &mut state.scene.ships {
            (ship.speed, ship.heading) = (candidate.speed, candidate.heading);
            ship.position = part.from_whole(candidate.position);
        }
        let mode = problem.climb(&state, &OF_SHIP, STEPS[0])?;
        let without = problem.log_posterior(&bare, &SeaNoise::new(&bare, &[])?)?;
        let mut state = start.clone();
        for (ship, found) in state.scene.ships.iter_mut().zip(&mode.state.scene.ships) {
            *ship = found.clone();
            ship.position = part.to_whole(found.position);
        }
        found.push((mode.log_posterior - without, state));
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut kept: Vec<State> = Vec::new();
    for (_, state) in found {
        let own = [Value::Speed, Value::Heading].map(|v| v.of(&state.scene));
        if !kept.iter().any(|other| !is_other_ship(own, other)) {
            kept.push(state);
        }
    }
    Ok(kept)
}

/// The fit with another wind, and the less likely of the two.
fn other_wind(problem: &Problem<'_>, best: Mode, seas: &[Mode]) -> Result<(Mode, Option<Mode>)> {
    let toward = best.state.scene.sea.wind_toward;
    let other = |sea: &&Mode| angle_between(sea.state.scene.sea.wind_toward, toward).abs() > 40.0;
    let Some(sea) = seas.iter().find(other) else {
        return Ok((best, None));
    };
    let mut state = best.state.clone();
    state.scene.sea = sea.state.scene.sea.clone();
    let other = problem.climb(&state, &Parameter::OF_WAKE, WIND_STEPS)?;
    Ok(match other.log_posterior > best.log_posterior {
        true => (other, Some(best)),
        false => (best, Some(other)),
    })
}

/// A mode with the mean of the score taken away, and its covariance.
struct Calibrated {
    state: State,
    covariance: Option<Matrix>,
    /// Deviations of the residual's rings.
    rings: Vec<f64>,
    /// Largest of the last steps, in deviations.
    last: f64,
}

impl Calibrated {
    fn new(problem: &Problem<'_>, mode: &Mode, (seed, count): (u64, usize)) -> Result<Self> {
        let parameters = &Parameter::OF_WAKE;
        let priors = problem.priors.matrix(parameters);
        let mut out = Self {
            state: mode.state.clone(),
            covariance: None,
            rings: Vec::new(),
            last: f64::INFINITY,
        };
        for count in [SCOUTS, SCOUTS, count.max(4)] {
            let noise = SeaNoise::new(&out.state, parameters)?;
            let around = problem.around(&out.state, parameters, &noise)?;
            let calibration = Calibration::new(&around.scorer, &out.state, (seed, count))?;
            out.rings = calibration.off(&around.told);
            let Some(inverse) = &around.inverse else {
                return Ok(out);
            };
            let pairs = around.told.score.iter().zip(&calibration.mean);
            let score: Vec<f64> = pairs.map(|(g, b)| g - b).collect();
            let step = inverse.product(&problem.score(&score, &out.state, parameters));
            let covariance = calibration.covariance(inverse, &priors);
            (out.state, out.last) = along(&out.state, parameters, (&step, &covariance));
            out.covariance = Some(covariance);
        }
        Ok(out)
    }

    fn read(&self, parameter: Parameter) -> Fitted {
        let at = Parameter::OF_WAKE.iter().position(|p| *p == parameter);
        let variance = self.covariance.as_ref().zip(at).map(|(c, n)| c.at(n, n));
        Fitted {
            value: self.state.get(parameter),
            deviation: variance.map_or(f64::INFINITY, |v| v.max(0.0).sqrt()),
        }
    }
}

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
    let Some(ship) = known.ships.first() else {
        let requirement = "but an estimate needs the proportions of one";
        return conflict("ship", "missing".to_owned(), requirement);
    };
    if ship.turn_rate != 0.0 {
        let requirement = "but an estimate is one of a ship that goes straight";
        return conflict("ship.turn_rate", ship.turn_rate.to_string(), requirement);
    }
    let mut scene = known.clone();
    scene.ships.truncate(1);
    scene.ships[0].echo = false;
    Ok(scene)
}

fn scaled(image: &Field, factor: f64) -> Field {
    Field {
        values: image.values.iter().map(|v| v * factor as f32).collect(),
        ..*image
    }
}

/// An estimate without a wake.
fn nothing(known: &Scene, sea: &Mode, above_sea: f64) -> Result<Estimate> {
    let scene = scene_of(&sea.state, known);
    Ok(Estimate {
        wake: None,
        above_sea,
        expected: scaled(&expected_intensity(&scene)?, sea.state.factors.gain),
        scene,
    })
}

fn scene_of(state: &State, known: &Scene) -> Scene {
    let mut scene = known.clone();
    scene.sea = state.scene.sea.clone();
    scene.ships.clone_from(&state.scene.ships);
    scene
}

fn report(
    (known, options): (&Scene, &Options),
    found: &Calibrated,
    (best, modes): (&(Mode, Option<Mode>), &[Mode]),
    above_sea: f64,
) -> Result<Estimate> {
    let scene = scene_of(&found.state, known);
    let value = |v: Value| found.read(Parameter::Value(v));
    let [speed, heading, x, y] = [Value::Speed, Value::Heading, Value::X, Value::Y].map(value);
    let alternatives = alternatives(best, modes);
    let other_ships: f64 = alternatives
        .iter()
        .filter(|a| is_other_ship([a.speed, a.heading], &best.0.state))
        .map(|a| a.weight)
        .sum();
    let grid = &scene.grid;
    let raster = Raster::image(grid.rows, grid.columns, grid.spacing);
    let forward = crate::sar::geometry::direction(heading.value);
    let length = found.read(Parameter::Size);
    let bow = 0.5 * length.value;
    let nuisance = [Parameter::Gain, Parameter::Texture].map(|p| found.read(p));
    let priors = [options.priors.gain, options.priors.texture];
    let pulled = [0, 1].map(|n| nuisance[n].value / priors[n]);
    let by_size = |a: &f64, b: &f64| a.abs().total_cmp(&b.abs());
    let largest = found.rings.iter().copied().max_by(by_size).unwrap_or(0.0);
    let consistent =
        largest.abs() < INCONSISTENT[0] && pulled.iter().all(|p| p.abs() < INCONSISTENT[1]);
    let wake = Wake {
        tip: raster.pixel(x.value + bow * forward[0], y.value + bow * forward[1]),
        position: [x, y],
        heading,
        speed,
        length,
        wind_speed: value(Value::WindSpeed),
        wind_toward: value(Value::WindToward),
        nuisance,
        names: Parameter::OF_WAKE.iter().map(|p| p.name()).collect(),
        covariance: found
            .covariance
            .as_ref()
            .map_or_else(Vec::new, |m| m.values.clone()),
        log_likelihood: best.0.log_posterior,
        identifiable: found.last < LAST_STEP
            && speed.deviation < WIDEST[0] * speed.value
            && heading.deviation < WIDEST[1]
            && other_ships < OTHERS
            && consistent,
        alternatives,
        goodness_of_fit: GoodnessOfFit {
            consistent,
            rings: found.rings.clone(),
            largest,
            priors: pulled,
        },
    };
    Ok(Estimate {
        expected: scaled(&expected_intensity(&scene)?, found.state.factors.gain),
        wake: Some(wake),
        above_sea,
        scene,
    })
}

fn is_other_ship([speed, heading]: [f64; 2], state: &State) -> bool {
    let own = [Value::Speed, Value::Heading].map(|v| v.of(&state.scene));
    (speed / own[0] - 1.0).abs() > 0.02 || angle_between(heading, own[1]).abs() > 2.0
}

/// Other modes by their weights, those of less than a thousandth left out.
fn alternatives((best, wind): &(Mode, Option<Mode>), modes: &[Mode]) -> Vec<Alternative> {
    let of = |mode: &Mode, below: f64| {
        let scene = &mode.state.scene;
        Alternative {
            weight: below.exp(),
            speed: Value::Speed.of(scene),
            heading: Value::Heading.of(scene),
            wind_speed: scene.sea.wind_speed,
            wind_toward: scene.sea.wind_toward,
        }
    };
    let first = modes.first().map_or(0.0, |mode| mode.log_posterior);
    let ships = modes
        .iter()
        .skip(1)
        .map(|mode| of(mode, mode.log_posterior - first));
    let ships = ships.filter(|a| is_other_ship([a.speed, a.heading], &best.state));
    let toward = best.state.scene.sea.wind_toward;
    let winds = wind
        .iter()
        .map(|mode| of(mode, mode.log_posterior - best.log_posterior));
    let winds = winds.filter(|a| angle_between(a.wind_toward, toward).abs() > 30.0);
    let mut all: Vec<Alternative> = ships.chain(winds).collect();
    let total = 1.0 + all.iter().map(|a| a.weight).sum::<f64>();
    all.iter_mut().for_each(|a| a.weight /= total);
    all.retain(|a| a.weight > 1e-3);
    all
}
