//! From the mean intensity to the image with speckle.

use crate::error::Result;
use crate::kelvin::KelvinWake;
use crate::models::Models;
use crate::raster::{Field, Raster};
use crate::sar::ImpulseResponse;
use crate::sar::geometry::ship_radial_velocity;
use crate::sar::impulse::{Looks, PointTarget, Reflectivity};
use crate::sar::scatterers::{ShipEcho, Viewing, ambiguities};
use crate::sar::speckle::speckle;
use crate::scene::sensor::ambiguity_distance;
use crate::scene::{Scene, Ship};
use num_complex::Complex32;

/// What the radar looks at before its impulse response.
#[derive(Debug, Clone)]
pub(super) struct Exposure {
    response: ImpulseResponse,
    /// Places of the sources.
    sources: Raster,
    /// Their intensity, noise included.
    pub(super) intensity: Field,
    /// Ships and their ghosts.
    points: Vec<PointTarget>,
    /// Pixels of the image.
    image: Raster,
}

impl Exposure {
    /// The intensity of a scene, on the computed pixels, with its ship as points.
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

/// The ships whose echo is drawn as points, with their ghosts: the same whether or not an impulse response images them.
pub(super) fn points(scene: &Scene, models: &Models) -> Vec<PointTarget> {
    let view = Viewing {
        incidence: models.incidence,
        range_to_velocity: models.range_to_velocity,
    };
    let ships = scene.ships.iter().zip(&models.wakes).enumerate();
    let drawn = ships.filter(|(_, (ship, _))| ship.echo);
    let of_ship = |(n, (ship, wake)): (usize, (&Ship, &KelvinWake))| {
        let heading = ship.heading_at(scene.sea.time);
        let echo = ShipEcho {
            position: wake.track.position,
            heading,
            length: ship.length,
            beam: ship.beam,
            radial_velocity: ship_radial_velocity(ship.speed, heading, models.incidence),
            roll_velocity: ship.roll,
        };
        echo.scatterers(&view, scene.seed, n)
    };
    let mut points: Vec<PointTarget> = drawn.flat_map(of_ship).collect();
    let radar = &scene.radar;
    if let (Some(level), Some(rate)) = (radar.azimuth_ambiguity, radar.prf) {
        let distance = ambiguity_distance(rate, radar.frequency, models.range_to_velocity);
        points.extend(ambiguities(&points, distance, 10f64.powf(0.1 * level)));
    }
    points
}

/// Those points that lie among the sources: an impulse response would bring others around.
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

/// How the image gets its speckle.
#[derive(Debug, Clone)]
pub(super) enum Speckling {
    /// It has none.
    Without,
    /// Each pixel by itself: looks, seed.
    Pixels(u32, u64),
    /// Through the impulse response.
    Looks(Box<Exposure>, Looks),
}

impl Speckling {
    /// What a scene asks for; `exposure` where its image has an impulse response.
    pub(super) fn of(scene: &Scene, models: &Models, exposure: Option<Exposure>) -> Self {
        let (count, seed) = (scene.radar.looks, scene.seed);
        match (exposure, models.response) {
            (Some(exposure), Some(response)) => {
                let overlap = scene.radar.look_overlap.unwrap_or(0.0);
                // The looks of the products modelled lie in range; elsewhere the windows are alike.
                let equivalent = response.range.window.overlapping_looks(count, overlap);
                Self::Looks(Box::new(exposure), Looks { equivalent, seed })
            }
            _ => Self::Pixels(count, seed),
        }
    }

    /// Gives an intensity its speckle, and returns the complex image where there is one look of one.
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

    /// The block of the sources' intensity, where there is one.
    pub(super) fn into_sources(self) -> Option<Field> {
        match self {
            Self::Looks(exposure, _) => Some(exposure.intensity),
            Self::Without | Self::Pixels(..) => None,
        }
    }
}

/// Speckle of mean 1 as a scene's radar makes it on a sea that is the same everywhere, `[rows, columns]` of the image: correlated
/// where the image has an impulse response.
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
