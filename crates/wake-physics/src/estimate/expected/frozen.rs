//! Choices of a plan that are made once for all scenes that differ by a few values, and the models of these scenes.

use super::waves::Linear;
use crate::linear::OpenSea;
use crate::models::{Models, kelvin_wake};
use crate::plan::Plan;
use crate::raster::Raster;
use crate::sar::Imaging;
use crate::scattering::Backscatter;
use crate::scene::{Scene, Term};

/// Frozen choices of a plan.
#[derive(Debug)]
pub(super) struct Frozen {
    pub(super) plan: Plan,
    pub(super) ships: usize,
    /// True if the image is a mean over the waves of the sea.
    pub(super) over_seas: bool,
    /// Pixels with their margin.
    pub(super) raster: Raster,
    pub(super) fields: Vec<Linear>,
    /// For each ship, whether each wave modulates.
    pub(super) modulating: Vec<Vec<bool>>,
    /// Steepest slope for which σ⁰ is computed.
    pub(super) reach: f64,
    /// Tolerance of sums of waves.
    pub(super) tolerance: f64,
}

impl Frozen {
    /// Backscatter with the terms of the plan.
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

/// Imaging parameters of the radar for a plan.
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

/// Models of a scene that differs from the scene of `models` only by values of its ships.
pub(super) fn with_ships_of(scene: &Scene, models: &Models) -> Models {
    let wake = |ship| kelvin_wake(ship, scene.sea.depth, scene.sea.time);
    Models {
        wakes: scene.ships.iter().map(wake).collect(),
        ..models.clone()
    }
}
