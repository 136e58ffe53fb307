//! Speckle of an image, from its mean intensity.

use crate::constants::SPEED_OF_LIGHT;
use crate::error::Result;
use crate::models::Models;
use crate::random::{Stream, generator};
use crate::raster::{Field, Raster};
use crate::sar::ImpulseResponse;
use crate::sar::coherence::integration_time;
use crate::sar::geometry::{azimuth_displacement, direction, ship_radial_velocity};
use crate::sar::halo::{Halo, hull_moments};
use crate::sar::impulse::{Looks, PointTarget, Reflectivity};
use crate::sar::paired_echoes::PairedEchoes;
use crate::sar::scatterers::{ShipEcho, Viewing, ambiguities};
use crate::sar::speckle::speckle;
use crate::scene::sensor::ambiguity_distance;
use crate::scene::{Scene, Ship};
use num_complex::Complex32;
use std::f64::consts::TAU;

/// Sources of the impulse response.
#[derive(Debug, Clone)]
pub(super) struct Exposure {
    response: ImpulseResponse,
    /// Pixels of the sources.
    sources: Raster,
    /// Intensity of the sources, noise included.
    pub(super) intensity: Field,
    /// Points of ships and their ambiguities.
    points: Vec<PointTarget>,
    /// Pixels of the image.
    image: Raster,
}

impl Exposure {
    /// The intensity of a scene on the computed pixels, with its ships as points.
    pub(super) fn of(
        scene: &Scene,
        models: &Models,
        response: ImpulseResponse,
        intensity: Field,
    ) -> Self {
        Self {
            response,
            sources: models.pixels.computed,
            intensity,
            points: points_inside(scene, models),
            image: models.pixels.image,
        }
    }

    fn reflectivity(&self) -> Reflectivity<'_> {
        Reflectivity {
            raster: &self.sources,
            intensity: &self.intensity,
            points: &self.points,
        }
    }

    /// Intensity of the image before speckle.
    pub(super) fn mean(&self) -> Field {
        self.response.mean(&self.reflectivity(), &self.image)
    }
}

/// Points of the ships with an echo, and their ambiguities: the same with and without an impulse response.
pub(super) fn points(scene: &Scene, models: &Models) -> Vec<PointTarget> {
    let radar = &scene.radar;
    let mut points = Vec::new();
    for (n, ship, echo) in echoes(scene, models) {
        let mut own = echo.scatterers(&viewing(scene, models), scene.seed, n);
        let halo = ship.halo.map_or(0.0, power_ratio);
        for point in &mut own {
            point.cross_section /= 1.0 + halo;
        }
        if let (Some(ratio), Some(range)) = (radar.paired_echoes, radar.range_resolution) {
            let echoes = PairedEchoes {
                ratio: power_ratio(ratio),
                cell: [range, radar.azimuth_resolution],
            };
            let mut random = generator(scene.seed, Stream::PairedEchoes, n as u64);
            echoes.spread(&mut own, &mut random);
        }
        points.extend(own);
    }
    if let (Some(level), Some(rate)) = (radar.azimuth_ambiguity, radar.prf) {
        let distance = ambiguity_distance(rate, radar.frequency, models.range_to_velocity);
        points.extend(ambiguities(&points, distance, power_ratio(level)));
    }
    points
}

/// Halos of the ships with an echo.
pub(super) fn halos(scene: &Scene, models: &Models) -> Vec<Halo> {
    let radar = &scene.radar;
    let range = radar.range_resolution.unwrap_or(scene.grid.spacing);
    let of_ship = |(n, ship, echo): (usize, &Ship, ShipEcho)| {
        let ratio = power_ratio(ship.halo?);
        let total = echo.cross_section(scene.seed, n);
        let [x, y] = echo.position;
        let velocity = echo.radial_velocity;
        let [xx, xy, yy] = hull_moments(direction(echo.heading), [echo.length, echo.beam]);
        let smear = models.range_to_velocity * echo.roll_velocity;
        Some(Halo {
            centre: [
                x,
                y + azimuth_displacement(models.range_to_velocity, velocity),
            ],
            moments: [
                xx + 0.25 * range * range,
                xy,
                yy + 0.25 * radar.azimuth_resolution.powi(2) + smear * smear,
            ],
            cross_section: total * ratio / (1.0 + ratio),
        })
    };
    echoes(scene, models).filter_map(of_ship).collect()
}

/// The ships with an echo, and their indices.
fn echoes<'s>(
    scene: &'s Scene,
    models: &'s Models,
) -> impl Iterator<Item = (usize, &'s Ship, ShipEcho)> {
    let ships = scene.ships.iter().zip(&models.wakes).enumerate();
    let drawn = ships.filter(|(_, (ship, _))| ship.echo);
    drawn.map(|(n, (ship, wake))| {
        let heading = ship.heading_at(scene.sea.time);
        let acceleration = |period: f64| TAU * ship.roll / period;
        let echo = ShipEcho {
            position: wake.track.position,
            heading,
            length: ship.length,
            beam: ship.beam,
            radial_velocity: ship_radial_velocity(ship.speed, heading, models.incidence),
            roll_velocity: ship.roll,
            roll_acceleration: ship.roll_period.map_or(0.0, acceleration),
            points: ship.scatterers,
        };
        (n, ship, echo)
    })
}

fn viewing(scene: &Scene, models: &Models) -> Viewing {
    let radar = &scene.radar;
    Viewing {
        incidence: models.incidence,
        range_to_velocity: models.range_to_velocity,
        aperture: integration_time(
            SPEED_OF_LIGHT / radar.frequency,
            models.range_to_velocity,
            radar.azimuth_resolution,
        ),
    }
}

/// Power ratio of a level \[dB\].
fn power_ratio(level: f64) -> f64 {
    10f64.powf(0.1 * level)
}

/// The points inside the sources; an impulse response would wrap others around.
fn points_inside(scene: &Scene, models: &Models) -> Vec<PointTarget> {
    let [rows, columns] = [
        models.pixels.computed.rows as f64,
        models.pixels.computed.columns as f64,
    ];
    let mut points = points(scene, models);
    points.retain(|point| {
        let [column, row] = models
            .pixels
            .computed
            .pixel(point.position[0], point.position[1]);
        (0.0..rows).contains(&row) && (0.0..columns).contains(&column)
    });
    points
}

/// Method of applying speckle to an image.
#[derive(Debug, Clone)]
pub(super) enum Speckling {
    /// No speckle.
    Without,
    /// Independent speckle per pixel: looks, seed.
    Pixels(u32, u64),
    /// Speckle through the impulse response.
    Looks(Box<Exposure>, Looks),
}

impl Speckling {
    /// The method for a scene; `exposure` is given if the image has an impulse response.
    pub(super) fn of(scene: &Scene, models: &Models, exposure: Option<Exposure>) -> Self {
        let (count, seed) = (scene.radar.looks, scene.seed);
        match (exposure, models.response) {
            (Some(exposure), Some(response)) => {
                let overlap = scene.radar.look_overlap.unwrap_or(0.0);
                // The looks of the modelled products are separated in range; otherwise the windows are alike.
                let equivalent = response.range.window.overlapping_looks(count, overlap);
                Self::Looks(Box::new(exposure), Looks { equivalent, seed })
            }
            _ => Self::Pixels(count, seed),
        }
    }

    /// Applies speckle to an intensity; returns the complex image if there is an impulse response and a single look.
    pub(super) fn apply(&self, intensity: &mut Field) -> Option<Vec<Complex32>> {
        match self {
            Self::Without => None,
            Self::Pixels(looks, seed) => {
                speckle(intensity, *looks, *seed);
                None
            }
            Self::Looks(exposure, looks) if looks.equivalent <= 1.0 => {
                let source = exposure.reflectivity();
                let slc = exposure
                    .response
                    .single_look(&source, &exposure.image, looks.seed);
                for (value, s) in intensity.values.iter_mut().zip(&slc) {
                    *value = s.norm_sqr();
                }
                Some(slc)
            }
            Self::Looks(exposure, looks) => {
                let source = exposure.reflectivity();
                *intensity = exposure.response.multilook(&source, &exposure.image, looks);
                None
            }
        }
    }

    /// Returns the buffer of the sources' intensity, if there is one.
    pub(super) fn into_sources(self) -> Option<Field> {
        match self {
            Self::Looks(exposure, _) => Some(exposure.intensity),
            Self::Without | Self::Pixels(..) => None,
        }
    }
}

/// Speckle with mean 1 as a scene's radar makes it on a uniform sea, `[rows, columns]` of the image; correlated if the
/// image has an impulse response.
///
/// # Errors
///
/// As [`simulate`](super::simulate).
pub fn unit_speckle(scene: &Scene) -> Result<Field> {
    scene.validate()?;
    let open = Scene {
        ships: Vec::new(),
        ..scene.clone()
    };
    let models = Models::new(&open);
    let sources = Field::constant(&models.pixels.computed, 1.0);
    let response = models.response;
    let exposure = response.map(|response| Exposure::of(&open, &models, response, sources));
    let mut image = Field::constant(&models.pixels.image, 1.0);
    Speckling::of(&open, &models, exposure).apply(&mut image);
    Ok(image)
}
