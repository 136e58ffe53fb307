//! Turbulent wakes: the dark bands along the tracks of ships.

use super::effect::{Effect, OUTSIDE, Site, Weight};
use crate::linear::Amplitudes;
use crate::linear::amplitudes::rms_over;
use crate::models::Models;
use crate::raster::Field;
use crate::scene::{Recovery, Scene, Ship, Term};
use crate::turbulent::{Suppression, TurbulentWake};
use crate::workspace::Workspace;
use rayon::prelude::*;

#[derive(Debug)]
pub(crate) struct TurbulentWakes {
    /// One wake per ship.
    pub(crate) wakes: Vec<TurbulentWake>,
}

impl TurbulentWakes {
    pub(super) fn new(scene: &Scene, models: &Models) -> Self {
        let of_ship = |(ship, wake): (&Ship, &crate::kelvin::KelvinWake)| TurbulentWake {
            track: wake.track,
            speed: wake.speed,
            length: wake.hull.length(),
            beam: wake.hull.beam(),
            suppression: match ship.recovery {
                Recovery::Constant => Suppression::Given(ship.damping),
                Recovery::Wind => Suppression::in_wind(ship.damping, scene.sea.wind_speed),
            },
        };
        Self {
            wakes: scene.ships.iter().zip(&models.wakes).map(of_ship).collect(),
        }
    }

    /// Root mean square over the image of the damping by all wakes.
    fn damping(&self, models: &Models) -> f64 {
        if self.wakes.iter().all(|wake| wake.speed == 0.0) {
            return 0.0;
        }
        rms_over(&models.pixels.computed, |place| {
            let of = |wake: &TurbulentWake| wake.damping(wake.track.seen_from_ship(place));
            // The remaining shares multiply: 1 − (1 − a)(1 − b) = a + b (1 − a).
            let each = self.wakes.iter().map(of);
            each.fold(0.0, |all, one| all + one * (1.0 - all))
        })
    }
}

/// Estimated change of the intensity, relative.
///
/// - `damping`: root mean square over the image
pub(crate) fn estimate(damping: f64, amplitudes: &Amplitudes<'_>) -> f64 {
    damping * amplitudes.first.modulation.bragg_share
}

impl Effect for TurbulentWakes {
    fn term(&self) -> Term {
        Term::Turbulent
    }

    fn weigh(&self, models: &Models, amplitudes: &Amplitudes<'_>) -> Weight {
        let damping = self.damping(models);
        let undamped = models.short_waves_vanish();
        Weight {
            absent: models
                .no_wake()
                .or(undamped.then_some("there are no short waves to damp"))
                .or((damping == 0.0).then_some(OUTSIDE)),
            estimate: estimate(damping, amplitudes),
        }
    }

    fn damp(&self, site: &Site<'_>, memory: &mut Workspace, remaining: &mut Option<Field>) {
        for wake in &self.wakes {
            let mut field = memory.field(&site.raster);
            wake.fill_damping(&mut field, &site.raster);
            let damping = field.values.par_iter_mut().with_min_len(1 << 14);
            match remaining {
                None => {
                    damping.for_each(|damping| *damping = 1.0 - *damping);
                    *remaining = Some(field);
                }
                Some(left) => {
                    let pairs = left.values.par_iter_mut().zip(damping);
                    pairs.for_each(|(left, damping)| *left *= 1.0 - *damping);
                    memory.give(field);
                }
            }
        }
    }
}
