//! Starts of the fit: winds from the texture, ships from a bank of matched filters.
//!
//! A filter is the relative change T of the mean image by a ship. With whitened image r̃ and filter T̃, the answer over all places p
//! and the likelihood ratio of a wake of the best strength are two Fourier sums,
//!
//! ```text
//! a(p) = Σ_x r̃(x) T̃(x − p),     e(p) = Σ_x w²(x) T̃²(x − p),     ln Λ = max_s (s a − s² e/2)
//! ```
//!
//! with strengths s from 0.4 to 2.5 of the wake of the filter's ship.

use super::noise::{Noise, Taper};
use super::observed::Observed;
use super::part::Part;
use super::torus::{Spectrum, Torus};
use crate::error::Result;
use crate::measure::{self, angle_between, axis_between};
use crate::raster::{Field, Raster};
use crate::scene::Scene;
use crate::simulate::Simulator;
use rayon::prelude::*;

/// A wind that may be that of the image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Wind {
    pub(super) speed: f64,
    pub(super) toward: f64,
    /// ln likelihood of the texture.
    pub(super) log_likelihood: f64,
}

/// Winds that are tried: step of the direction \[deg\], slowest [m/s], ratio of neighbours, and their number.
const WIND_STEP: f64 = 30.0;
const SLOWEST: f64 = 2.5;
const STRONGER: f64 = 1.12;
const STRENGTHS_OF_WIND: i32 = 13;
/// Brightness \[dB\] by which a wind may differ from the image, and its deviation.
const BRIGHTNESS: [f64; 2] = [0.6, 0.2];
/// Side of the parts whose spectra are compared [pixels], and how many of the least rough are.
const WIND_SIDE: usize = 128;
const WIND_PARTS: usize = 2;

/// Winds by the likelihood of brightness and texture, the best first; without a calibration by the texture alone.
pub(super) fn winds(whole: &Part, calibrated: bool) -> Result<Vec<Wind>> {
    let parts = calm(whole);
    let Some(first) = parts.first() else {
        return Ok(Vec::new());
    };
    let view = Observed::new(first.image.clone(), &first.scene, |_, _| 1.0);
    let grid = &first.scene.grid;
    let raster = Raster::image(grid.rows, grid.columns, grid.spacing);
    let left = |part: &Part| {
        let mean = Field::constant(&raster, part.image.mean() as f32);
        let pairs = part.image.values.iter().zip(&mean.values);
        view.torus
            .spectrum(&view.taper.of(pairs.map(|(i, m)| i / m - 1.0)))
    };
    let left: Vec<Spectrum> = parts.iter().map(left).collect();
    let bright = f64::from(measure::median(&whole.coarser(8).image.values));
    let with = |speed: f64, toward: f64| {
        let mut there = first.scene.clone();
        (there.sea.wind_speed, there.sea.wind_toward) = (speed, toward);
        there
    };
    let speeds: Vec<f64> = (0..STRENGTHS_OF_WIND)
        .map(|n| SLOWEST * STRONGER.powi(n))
        .collect();
    // Brightness depends on the angle to the look direction alone.
    let off = |&speed: &f64| -> Result<Vec<f64>> {
        let at = |n: i32| -> Result<f64> {
            let there = with(speed, 90.0 - WIND_STEP * f64::from(n));
            Ok(10.0 * (bright / measure::mean_sigma0(&there)?).log10())
        };
        (0..4).map(at).collect()
    };
    let off: Vec<Vec<f64>> = match calibrated {
        true => speeds.par_iter().map(off).collect::<Result<_>>()?,
        false => vec![vec![0.0; 4]; speeds.len()],
    };
    let mut tried: Vec<([f64; 2], f64)> = Vec::new();
    for n in 0..(360.0 / WIND_STEP) as usize {
        let toward = WIND_STEP * n as f64;
        let at = ((axis_between(toward, 90.0).abs() / WIND_STEP).round() as usize).min(3);
        let pairs = speeds.iter().zip(&off);
        tried.extend(pairs.map(|(&speed, off)| ([speed, toward], off[at])));
    }
    let nearest = tried
        .iter()
        .map(|t| t.1.abs())
        .fold(f64::INFINITY, f64::min);
    tried.retain(|t| t.1.abs() < nearest.max(BRIGHTNESS[0]));
    let wind = |&([speed, toward], off): &([f64; 2], f64)| -> Result<Wind> {
        let power = view.power(&Noise::new(&with(speed, toward))?);
        let term = |n: usize| {
            let power = f64::from(power[n]);
            let squares: f64 = left.iter().map(|l| f64::from(l[n].norm_sqr())).sum();
            view.torus.weight(n) * (squares / power + left.len() as f64 * power.ln())
        };
        let area = (view.torus.size * view.torus.size) as f64;
        let sum: f64 = (0..power.len()).map(term).sum();
        Ok(Wind {
            speed,
            toward,
            log_likelihood: -0.5 * (view.taper.energy / area * sum + (off / BRIGHTNESS[1]).powi(2)),
        })
    };
    let mut winds = tried.par_iter().map(wind).collect::<Result<Vec<Wind>>>()?;
    winds.sort_by(|a, b| b.log_likelihood.total_cmp(&a.log_likelihood));
    Ok(winds)
}

/// Quarters of an image or less, the least rough first.
pub(super) fn calm(whole: &Part) -> Vec<Part> {
    let grid = &whole.scene.grid;
    let side = WIND_SIDE.min(grid.rows).min(grid.columns);
    let places =
        |all: usize| [0.0, 1.0].map(|end| (end - 0.5) * (all - side) as f64 * grid.spacing);
    let mut parts: Vec<(f64, Part)> = Vec::new();
    for y in places(grid.rows) {
        for x in places(grid.columns) {
            let part = whole.around([x, y], side);
            let mean = part.image.mean();
            let square = part
                .coarser(2)
                .image
                .values
                .iter()
                .map(|v| (f64::from(*v) / mean - 1.0).powi(2))
                .sum();
            parts.push((square, part));
        }
    }
    parts.sort_by(|a, b| a.0.total_cmp(&b.0));
    parts.into_iter().take(WIND_PARTS).map(|p| p.1).collect()
}

/// A ship that may have made the wake.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Candidate {
    pub(super) speed: f64,
    pub(super) heading: f64,
    pub(super) position: [f64; 2],
    /// ln Λ.
    pub(super) score: f64,
}

/// Strengths of a wake that are allowed, relative to that of the ship of the scene.
const STRENGTHS: [f64; 2] = [0.4, 2.5];

/// The filters of one image.
pub(super) struct Bank<'a> {
    part: &'a Part,
    torus: Torus,
    /// 1/√S on the torus.
    whitening: Vec<f32>,
    /// Spectra of the whitened image and of the squared window.
    image: Spectrum,
    window: Spectrum,
}

impl<'a> Bank<'a> {
    /// - `part`: with the wind of the image, and a ship of the size of the filters
    pub(super) fn new(part: &'a Part) -> Result<Self> {
        let grid = &part.scene.grid;
        let side = grid.rows.max(grid.columns);
        let noise = Noise::new(&part.scene)?;
        // Twice the image, so that shifted filters do not come back on the other side.
        let torus = Torus::new(crate::fft::fast_length(2 * side).max(noise.size));
        let size = torus.size;
        // Nearest wavenumbers of the smaller torus of the noise.
        let small = Torus::new(noise.size).spectrum(&noise.covariance(1.0));
        let nearest = |n: usize| -> usize {
            let signed = if 2 * n > size {
                n as f64 - size as f64
            } else {
                n as f64
            };
            let there = (signed * noise.size as f64 / size as f64).round() as i64;
            there.rem_euclid(noise.size as i64) as usize
        };
        let power: Vec<f32> = (0..torus.half())
            .map(|n| {
                let (i, j) = (nearest(n / size).min(noise.size / 2), nearest(n % size));
                small[i * noise.size + j].re
            })
            .collect();
        let floor = 1e-4 * power.iter().copied().fold(0.0, f32::max);
        let taper = Taper::new(&torus, [grid.rows, grid.columns], |_, _| 1.0);
        let mean = part.image.mean() as f32;
        let relative = taper.of(part.image.values.iter().map(|v| v / mean - 1.0));
        let whitening: Vec<f32> = power.iter().map(|p| p.max(floor).sqrt().recip()).collect();
        let mut image = torus.spectrum(&relative);
        for (value, w) in image.iter_mut().zip(&whitening) {
            *value *= *w;
        }
        let squared = Field {
            values: taper.weights.values.iter().map(|w| w * w).collect(),
            ..taper.weights
        };
        Ok(Self {
            window: torus.spectrum(&squared),
            part,
            torus,
            whitening,
            image,
        })
    }

    /// The relative change of the mean image by a ship in its middle.
    fn filter(&self, simulator: &mut Simulator, speed: f64, heading: f64) -> Result<Field> {
        let mut scene: Scene = self.part.scene.clone();
        if let Some(ship) = scene.ships.first_mut() {
            (ship.speed, ship.heading, ship.position) = (speed, heading, [0.0; 2]);
        }
        let mean = simulator.expected_intensity(&scene)?;
        // Most of the image is open sea.
        let sea = measure::median(&mean.values);
        Ok(Field {
            values: mean.values.iter().map(|v| v / sea - 1.0).collect(),
            ..mean
        })
    }

    /// The best place of a ship within a distance \[m\] of a place.
    fn answer(
        &self,
        filter: &Field,
        [speed, heading]: [f64; 2],
        (near, within): ([f64; 2], f64),
    ) -> Candidate {
        let torus = &self.torus;
        let mut spectrum = torus.spectrum(filter);
        for (value, w) in spectrum.iter_mut().zip(&self.whitening) {
            *value *= *w;
        }
        let size = torus.size;
        let [mut whitened, _] = torus.fields([&spectrum, &spectrum], [size, size]);
        whitened.values.iter_mut().for_each(|v| *v *= *v);
        let squared = torus.spectrum(&whitened);
        let product = |a: &Spectrum, b: &Spectrum| -> Spectrum {
            a.iter().zip(b).map(|(a, b)| a.conj() * b).collect()
        };
        let answers = product(&spectrum, &self.image);
        let energies = product(&squared, &self.window);
        let [answers, energies] = torus.fields([&answers, &energies], [size, size]);
        let spacing = self.part.scene.grid.spacing;
        let grid = &self.part.scene.grid;
        let (down, right) = ((grid.rows / 2) as i64, (grid.columns / 2) as i64);
        let mut best = Candidate {
            speed,
            heading,
            position: near,
            score: f64::NEG_INFINITY,
        };
        for i in -down..(grid.rows as i64 - down) {
            for j in -right..(grid.columns as i64 - right) {
                let place = [j as f64 * spacing, -i as f64 * spacing];
                if (place[0] - near[0]).hypot(place[1] - near[1]) > within.max(0.75 * spacing) {
                    continue;
                }
                let at =
                    i.rem_euclid(size as i64) as usize * size + j.rem_euclid(size as i64) as usize;
                let (a, e) = (
                    f64::from(answers.values[at]),
                    f64::from(energies.values[at]),
                );
                let strength = (a / e.max(1e-9)).clamp(STRENGTHS[0], STRENGTHS[1]);
                let score = strength * a - 0.5 * strength * strength * e;
                if score > best.score {
                    best = Candidate {
                        position: place,
                        score,
                        ..best
                    };
                }
            }
        }
        best
    }

    /// The best place of each of some ships [speed, heading].
    pub(super) fn answers(
        &self,
        ships: &[[f64; 2]],
        near: ([f64; 2], f64),
    ) -> Result<Vec<Candidate>> {
        let one = |simulator: &mut Simulator, ship: &[f64; 2]| -> Result<Candidate> {
            let filter = self.filter(simulator, ship[0], ship[1])?;
            Ok(self.answer(&filter, *ship, near))
        };
        let ships = ships.par_iter().with_min_len(8);
        ships.map_init(Simulator::default, one).collect()
    }
}

/// Pixel \[m\], speeds [m/s] and step of the headings \[deg\] of the first bank.
const FIRST: f64 = 16.0;
const SPEEDS: [f64; 4] = [5.5, 7.5, 10.0, 13.5];
const TURN: f64 = 8.0;
/// Pixel \[m\] of the second bank, headings and relative speeds around the best of the first: modes of the speed are narrow.
const SECOND: f64 = 8.0;
const TURNS: [f64; 6] = [-12.0, -8.0, -4.0, 0.0, 4.0, 8.0];
const RATIO: f64 = 1.05;
const RATIOS: i32 = 6;
/// Candidates of it that are followed, with steps of speed and heading.
const FOLLOWED: usize = 3;
const CLOSER: [(f64, f64); 1] = [(0.025, 2.0)];

/// Ships that may have made the wake, the best first.
///
/// - `place`: (x, y) \[m\] of midship to within a distance \[m\]; `heading`: to within 15°, if known
pub(super) fn ships(
    whole: &Part,
    (place, within): ([f64; 2], f64),
    heading: Option<f64>,
) -> Result<Vec<Candidate>> {
    let near = |h: &f64| heading.is_none_or(|known| angle_between(*h, known).abs() < 15.0);
    let headings = (0..(360.0 / TURN) as usize)
        .map(|n| TURN * n as f64)
        .filter(near);
    let ships: Vec<[f64; 2]> = headings
        .flat_map(|h| SPEEDS.map(|speed| [speed, h]))
        .collect();
    let found = answers(&level(whole, FIRST), &ships, (place, within))?;
    let Some(best) = apart(found, 1, TURN).first().copied() else {
        return Ok(Vec::new());
    };
    let mut ships = Vec::new();
    for n in -RATIOS..=RATIOS {
        let speed = best.speed * RATIO.powi(n);
        ships.extend(TURNS.map(|turn| [speed, best.heading + turn]));
    }
    let second = level(whole, SECOND);
    let reach = within.min(100.0);
    let centre = if within < 100.0 { place } else { best.position };
    let mut kept = apart(answers(&second, &ships, (centre, reach))?, FOLLOWED, 3.0);
    for (part, turn) in CLOSER {
        let mut all = kept.clone();
        for candidate in &kept {
            let mut ships = Vec::new();
            for d in [-part, 0.0, part] {
                let speed = candidate.speed * (1.0 + d);
                ships.extend([-turn, 0.0, turn].map(|h| [speed, candidate.heading + h]));
            }
            all.extend(answers(&second, &ships, (candidate.position, 40.0))?);
        }
        kept = apart(all, FOLLOWED, 1.0);
    }
    Ok(kept)
}

/// An image with pixels of about a size \[m\], or its own if they are larger.
fn level(whole: &Part, spacing: f64) -> Part {
    whole.coarser((spacing / whole.scene.grid.spacing).floor().max(1.0) as usize)
}

/// Answers of ships in a coarser image, at places of the whole.
fn answers(
    part: &Part,
    ships: &[[f64; 2]],
    (place, within): ([f64; 2], f64),
) -> Result<Vec<Candidate>> {
    let mut found = Bank::new(part)?.answers(ships, (part.from_whole(place), within))?;
    for candidate in &mut found {
        candidate.position = part.to_whole(candidate.position);
    }
    Ok(found)
}

/// Winds that are no neighbours of better ones.
pub(super) fn apart_winds(winds: &[Wind], count: usize) -> Vec<Wind> {
    let mut kept: Vec<Wind> = Vec::new();
    for wind in winds {
        let like = |other: &Wind| angle_between(wind.toward, other.toward).abs() < 50.0;
        if kept.len() < count && !kept.iter().any(like) {
            kept.push(*wind);
        }
    }
    kept
}

/// The best of some ships, none like a better one.
fn apart(mut found: Vec<Candidate>, count: usize, turn: f64) -> Vec<Candidate> {
    found.sort_by(|a, b| b.score.total_cmp(&a.score));
    let mut kept: Vec<Candidate> = Vec::new();
    for candidate in found {
        let like = |other: &Candidate| {
            (candidate.speed / other.speed - 1.0).abs() < 0.02
                && angle_between(candidate.heading, other.heading).abs() < turn
        };
        if kept.len() < count && !kept.iter().any(like) {
            kept.push(candidate);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::expected_intensity;

    /// The answer to a mean image is largest where its ship is, and that of the opposite heading is less.
    #[test]
    fn a_filter_finds_the_place_of_a_ship() {
        let keys = [
            "grid.rows=64",
            "grid.columns=64",
            "grid.spacing=8",
            "grid.oversampling=1",
            "ship.heading=60",
            "ship.speed=9",
            "ship.position=[48, -32]",
        ];
        let scene = Scene::default().with_assignments(&keys).unwrap();
        let part = Part::whole(&expected_intensity(&scene).unwrap(), &scene);
        let bank = Bank::new(&part).unwrap();
        let near = ([0.0; 2], 100.0);
        let found = bank.answers(&[[9.0, 60.0], [9.0, 240.0]], near).unwrap();
        let [x, y] = found[0].position;
        assert!((x - 48.0).hypot(y + 32.0) < 8.0, "{found:?}");
        assert!(found[0].score > 3.0 * found[1].score.max(1.0), "{found:?}");
    }

    /// Of neighbours the better one stays.
    #[test]
    fn ships_apart_are_no_neighbours() {
        let ship = |speed: f64, heading: f64, score: f64| Candidate {
            speed,
            heading,
            position: [0.0; 2],
            score,
        };
        let all = vec![
            ship(8.0, 1.0, 1.0),
            ship(8.1, 359.0, 3.0),
            ship(8.0, 180.0, 2.0),
        ];
        let kept = apart(all, 3, 4.0);
        let headings: Vec<f64> = kept.iter().map(|k| k.heading).collect();
        assert_eq!(headings, [359.0, 180.0]);
    }
}
