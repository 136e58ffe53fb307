//! Where the ship is in the image: labels and echo, from the scene's numbers alone.

use crate::constants::SEA_WATER_DENSITY;
use crate::labels::{Labels, Track as LabelTrack};
use crate::models::Models;
use crate::raster::Raster;
use crate::sar::Echo;
use crate::sar::echo::ship_cross_section;
use crate::sar::geometry::{azimuth_displacement, ship_radial_velocity};
use crate::scene::Scene;
use crate::track::Track;

/// Where ship and wake are in the image of a scene, without simulating it.
#[must_use]
pub fn labels_of(scene: &Scene) -> Labels {
    let track = scene.ship.as_ref().map(|ship| {
        let distance = ship.speed * scene.sea.time;
        LabelTrack {
            position: Track::new(ship.position, ship.heading, distance).position,
            heading: ship.heading,
            speed: ship.speed,
            length: ship.length,
            beam: ship.beam,
            azimuth_displacement: echo_displacement(scene),
        }
    });
    let grid = &scene.grid;
    let image = Raster::image(grid.rows, grid.columns, grid.spacing);
    Labels::new(track.as_ref(), &image)
}

/// The ship's own echo, if it is asked for.
pub(super) fn echo_of(scene: &Scene, models: &Models) -> Option<Echo> {
    let ship = scene.ship.as_ref().filter(|ship| ship.echo)?;
    let wake = models.wake.as_ref()?;
    let displacement = SEA_WATER_DENSITY * wake.hull.volume();
    Some(Echo {
        position: wake.track.position,
        heading: ship.heading,
        length: ship.length,
        beam: ship.beam,
        cross_section: ship_cross_section(scene.radar.frequency, displacement),
        displacement: echo_displacement(scene),
    })
}

/// Azimuth displacement of the ship's echo \[m\].
fn echo_displacement(scene: &Scene) -> f64 {
    let incidence = scene.radar.incidence.to_radians();
    let velocity = scene.ship.as_ref().map_or(0.0, |ship| {
        ship_radial_velocity(ship.speed, ship.heading, incidence)
    });
    azimuth_displacement(scene.radar.range_to_velocity, velocity)
}
