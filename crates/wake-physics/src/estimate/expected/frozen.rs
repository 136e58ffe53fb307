//! What a plan chooses once for all scenes that differ by a few values, and their models.

use super::waves::Linear;
use crate::linear::OpenSea;
use crate::models::{Models, kelvin_wake};
use crate::plan::Plan;
use crate::raster::Raster;
use crate::sar::Imaging;
use crate::scattering::Backscatter;
use crate::scene::{Scene, Term};

/// Choices that are frozen.
#[derive(Debug)]
pub(super) struct Frozen {
    pub(super) plan: Plan,
    pub(super) ships: usize,
    /// True for a mean over the waves of a sea.
    pub(super) over_seas: bool,
    /// Pixels with their margin.
    pub(super) raster: Raster,
    pub(super) fields: Vec<Linear>,
    /// Waves of each ship that modulate.
    pub(super) modulating: Vec<Vec<bool>>,
    /// Steepest slope that σ⁰ is computed for.
    pub(super) reach: f64,
    /// Of sums of waves.
    pub(super) tolerance: f64,
}

impl Frozen {
    /// Backscatter of the terms of the plan.
    pub(super) fn backscatter(&self, models: &Models) -> Backscatter {
        let uses = |term| self.plan.uses(term);
        models.backscatter(uses(Term::TiltAverage), uses(Term::Specular))
    }
}

/// Models of a scene that average over the whole sea.
pub(super) fn averaged(scene: &Scene) -> Models {
    let models = Models::new(scene);
    OpenSea::new(&models).averaged(&models)
}

/// What the radar does, by a plan.
pub(super) fn imaging(models: &Models, plan: &Plan) -> Imaging {
    Imaging {
        range_to_velocity: models.range_to_velocity,
        incidence: models.incidence,
        resolution: match plan.uses(Term::AzimuthSmear) {
            true => models.resolution(),
            false => models.resolution_at_rest(),
        },
    }
}

/// Models of a scene that differs from another by a ship's value.
pub(super) fn with_ships_of(scene: &Scene, models: &Models) -> Models {
    let wake = |ship| kelvin_wake(ship, scene.sea.depth, scene.sea.time);
    Models {
        wakes: scene.ships.iter().map(wake).collect(),
        ..models.clone()
    }
}
