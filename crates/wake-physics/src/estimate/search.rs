//! Coarse search for speed, heading and place around a sighting: a matched filter of mean images.
//!
//! The relative changes t of the mean image by waves (1) and by the turbulent wake (2) are correlated with the whitened image v at all places at once,
//!
//! ```text
//! v = w Σw² F⁻¹[R/S],     aₙ(p) = Σ v(x) tₙ(x − p),     Eₙₘ = c Σ Re F[w tₙ] F[w tₘ]*/S,     gain = ½ aᵀ E⁻¹ a
//! ```
//!
//! the log-likelihood that both add with unknown strengths: a dark line says nothing of the speed, and must not outweigh the waves. First only the part of the wake near the ship counts: there it has few wavelengths,
//! so a step of the speed may be large. Then the whole wake counts, near the best answers.

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

/// A wake, and how much more likely it makes the image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Found {
    pub(super) course: Course,
    /// Midship at the time of the image.
    pub(super) place: [f64; 2],
    /// Log-likelihood that it adds.
    pub(super) gain: f64,
}

/// Range of the speeds [m/s], and the largest relative step.
const SPEEDS: [f64; 2] = [3.5, 17.0];
const STEP: f64 = 0.03;

/// Relative step of the speeds at which a wake is drawn; those between follow by similarity.
const DRAWN: f64 = 0.08;

/// Part of the wake that counts first: diameter of a disc \[m\], and its middle astern of midship over the diameter.
const NEAR: f64 = 450.0;
const ASTERN: f64 = 0.38;

/// Step of the headings for the part near the ship, and headings beside a line \[deg\].
const TURN: f64 = 1.5;
const ASIDE: f64 = 0.6;

/// Tolerance of drawn wakes.
const TOLERANCE: f64 = 0.05;

/// Pixels around the image that wakes are drawn on.
const MARGIN: usize = 20;

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
        (scene, noise, mean): (&Scene, &Noise, &Field),
        sighting: &'a Sighting,
    ) -> Self {
        let (torus, taper) = (&observed.torus, &observed.taper);
        let gain = observed.gain(mean) as f32;
        let scaled = Field {
            values: mean.values.iter().map(|v| gain * v).collect(),
            ..*mean
        };
        let power = observed.power(noise);
        let mut ratio = torus.spectrum(&observed.residual(&scaled));
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

    /// Best answer of few speeds, by the part of the wake near the ship: its line shows the heading.
    pub(super) fn line(&self) -> Result<Option<Found>> {
        let Sighting {
            heading,
            heading_sd,
            place,
            place_sd,
        } = *self.sighting;
        let steps = (Sighting::REACH * heading_sd / TURN).ceil();
        let step = Sighting::REACH * heading_sd / steps;
        let off = (-steps as i32..=steps as i32).map(|n| f64::from(n) * step);
        let headings: Vec<f64> = off.map(|off| heading + off).collect();
        let found = self.near(&headings, (place, Sighting::REACH * place_sd), both, |_| 1)?;
        Ok(found.into_iter().max_by(|a, b| a.gain.total_cmp(&b.gain)))
    }

    /// Answers of all speeds near the line of another answer, one for each speed.
    pub(super) fn along(&self, line: &Found) -> Result<Vec<Found>> {
        let headings = [-ASIDE, 0.0, ASIDE].map(|off| line.course.heading + off);
        let reach = 0.5 * Sighting::REACH * self.sighting.place_sd;
        self.near(&headings, (line.place, reach), of_waves, |speeds| {
            let middle = (speeds[0] * speeds[1]).sqrt();
            ((speeds[1] / speeds[0]).ln() / step(middle, NEAR).min(STEP)).ceil() as i32
        })
    }

    /// Best answers of the part of the wake near the ship, one for each speed.
    ///
    /// - `around`: place and distance from it that is searched
    /// - `count`: number of speeds between two, which follow from one drawn wake
    fn near(
        &self,
        headings: &[f64],
        around: ([f64; 2], f64),
        by: Gain,
        count: impl Fn([f64; 2]) -> i32 + Sync,
    ) -> Result<Vec<Found>> {
        let drawn = ((SPEEDS[1] / SPEEDS[0]).ln() / DRAWN).ceil() as i32;
        let step = (SPEEDS[1] / SPEEDS[0]).ln() / f64::from(drawn);
        let between = |n: i32| {
            let first = SPEEDS[0] * (f64::from(n) * step).exp();
            let speeds = [first, first * step.exp()];
            self.near_between(speeds, count(speeds), (headings, by), around)
        };
        let found = (0..drawn).into_par_iter().map(between);
        Ok(found.collect::<Result<Vec<_>>>()?.concat())
    }

    fn near_between(
        &self,
        speeds: [f64; 2],
        count: i32,
        (headings, by): (&[f64], Gain),
        around: ([f64; 2], f64),
    ) -> Result<Vec<Found>> {
        let course = Course {
            speed: (speeds[0] * speeds[1]).sqrt(),
            heading: headings[headings.len() / 2],
        };
        let side = (1.3 * NEAR / self.scene.grid.spacing).ceil() as usize;
        let mut scene = self.scene.clone();
        (scene.grid.rows, scene.grid.columns) = (side, side);
        let midship = direction(course.heading).map(|v| ASTERN * NEAR * v);
        let drawn = Drawn::new(&scene, course, midship, self.open)?;
        let changes = |course: Course| {
            let [dx, dy] = direction(course.heading).map(|v| ASTERN * NEAR * v);
            let disc = move |[x, y]: [f64; 2]| {
                let [x, y] = [x + dx, y + dy].map(|v| v / (0.5 * NEAR));
                let square = x * x + y * y;
                if square >= 1.0 {
                    return 0.0;
                }
                ((1.0 - square) * (1.0 - square)) as f32
            };
            drawn.moved(&self.image, (course, around.0), disc)
        };
        let best = |n: i32| {
            let part = (f64::from(n) + 0.5) / f64::from(count);
            let speed = speeds[0] * (speeds[1] / speeds[0]).powf(part);
            let each = headings.iter().map(|&heading| {
                let course = Course { speed, heading };
                self.placed((course, by), around, changes(course))
            });
            each.max_by(|a, b| a.gain.total_cmp(&b.gain))
        };
        Ok((0..count).filter_map(best).collect())
    }

    /// Best answer of the whole wake near an answer.
    pub(super) fn whole(&self, found: &Found) -> Result<Found> {
        let Found { course, place, .. } = *found;
        let mut scene = self.scene.clone();
        scene.grid.rows += 2 * MARGIN;
        scene.grid.columns += 2 * MARGIN;
        let drawn = Drawn::new(&scene, course, place, self.open)?;
        let forward = direction(course.heading);
        let [height, across] =
            [self.image.rows, self.image.columns].map(|n| 0.5 * n as f64 * self.image.spacing);
        let astern = |[sx, sy]: [f64; 2]| {
            let corner = [sx * across - place[0], sy * height - place[1]];
            -(corner[0] * forward[0] + corner[1] * forward[1])
        };
        let corners = [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]];
        let length = corners.map(astern).into_iter().fold(NEAR, f64::max);
        let finer = length / NEAR;
        let speed_step = step(course.speed, length).min(STEP / finer);
        let turn = TURN / finer;
        let steps = finer.ceil() as i32;
        let each: Vec<Course> = (-steps..=steps)
            .flat_map(|n| {
                (-2..=2).map(move |m| Course {
                    speed: course.speed * (f64::from(n) * speed_step).exp(),
                    heading: course.heading + 0.5 * f64::from(m) * turn,
                })
            })
            .collect();
        let fields = |course: &Course| drawn.moved(&self.image, (*course, place), |_| 1.0);
        let reach = TAU * course.speed.powi(2) / GRAVITY;
        let all = each
            .par_iter()
            .map(|course| self.placed((*course, both), (place, 1.2 * reach), fields(course)));
        let best = all.max_by(|a, b| a.gain.total_cmp(&b.gain));
        Ok(best.unwrap_or(*found))
    }

    /// Best place of the changes of a course.
    fn placed(
        &self,
        course: (Course, Gain),
        around: ([f64; 2], f64),
        changes: [Field; 2],
    ) -> Found {
        let torus = &self.observed.torus;
        let windowed = changes.each_ref();
        let windowed = windowed.map(|c| self.observed.taper.of(c.values.iter().copied()));
        let energy = self.energy(&torus.spectra([&windowed[0], &windowed[1]]));
        let mut products = torus.spectra([&changes[0], &changes[1]]);
        for product in &mut products {
            for (value, white) in product.iter_mut().zip(&self.white) {
                *value = white * value.conj();
            }
        }
        let maps = torus.fields([&products[0], &products[1]], [torus.size; 2]);
        self.peak(course, around, (&maps, energy))
    }

    /// Highest gain of the maps of places.
    ///
    /// - `place` and distance from it that is searched
    fn peak(
        &self,
        (course, by): (Course, Gain),
        (place, reach): ([f64; 2], f64),
        (maps, energy): (&[Field; 2], [f64; 3]),
    ) -> Found {
        let spacing = self.image.spacing;
        let size = maps[0].rows as i64;
        let pixels = ((reach / spacing).floor() as i64).min(size / 2 - 2);
        let turned = (course.heading - self.sighting.heading) / self.sighting.heading_sd;
        let fitted = |down: i64, right: i64| {
            let [i, j] = [down, right].map(|n| n.rem_euclid(size) as usize);
            by(maps.each_ref().map(|map| f64::from(map.at(i, j))), energy)
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

    /// E₁₁, E₁₂ and E₂₂ of changes in the window.
    fn energy(&self, windowed: &[Spectrum; 2]) -> [f64; 3] {
        let torus = &self.observed.torus;
        let [waves, rest] = windowed;
        let mut sums = [0.0; 3];
        for (n, ((waves, rest), power)) in waves.iter().zip(rest).zip(&self.power).enumerate() {
            let products = [waves.norm_sqr(), (waves * rest.conj()).re, rest.norm_sqr()];
            for (sum, product) in sums.iter_mut().zip(products) {
                *sum += torus.weight(n) * f64::from(product / power);
            }
        }
        sums.map(|sum| sum * self.observed.taper.energy / (torus.size * torus.size) as f64)
    }
}

/// Log-likelihood that answers a of two changes of energies E add.
type Gain = fn([f64; 2], [f64; 3]) -> f64;

/// Log-likelihood that the first change adds to the second.
fn of_waves([a, b]: [f64; 2], [aa, ab, bb]: [f64; 3]) -> f64 {
    let (answer, energy) = match bb > 0.0 {
        true => (a - ab / bb * b, aa - ab * ab / bb),
        false => (a, aa),
    };
    0.5 * answer.max(0.0).powi(2) / energy.max(1e-6 * aa).max(1e-9)
}

/// Log-likelihood that two changes add with the best strengths, none below 0.
fn both([a, b]: [f64; 2], [aa, ab, bb]: [f64; 3]) -> f64 {
    let determinant = aa * bb - ab * ab;
    if determinant > 1e-6 * aa * bb {
        let [first, second] = [a * bb - b * ab, b * aa - a * ab];
        if first >= 0.0 && second >= 0.0 {
            return 0.5 * (a * first + b * second) / determinant;
        }
    }
    let alone = |a: f64, aa: f64| 0.5 * a.max(0.0).powi(2) / aa.max(1e-9);
    alone(a, aa).max(alone(b, bb))
}

/// Relative step of the speed for a wake of a length: the phase at its ends is off by 2π/5 halfway between two steps.
fn step(speed: f64, length: f64) -> f64 {
    TAU * speed * speed / (2.5 * GRAVITY * length)
}

/// Whether the speeds of two answers are neighbours in the search.
pub(super) fn are_neighbours(a: &Found, b: &Found) -> bool {
    let speed = a.course.speed;
    (b.course.speed / speed).ln().abs() < 1.5 * step(speed, NEAR).min(STEP)
}
