//! Starts for the fit: wind from the open sea, ship from arms, ridge and a bank of matched filters.
//!
//! A filter is the wake to first order: every wave times its modulation transfer function. Its answer over all places of the
//! ship is one Fourier sum,
//!
//! ```text
//! a(p) = c Σ T̄ R/S e^{ik·p},     e = c Σ |T|²/S,     score a²/e
//! ```

use super::likelihood::Observed;
use super::noise::Noise;
use super::options::Detection;
use super::torus::Spectrum;
use crate::error::Result;
use crate::kelvin::fade_at;
use crate::linear::OpenSea;
use crate::measure::{self, ShipPlace};
use crate::models::{Models, kelvin_wake};
use crate::nufft;
use crate::raster::{Field, Raster};
use crate::scattering::modulation::smear;
use crate::scene::Scene;
use crate::workspace::Workspace;
use rayon::prelude::*;

/// Directions of the wind that are tried \[deg\].
const WIND_STEP: f64 = 30.0;

/// Speeds tried around one, relative, and headings \[deg\]: as far apart as waves half a kilometre astern fall out of step.
const SPEEDS: [f64; 9] = [-0.08, -0.06, -0.04, -0.02, 0.0, 0.02, 0.04, 0.06, 0.08];
const HEADINGS: [f64; 7] = [-4.5, -3.0, -1.5, 0.0, 1.5, 3.0, 4.5];

/// Tolerance of the waves of a filter.
const COARSE: f64 = 0.03;

/// A wind that may be that of the image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Wind {
    pub(super) speed: f64,
    pub(super) toward: f64,
    /// ln likelihood of the texture.
    pub(super) log_likelihood: f64,
}

/// Winds by the likelihood of the texture, the best first; each as strong as the image is bright in its direction.
pub(super) fn winds(observed: &Observed, scene: &Scene, calibrated: bool) -> Result<Vec<Wind>> {
    let spacing = scene.grid.spacing;
    let raster = Raster::image(observed.image.rows, observed.image.columns, spacing);
    let sea = measure::open_sea(&observed.image, &raster, None);
    let mean = observed.mean();
    let residual = observed.residual(&Field::constant(&raster, mean as f32));
    let left = observed.torus.spectrum(&residual);
    let strengths = |toward: f64| -> Result<Vec<f64>> {
        let mut there = scene.clone();
        there.sea.wind_toward = toward;
        let found = match (&sea, calibrated) {
            (Some(sea), true) => measure::wind_speed(sea, &there)?.value,
            _ => f64::NAN,
        };
        Ok(match found.is_finite() {
            true => vec![found],
            false => vec![3.0, 5.0, 8.0],
        })
    };
    // Brightness depends on the angle to the look direction alone.
    let angles: Vec<f64> = (0..4).map(|n| 30.0 * f64::from(n)).collect();
    let by_angle: Vec<Vec<f64>> = angles
        .par_iter()
        .map(|angle| strengths(90.0 - angle))
        .collect::<Result<_>>()?;
    let mut tried: Vec<[f64; 2]> = Vec::new();
    for n in 0..(360.0 / WIND_STEP) as usize {
        let toward = WIND_STEP * n as f64;
        let off = measure::axis_between(toward, 90.0).abs();
        let at = (off / 30.0).round() as usize;
        tried.extend(by_angle[at.min(3)].iter().map(|&speed| [speed, toward]));
    }
    let wind = |&[speed, toward]: &[f64; 2]| -> Result<Wind> {
        let mut there = scene.clone();
        (there.sea.wind_speed, there.sea.wind_toward) = (speed, toward);
        let noise = Noise::new(&there)?;
        Ok(Wind {
            speed,
            toward,
            log_likelihood: observed.texture_likelihood(&left, &noise),
        })
    };
    let mut winds = tried.par_iter().map(wind).collect::<Result<Vec<Wind>>>()?;
    winds.sort_by(|a, b| b.log_likelihood.total_cmp(&a.log_likelihood));
    Ok(winds)
}

/// A ship that may have made the wake.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Start {
    pub(super) speed: f64,
    pub(super) heading: f64,
    pub(super) position: [f64; 2],
    /// Squared answer of the filter over its noise.
    pub(super) score: f64,
}

/// The filters of one image.
pub(super) struct Filters<'a> {
    pub(super) observed: &'a Observed,
    pub(super) scene: Scene,
    models: Models,
    open: OpenSea,
    power: Vec<f32>,
    left: Spectrum,
    raster: Raster,
}

impl<'a> Filters<'a> {
    /// - `scene`: with the wind of the image, and a ship whose size the filters have
    pub(super) fn new(observed: &'a Observed, scene: &Scene) -> Result<Self> {
        let models = Models::new(scene);
        let open = OpenSea::new(&models);
        let models = open.averaged(&models);
        let noise = Noise::new(scene)?;
        let raster = models.pixels.image;
        let mean = observed.mean();
        let residual = observed.residual(&Field::constant(&raster, mean as f32));
        Ok(Self {
            power: observed.power(&noise),
            left: observed.torus.spectrum(&residual),
            scene: scene.clone(),
            models,
            open,
            raster,
            observed,
        })
    }

    /// The relative intensity of a wake to first order, its ship at a place.
    fn wake(&self, speed: f64, heading: f64, position: [f64; 2]) -> Field {
        let mut ship = self.scene.ships[0].clone();
        (ship.speed, ship.heading, ship.position) = (speed, heading, position);
        let wake = kelvin_wake(&ship, self.scene.sea.depth, 0.0);
        let waves = wake.waves(&wake.plan(&self.raster, COARSE));
        let transfer = self.open.modulation_of(&self.models);
        let resolution = self.models.resolution().at(0.0);
        let strengths = (0..waves.len())
            .map(|n| {
                let k = [waves.kx[n], waves.ky[n]];
                let response = self.models.response.as_ref().map_or(1.0, |r| {
                    r.range.intensity_transfer(k[0]) * r.azimuth.intensity_transfer(k[1])
                });
                let modulation = transfer.at(k, waves.omega[n]).total();
                waves.amplitude[n] * modulation * (smear(k[1], resolution) * response)
            })
            .collect();
        let mut field = Field::constant(&self.raster, 0.0);
        let wavenumbers = [&waves.kx[..], &waves.ky[..]];
        nufft::sum_strengths(
            &mut Workspace::default(),
            (wavenumbers, vec![strengths]),
            &self.raster,
            COARSE,
            |_, made| std::mem::swap(&mut field, made),
        );
        let length = ship.length;
        let shown = Field::from_fn(&self.raster, |i, j| {
            fade_at(&wake.track, length, [self.raster.x(j), self.raster.y(i)]) as f32
        });
        for ((v, s), w) in field
            .values
            .iter_mut()
            .zip(&shown.values)
            .zip(&self.observed.taper.weights.values)
        {
            *v *= s * w;
        }
        field
    }

    /// The best place of each of many ships, within a distance \[m\] of a place.
    fn answers(&self, ships: &[[f64; 2]], near: [f64; 2], within: f64) -> Vec<Start> {
        let torus = &self.observed.torus;
        let one = |pair: &[[f64; 2]]| -> Vec<Start> {
            let fields: Vec<Field> = pair.iter().map(|s| self.wake(s[0], s[1], near)).collect();
            let second = fields.last().unwrap_or(&fields[0]);
            let filters = torus.spectra([&fields[0], second]);
            let mut energies = [0.0; 2];
            let mut products = [(); 2].map(|()| Vec::with_capacity(torus.half()));
            for (n, filter) in filters.iter().enumerate() {
                for (k, value) in filter.iter().enumerate() {
                    let power = self.power[k];
                    energies[n] += torus.weight(k) * f64::from(value.norm_sqr() / power);
                    products[n].push(value.conj() * self.left[k] / power);
                }
            }
            let size = torus.size;
            let area = (size * size) as f64;
            let maps = torus.fields([&products[0], &products[1]], [size, size]);
            pair.iter()
                .enumerate()
                .map(|(n, &[speed, heading])| {
                    let reach = (within / self.raster.spacing).round() as i64;
                    let energy = energies[n] / area * self.observed.taper.energy;
                    let mut best = (f32::NEG_INFINITY, [0, 0]);
                    for down in -reach..=reach {
                        for right in -reach..=reach {
                            let at = |d: i64| d.rem_euclid(size as i64) as usize;
                            let value = maps[n].values[at(down) * size + at(right)];
                            if value > best.0 {
                                best = (value, [down, right]);
                            }
                        }
                    }
                    let answer = f64::from(best.0.max(0.0)) * self.observed.taper.energy;
                    let [down, right] = best.1.map(|d| d as f64 * self.raster.spacing);
                    Start {
                        speed,
                        heading,
                        position: [near[0] + right, near[1] - down],
                        score: answer * answer / energy.max(1e-12),
                    }
                })
                .collect()
        };
        ships.par_chunks(2).flat_map_iter(one).collect()
    }

    /// Starts, the best first; none closer to a better one than a few percent of the speed and degrees of heading.
    ///
    /// - `count` of starts
    pub(super) fn starts(&self, detection: &Detection, count: usize) -> Vec<Start> {
        let (near, within, axis) = (detection.position, detection.within, detection.heading);
        let place = ShipPlace {
            position: near,
            length: self.scene.ships[0].length,
            depth: self.scene.sea.depth,
        };
        let measured = measure::measure_wake(&self.observed.image, &self.raster, &place);
        let mut centres: Vec<[f64; 2]> = Vec::new();
        let heading = axis.unwrap_or(measured.heading.value);
        if heading.is_finite() {
            let speed = measured.speed.value;
            centres.push([if speed.is_finite() { speed } else { 8.0 }, heading]);
        }
        let mut ships: Vec<[f64; 2]> = Vec::new();
        for [speed, heading] in &centres {
            for d in SPEEDS {
                ships.extend(HEADINGS.iter().map(|h| [speed * (1.0 + d), heading + h]));
            }
        }
        let mut answers = self.answers(&ships, near, within);
        answers.sort_by(|a, b| b.score.total_cmp(&a.score));
        let mut kept: Vec<Start> = Vec::new();
        for start in answers {
            let like = |other: &Start| {
                (start.speed / other.speed - 1.0).abs() < 0.03
                    && measure::angle_between(start.heading, other.heading).abs() < 2.0
            };
            if kept.len() < count && !kept.iter().any(like) {
                kept.push(start);
            }
        }
        kept
    }
}
