//! Ship and wind from an image and a sighting of the wake.

use super::echo::Echo;
use super::observed::Observed;
use super::parameter::Parameter;
use super::priors::Priors;
use super::refined::{Estimate, check, settled};
use super::search::{Found, Search, are_neighbours};
use super::sighting::Sighting;
use super::value::Value;
use super::winds::{Wind, likely, winds};
use crate::constants::GRAVITY;
use crate::error::Result;
use crate::kelvin::KELVIN_ANGLE;
use crate::raster::{Field, Raster};
use crate::scene::Scene;
use crate::track::Track;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Answers of the part near the ship that the whole wake is compared with, and answers from which the likelihood is maximised.
const WHOLE: usize = 8;
const CANDIDATES: usize = 4;

/// Part of the best answer's gain by which an answer may be worse and is still followed (chosen).
const WORSE: f64 = 0.5;

/// Transverse wavelength below which several speeds are about equally likely \[m\] (of ships up to 6.6 m/s; measured on simulated scenes).
const SHORTEST: f64 = 28.0;

/// Width of the edge of the wedge that the wind is not estimated in \[deg\].
const SOFT: f64 = 20.0;

/// Maximum-likelihood estimate of ship and wind around a sighting, at any speed from 3.5 to 17 m/s.
///
/// The wind follows from brightness and texture beside the wake. A matched filter of mean images searches for speed, heading and place within 2.5 standard deviations of the sighting, first
/// with the part of the wake near the ship, then with all of it. Fisher scoring maximises the likelihood from the three best answers; error bars and tests are those of [`refine`](super::refine).
///
/// - `image`: intensity with speckle, in the unit of σ⁰, `[rows, columns]` of the scene's grid. Echoes of ships are left out
/// - `known`: radar, grid and water, and one ship with the hull that is assumed; its speed, heading and position and the wind's direction do not count,
///   and the wind's speed only for an uncalibrated image
/// - `sighting`: place and heading of the wake
/// - `priors`: calibration of the brightness and knowledge of the texture
///
/// # Errors
///
/// A sighting with a value that is no number or a deviation of 0, or as [`refine`](super::refine).
///
/// # Validity
///
/// As [`refine`](super::refine). Deep water. Ships slower than 6.6 m/s are never identifiable: their waves are many and faint, and a wrong speed can be about as likely as the right one.
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
    let bright = priors.gain.is_finite().then(|| beside.gain(&flat));
    let winds = winds(&beside, known, bright)?;
    let observed = Observed::new(image.clone(), known, |i, j| echo.shown(i, j));
    let with_wind = |wind| WithWind::new(&observed, known, wind, sighting);
    let searches: Vec<WithWind<'_>> = likely(&winds, 45.0).into_iter().map(with_wind).collect();
    let near = searches.iter().enumerate().map(|(n, one)| one.near_ship(n));
    let near = near.collect::<Result<Vec<_>>>()?.concat();
    // Once from the answers near the ship, then from the best of all.
    let whole = with_whole_wake(&searches, &apart(near, WHOLE))?;
    let whole = with_whole_wake(&searches, &apart(whole, CANDIDATES))?;
    let best = apart(whole, CANDIDATES);
    // The likeliest course with each likely wind, and the other courses with theirs.
    let likeliest = best.first().map(|answer| answer.found);
    let with_each_wind = likely(&winds, 25.0).into_iter().filter_map(|wind| {
        let Found { course, place, .. } = likeliest?;
        let mut scene = known.clone();
        scene.sea = wind.open.sea.clone();
        Some(course.on(&scene, place))
    });
    let others = best.iter().skip(1);
    let others = others.map(|answer| searches[answer.search].start(&answer.found));
    let starts: Vec<Scene> = with_each_wind.chain(others).collect();
    let mut found = settled(&observed, &starts, priors)?;
    let [speed, _] = found.of(Parameter::Value(Value::Speed));
    found.identifiable &= TAU * speed * speed / GRAVITY > SHORTEST;
    let [_, deviation] = found.of(Parameter::Value(Value::Y));
    found.by_echo = echo.radial_velocity(&found.scene, deviation);
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
            search: Search::new(observed, (&scene, &wind.noise, &wind.mean), sighting),
            log_likelihood: wind.log_likelihood,
            scene,
        }
    }

    /// Answers of the part of the wake near the ship.
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

/// Better answers near others, by the whole wake.
fn with_whole_wake(searches: &[WithWind<'_>], answers: &[Answer]) -> Result<Vec<Answer>> {
    let better = |answer: &Answer| {
        let one = &searches[answer.search];
        Ok(one.answer(one.search.whole(&answer.found)?, answer.search))
    };
    answers.par_iter().map(better).collect()
}

/// Answer of one of the searches.
#[derive(Clone, Copy)]
struct Answer {
    found: Found,
    /// Place of its search in the list.
    search: usize,
    /// Of wind and wake.
    log_likelihood: f64,
}

/// The best answers that are no neighbours, without those that gain much less than the best.
fn apart(mut answers: Vec<Answer>, count: usize) -> Vec<Answer> {
    answers.sort_by(|a, b| b.log_likelihood.total_cmp(&a.log_likelihood));
    let mut kept: Vec<Answer> = Vec::new();
    for one in answers {
        let worse = |best: &Answer| {
            one.log_likelihood < best.log_likelihood - WORSE * best.found.gain.abs()
        };
        let near = |other: &Answer| are_neighbours(&other.found, &one.found);
        if kept.len() < count && !kept.first().is_some_and(worse) && !kept.iter().any(near) {
            kept.push(one);
        }
    }
    kept
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
