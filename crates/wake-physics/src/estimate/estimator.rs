//! Estimates of ship and wind from an image and a sighting of the wake.

use super::echo::Echo;
use super::observed::Observed;
use super::parameter::Parameter;
use super::priors::Priors;
use super::refine::{check, settled};
use super::refined::Estimate;
use super::search::{DRAWN, Found, Search, are_neighbours};
use super::sighting::Sighting;
use super::value::Value;
use super::winds::{Wind, likely, winds};
use crate::constants::GRAVITY;
use crate::error::Result;
use crate::kelvin::KELVIN_ANGLE;
use crate::raster::{Field, Raster};
use crate::scene::{Scene, Sea};
use crate::track::Track;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Largest number of answers from which the likelihood is maximised.
const CANDIDATES: usize = 4;

/// Largest number of winds with which the wake is searched, and of those tried on the likeliest ship: where speckle hides the sea,
/// winds of the same brightness along all axes are about equally likely (chosen).
const SEARCHED: usize = 3;
const TRIED: usize = 6;

/// Fractions of the best answer's gain by which another answer may be worse and is still followed, for the part of the wake near
/// the ship and for the whole wake, and difference of log-likelihood up to which no answer is dropped (chosen).
const NEAR_WORSE: f64 = 0.5;
const WORSE: f64 = 0.25;
const SURE: f64 = 20.0;

/// Transverse wavelength below which several speeds are about equally likely \[m\] (ships up to 6.6 m/s; measured on simulated
/// scenes).
const SHORTEST: f64 = 28.0;

/// Relative error of the mean brightness beside the wake, in addition to the calibration error (chosen).
const BRIGHTNESS: f64 = 0.03;

/// Width of the soft edge of the wedge that is excluded from the wind estimate \[deg\].
const SOFT: f64 = 20.0;

/// Maximum-likelihood estimate of ship and wind around a sighting, at any speed from 3.5 to 17 m/s.
///
/// The wind follows from brightness and texture beside the wake. A matched filter of mean images searches for speed, heading and
/// place within 2.5 standard deviations of the sighting, first with the part of the wake near the ship, then with the whole wake.
/// Fisher scoring maximises the likelihood from the best answers; error bars and tests are as in [`refine`](super::refine).
///
/// - `image`: intensity with speckle, in units of σ⁰, `[rows, columns]` of the scene's grid; echoes of ships are masked
/// - `known`: radar, grid and water, and one ship with the assumed hull; the ship's speed, heading and position and the wind's
///   direction are ignored, and the wind's speed is used only for an uncalibrated image
/// - `sighting`: place and heading of the wake
/// - `priors`: calibration of the brightness and knowledge of the texture
///
/// # Errors
///
/// A sighting with a value that is not finite or a deviation of 0, or as in [`refine`](super::refine).
///
/// # Validity
///
/// As in [`refine`](super::refine). Deep water. Ships slower than 6.6 m/s are never reported as identifiable: their waves are
/// many and faint, and a wrong speed can be about as likely as the right one.
pub fn estimate(
    image: &Field,
    known: &Scene,
    sighting: &Sighting,
    priors: &Priors,
) -> Result<Estimate> {
    check(image, known)?;
    sighting.check()?;
    let echo = Echo::of(image, known);
    let grid = &known.grid;
    let raster = Raster::image(grid.rows, grid.columns, grid.spacing);
    let beside = |i, j| echo.shown(i, j) * (1.0 - wedge(&raster, sighting, [i, j]));
    let beside = Observed::new(image.clone(), known, beside);
    let flat = Field::constant(&raster, 1.0);
    let known_gain = priors.gain.is_finite();
    let bright = known_gain.then(|| [beside.gain(&flat), priors.gain.hypot(BRIGHTNESS)]);
    let winds = winds(&beside, known, bright)?;
    let observed = Observed::new(image.clone(), known, |i, j| echo.shown(i, j));
    let logarithmic = observed.logarithmic();
    let with_wind = |wind| WithWind::new(&logarithmic, known, wind, sighting);
    let searches: Vec<WithWind<'_>> = likely(&winds, 45.0, SEARCHED)
        .into_iter()
        .map(with_wind)
        .collect();
    let near = searches.iter().enumerate().map(|(n, one)| one.near_ship(n));
    let near = near.collect::<Result<Vec<_>>>()?.concat();
    // First from the answers near the ship, then from the best of all.
    let whole = with_whole_wake(&searches, &of_each_speed(near), true)?;
    let whole = with_whole_wake(&searches, &apart(whole), false)?;
    let best = apart(whole);
    let start = |answer: &Answer| searches[answer.search].start(&answer.found);
    let starts: Vec<Scene> = best.iter().map(start).collect();
    let likely = likely(&winds, 25.0, TRIED).into_iter();
    let others: Vec<Sea> = likely.map(|wind| wind.open.sea.clone()).collect();
    let mut found = settled(&observed, &starts, &others, priors)?;
    let [speed, _] = found.of(Parameter::Value(Value::Speed));
    found.identifiable &= TAU * speed * speed / GRAVITY > SHORTEST;
    let [_, deviation] = found.of(Parameter::Value(Value::Y));
    found.by_echo = echo.radial_velocity(&found.scene, &found.mean, deviation);
    Ok(match found.by_echo {
        Some([velocity, deviation]) => found.with_radial_velocity(velocity, deviation),
        None => found,
    })
}

/// Search with one wind.
struct WithWind<'a> {
    search: Search<'a>,
    scene: Scene,
    log_likelihood: f64,
}

impl<'a> WithWind<'a> {
    fn new(observed: &'a Observed, known: &Scene, wind: &Wind, sighting: &'a Sighting) -> Self {
        let mut scene = known.clone();
        scene.sea = wind.open.sea.clone();
        Self {
            search: Search::new(observed, &scene, &wind.noise, &wind.mean, sighting),
            log_likelihood: wind.log_likelihood,
            scene,
        }
    }

    /// Answers from the part of the wake near the ship.
    fn near_ship(&self, search: usize) -> Result<Vec<Answer>> {
        let found = self.search.near_ship()?.into_iter();
        let answers = found.map(|found| self.answer(found, search));
        Ok(answers.collect())
    }

    fn answer(&self, found: Found, search: usize) -> Answer {
        Answer {
            log_likelihood: found.gain + self.log_likelihood,
            search,
            found,
        }
    }

    /// Scene from which the likelihood is maximised.
    fn start(&self, found: &Found) -> Scene {
        found.course.on(&self.scene, found.place)
    }
}

/// Improves answers by a search around them with the whole wake.
fn with_whole_wake(
    searches: &[WithWind<'_>],
    answers: &[Answer],
    anywhere: bool,
) -> Result<Vec<Answer>> {
    let better = |answer: &Answer| {
        let one = &searches[answer.search];
        Ok(one.answer(one.search.whole(&answer.found, anywhere)?, answer.search))
    };
    answers.par_iter().map(better).collect()
}

/// Answer of one of the searches.
#[derive(Clone, Copy)]
struct Answer {
    found: Found,
    /// Index of its search.
    search: usize,
    /// Log-likelihood of wind and wake.
    log_likelihood: f64,
}

/// Best answer in each range of speeds, without answers that gain much less than the best of all.
fn of_each_speed(mut answers: Vec<Answer>) -> Vec<Answer> {
    let range = |answer: &Answer| (answer.found.course.speed.ln() / DRAWN) as i32;
    sort(&mut answers);
    let mut kept: Vec<Answer> = Vec::new();
    for one in answers {
        let known = |other: &Answer| range(other) == range(&one);
        if !one.is_worse(kept.first(), NEAR_WORSE) && !kept.iter().any(known) {
            kept.push(one);
        }
    }
    kept
}

/// Best answers that are not neighbours, without answers that gain much less than the best.
fn apart(mut answers: Vec<Answer>) -> Vec<Answer> {
    sort(&mut answers);
    let mut kept: Vec<Answer> = Vec::new();
    for one in answers {
        let near = |other: &Answer| are_neighbours(&other.found, &one.found);
        let is_worse = one.is_worse(kept.first(), WORSE);
        if kept.len() < CANDIDATES && !is_worse && !kept.iter().any(near) {
            kept.push(one);
        }
    }
    kept
}

/// Sorts answers in descending order of log-likelihood.
fn sort(answers: &mut [Answer]) {
    answers.sort_by(|a, b| b.log_likelihood.total_cmp(&a.log_likelihood));
}

impl Answer {
    /// True if the log-likelihood is below that of the best answer by more than a fraction of its gain and more than [`SURE`].
    fn is_worse(&self, best: Option<&Self>, part: f64) -> bool {
        best.is_some_and(|best| {
            self.log_likelihood < best.log_likelihood - (part * best.found.gain).max(SURE)
        })
    }
}

/// 1 in the wedge astern of a sighting and around it, 0 beyond its soft edge.
fn wedge(raster: &Raster, sighting: &Sighting, [i, j]: [usize; 2]) -> f64 {
    let track = Track::new(sighting.place, sighting.heading, 0.0);
    let ahead = Sighting::REACH * sighting.place_sd;
    let [along, port] = track.seen_from_ship([raster.x(j), raster.y(i)]);
    let astern = ahead - along;
    if astern <= 0.0 {
        return 0.0;
    }
    let angle = (port.abs() - ahead).max(0.0).atan2(astern).to_degrees();
    let inside = KELVIN_ANGLE.to_degrees() + Sighting::REACH * sighting.heading_sd;
    ((inside + SOFT - angle) / SOFT).clamp(0.0, 1.0)
}
