//! The wake of a ship with the scene's numbers.

use crate::hull::Hull;
use crate::kelvin::KelvinWake;
use crate::scene::{HullForm, Ship};
use crate::track::Track;

/// Block coefficient of the full hull where the scene names none: a laden tanker.
const TANKER_BLOCK_COEFFICIENT: f64 = 0.8;

/// Farthest coordinate of a ship \[m\]: squares and areas of what lies farther overflow. No image is anywhere near.
const FARTHEST: f64 = 1e100;

/// The Kelvin wake of a ship.
pub(crate) fn kelvin_wake(ship: &Ship, depth: f64, time: f64) -> KelvinWake {
    let (length, beam, draft) = (ship.length, ship.beam, ship.draft);
    KelvinWake {
        hull: match ship.hull {
            HullForm::Wigley => Hull::wigley(length, beam, draft),
            HullForm::Full => {
                let block = ship.block_coefficient.unwrap_or(TANKER_BLOCK_COEFFICIENT);
                Hull::full(length, beam, draft, block)
            }
        },
        speed: ship.speed,
        track: Track::turning(
            ship.position.map(|at| at.clamp(-FARTHEST, FARTHEST)),
            ship.heading,
            ship.speed * time,
            ship.curvature(),
        ),
        depth,
        filter_depth: ship.filter_depth,
    }
}
