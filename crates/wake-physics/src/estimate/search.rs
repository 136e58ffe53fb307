//! Coarse search for speed, heading and place around a sighting: a matched filter of mean images.
//!
//! The logarithm t of the relative change of the mean image by a wake is correlated with the whitened image v at all places at
//! once,
//!
//! ```text
//! v = w Σw² F⁻¹[R/S],     a(p) = Σ v(x) t(x − p),     E = c Σ |F[t]|²/S,     gain = a²/(2E)
//! ```
//!
//! the log-likelihood added by a wake of unknown strength. The first search uses only the part of the wake near the ship: it
//! spans few wavelengths, so the step of the speed may be large. The second uses the whole wake, near the best answers.

use super::noise::Noise;
use super::observed::Observed;
use super::sighting::Sighting;
use super::similar::{Course, Drawn};
use super::torus::Spectrum;
use crate::constants::GRAVITY;
use crate::error::Result;
use crate::raster::{Field, Raster};
use crate::scene::Scene;
use crate::track::direction;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// A wake, and its gain in log-likelihood.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Found {
    pub(super) course: Course,
    /// Midship at the time of the image.
    pub(super) place: [f64; 2],
    /// Log-likelihood that the wake adds, with the prior of the sighting.
    pub(super) gain: f64,
}

/// Range of speeds [m/s], and largest relative step of the speed.
pub(super) const SPEEDS: [f64; 2] = [3.5, 17.0];
const STEP: f64 = 0.03;

/// Relative step between speeds at which a wake is drawn; wakes between them follow by similarity.
pub(super) const DRAWN: f64 = 0.08;

/// Part of the wake used first: transverse waves across a disc, range of its diameter \[m\], and distance of its middle astern of
/// midship over the diameter.
const WAVES: f64 = 18.0;
const NEAR: [f64; 2] = [300.0, 700.0];
const ASTERN: f64 = 0.38;

/// Step of the headings times the length of the wake [deg m].
const TURN: f64 = 1125.0;

/// Radius within which a wake is searched around an answer, in transverse wavelengths.
const WAVES_AWAY: f64 = 1.2;

/// Tolerance of drawn wakes.
const TOLERANCE: f64 = 0.05;

/// Margin around the image on which wakes are drawn \[pixels\].
const MARGIN: usize = 20;

/// Disc of places to search \[m\].
#[derive(Clone, Copy)]
struct Disc {
    middle: [f64; 2],
    radius: f64,
}

/// Whitened image around a sighting.
pub(super) struct Search<'a> {
    observed: &'a Observed,
    sighting: &'a Sighting,
    scene: Scene,
    power: Vec<f32>,
    /// Spectrum of v.
    white: Spectrum,
    /// Intensity of the open sea.
    open: f32,
    image: Raster,
}

impl<'a> Search<'a> {
    /// - `scene`: hull, radar and wind
    pub(super) fn new(
        observed: &'a Observed,
        scene: &Scene,
        noise: &Noise,
        mean: &Field,
        sighting: &'a Sighting,
    ) -> Self {
        let (torus, taper) = (&observed.torus, &observed.taper);
        let power = observed.power(&noise.covariance(1.0));
        let mut ratio = torus.spectrum(&observed.residual(observed.gain(mean) as f32, mean));
        for (value, power) in ratio.iter_mut().zip(&power) {
            *value *= taper.energy as f32 / power;
        }
        let grid = &scene.grid;
        let [field, _] = torus.fields([&ratio, &ratio], [grid.rows, grid.columns]);
        let mut scene = scene.clone();
        scene.model.tolerance = scene.model.tolerance.max(TOLERANCE);
        Self {
            white: torus.spectrum(&taper.of(field.values.into_iter())),
            open: mean.mean() as f32,
            image: Raster::image(grid.rows, grid.columns, grid.spacing),
            scene,
            observed,
            sighting,
            power,
        }
    }

    /// Answers from the part of the wake near the ship, one for each speed and heading.
    pub(super) fn near_ship(&self) -> Result<Vec<Found>> {
        let drawn = ((SPEEDS[1] / SPEEDS[0]).ln() / DRAWN).ceil() as i32;
        let step = (SPEEDS[1] / SPEEDS[0]).ln() / f64::from(drawn);
        let between = |n: i32| {
            let first = SPEEDS[0] * (f64::from(n) * step).exp();
            self.near_between([first, first * step.exp()])
        };
        let found = (0..drawn).into_par_iter().map(between);
        Ok(found.collect::<Result<Vec<_>>>()?.concat())
    }

    /// Answers for speeds between two limits, which follow from one drawn wake.
    fn near_between(&self, speeds: [f64; 2]) -> Result<Vec<Found>> {
        let Sighting {
            heading,
            heading_sd,
            place,
            place_sd,
        } = *self.sighting;
        let around = Disc {
            middle: place,
            radius: Sighting::REACH * place_sd,
        };
        let course = Course {
            speed: (speeds[0] * speeds[1]).sqrt(),
            heading,
        };
        let disc = near(course.speed);
        let turns = (Sighting::REACH * heading_sd * disc / TURN).ceil().max(1.0);
        let turn = Sighting::REACH * heading_sd / turns;
        let step = step(course.speed, disc).min(STEP);
        let count = ((speeds[1] / speeds[0]).ln() / step).ceil() as i32;
        let side = (1.3 * disc / self.scene.grid.spacing).ceil() as usize;
        let mut scene = self.scene.clone();
        (scene.grid.rows, scene.grid.columns) = (side, side);
        let midship = direction(course.heading).map(|v| ASTERN * disc * v);
        let drawn = Drawn::new(&scene, course, midship, self.open)?;
        let changes = |course: Course| {
            let [dx, dy] = direction(course.heading).map(|v| ASTERN * disc * v);
            let weight = move |[x, y]: [f64; 2]| {
                let [x, y] = [x + dx, y + dy].map(|v| v / (0.5 * disc));
                let square = x * x + y * y;
                if square >= 1.0 {
                    return 0.0;
                }
                ((1.0 - square) * (1.0 - square)) as f32
            };
            drawn.moved(&self.image, course, place, weight)
        };
        let best = |n: i32| {
            let part = (f64::from(n) + 0.5) / f64::from(count);
            let speed = speeds[0] * (speeds[1] / speeds[0]).powf(part);
            let headings = (-turns as i32..=turns as i32).map(|m| heading + f64::from(m) * turn);
            let each: Vec<Course> = headings.map(|heading| Course { speed, heading }).collect();
            self.each(&each, around, changes)
        };
        Ok((0..count).flat_map(best).collect())
    }

    /// Best answer with the whole wake near an answer.
    ///
    /// - `anywhere`: search all places of the sighting, not only places around the answer's
    pub(super) fn whole(&self, found: &Found, anywhere: bool) -> Result<Found> {
        let course = found.course;
        let length = self.length(found);
        let finer = length / near(course.speed);
        let by_speed = step(course.speed, length).min(STEP / finer.max(1.0));
        let steps = (2.0 * finer).ceil().clamp(2.0, 4.0) as i32;
        let reach = match anywhere {
            true => Sighting::REACH * self.sighting.place_sd,
            false => WAVES_AWAY * TAU * course.speed.powi(2) / GRAVITY,
        };
        let each = course.around([steps, 2], [by_speed, 0.5 * TURN / length]);
        self.best_around(found, &each, reach)
    }

    /// Best answer with the whole wake near an answer for another wind.
    pub(super) fn beside(&self, found: &Found) -> Result<Found> {
        let course = found.course;
        let length = self.length(found);
        let steps = [0.25 * step(course.speed, length), 0.2 * TURN / length];
        let reach = WAVES_AWAY * TAU * course.speed.powi(2) / GRAVITY;
        self.best_around(found, &course.around([1, 5], steps), reach)
    }

    /// Length of the wake in the image \[m\].
    fn length(&self, found: &Found) -> f64 {
        let forward = direction(found.course.heading);
        let [height, across] =
            [self.image.rows, self.image.columns].map(|n| 0.5 * n as f64 * self.image.spacing);
        let astern = |[sx, sy]: [f64; 2]| {
            let corner = [sx * across - found.place[0], sy * height - found.place[1]];
            -(corner[0] * forward[0] + corner[1] * forward[1])
        };
        let corners = [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]];
        corners.map(astern).into_iter().fold(NEAR[0], f64::max)
    }

    /// Best of several courses near an answer, with the whole wake.
    fn best_around(&self, found: &Found, each: &[Course], reach: f64) -> Result<Found> {
        let Found { course, place, .. } = *found;
        let mut scene = self.scene.clone();
        scene.grid.rows += 2 * MARGIN;
        scene.grid.columns += 2 * MARGIN;
        let drawn = Drawn::new(&scene, course, place, self.open)?;
        let around = Disc {
            middle: place,
            radius: reach,
        };
        let changes = |course| drawn.moved(&self.image, course, place, |_| 1.0);
        let all = each
            .par_chunks(2)
            .filter_map(|pair| self.best(pair, around, changes));
        let best = all.max_by(|a, b| a.gain.total_cmp(&b.gain));
        Ok(best.unwrap_or(*found))
    }

    /// Best of several courses, each at its best place.
    fn best(
        &self,
        courses: &[Course],
        around: Disc,
        change: impl Fn(Course) -> Field,
    ) -> Option<Found> {
        let found = self.each(courses, around, change).into_iter();
        found.max_by(|a, b| a.gain.total_cmp(&b.gain))
    }

    /// Several courses, each at its best place.
    fn each(
        &self,
        courses: &[Course],
        around: Disc,
        change: impl Fn(Course) -> Field,
    ) -> Vec<Found> {
        let found = courses.chunks(2).flat_map(|pair| {
            let changes: Vec<Field> = pair.iter().map(|course| change(*course)).collect();
            self.placed(pair, around, &changes)
        });
        found.collect()
    }

    /// Best places of the changes of one or two courses.
    fn placed(&self, courses: &[Course], around: Disc, changes: &[Field]) -> Vec<Found> {
        let [Some(first), Some(last)] = [changes.first(), changes.last()] else {
            return Vec::new();
        };
        let torus = &self.observed.torus;
        let mut products = torus.spectra([first, last]);
        let energies = [0, 1].map(|n| self.energy(&products[n]));
        for product in &mut products {
            for (value, white) in product.iter_mut().zip(&self.white) {
                *value = white * value.conj();
            }
        }
        let maps = torus.fields([&products[0], &products[1]], [torus.size; 2]);
        let each = courses.iter().zip(&maps).zip(energies);
        each.map(|((course, map), energy)| self.peak(*course, around, map, energy))
            .collect()
    }

    /// Answer at the highest gain in a map of places.
    fn peak(&self, course: Course, around: Disc, map: &Field, energy: f64) -> Found {
        let place = around.middle;
        let spacing = self.image.spacing;
        let size = map.rows as i64;
        let pixels = ((around.radius / spacing).floor() as i64).min(size / 2 - 2);
        let turned = (course.heading - self.sighting.heading) / self.sighting.heading_sd;
        let fitted = |down: i64, right: i64| {
            let [i, j] = [down, right].map(|n| n.rem_euclid(size) as usize);
            0.5 * f64::from(map.at(i, j)).max(0.0).powi(2) / energy.max(1e-9)
        };
        let moved = |down: f64, right: f64| [place[0] + right * spacing, place[1] - down * spacing];
        let mut best = ([0, 0], f64::NEG_INFINITY);
        for down in -pixels..=pixels {
            for right in -pixels..=pixels {
                let there = moved(down as f64, right as f64);
                let off =
                    [0, 1].map(|n| (there[n] - self.sighting.place[n]) / self.sighting.place_sd);
                let prior = 0.5 * (off[0] * off[0] + off[1] * off[1] + turned * turned);
                let gain = fitted(down, right) - prior;
                if gain > best.1 {
                    best = ([down, right], gain);
                }
            }
        }
        let ([down, right], gain) = best;
        let here = fitted(down, right);
        let top = |before: f64, after: f64| {
            let bend = before - 2.0 * here + after;
            if bend < 0.0 {
                (0.5 * (before - after) / bend).clamp(-0.5, 0.5)
            } else {
                0.0
            }
        };
        let place = moved(
            down as f64 + top(fitted(down - 1, right), fitted(down + 1, right)),
            right as f64 + top(fitted(down, right - 1), fitted(down, right + 1)),
        );
        Found {
            course,
            place,
            gain,
        }
    }

    /// Energy E of a change.
    fn energy(&self, spectrum: &Spectrum) -> f64 {
        let torus = &self.observed.torus;
        let terms = spectrum.iter().zip(&self.power).enumerate();
        let sum: f64 = terms
            .map(|(n, (value, power))| torus.weight(n) * f64::from(value.norm_sqr() / power))
            .sum();
        sum * self.observed.taper.energy / (torus.size * torus.size) as f64
    }
}

/// Diameter of the disc near the ship \[m\].
fn near(speed: f64) -> f64 {
    (WAVES * TAU * speed * speed / GRAVITY).clamp(NEAR[0], NEAR[1])
}

/// Relative step of the speed for a wake of a length: the phase at its ends is off by 2π/5 halfway between two steps.
fn step(speed: f64, length: f64) -> f64 {
    TAU * speed * speed / (2.5 * GRAVITY * length)
}

/// True for two answers closer than 1.5 steps of the speed and half a transverse wave.
pub(super) fn are_neighbours(a: &Found, b: &Found) -> bool {
    let speed = a.course.speed;
    let apart = (b.place[0] - a.place[0]).hypot(b.place[1] - a.place[1]);
    (b.course.speed / speed).ln().abs() < 1.5 * step(speed, near(speed)).min(STEP)
        && apart < 0.5 * TAU * speed * speed / GRAVITY
}
