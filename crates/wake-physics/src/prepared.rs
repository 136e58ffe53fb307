//! A scene with everything that is built from it before fields are computed; built once per run.

use crate::effects::Effects;
use crate::linear::OpenSea;
use crate::models::Models;
use crate::scene::Scene;

/// A valid scene, prepared for its plan, its labels and the stages of a simulation.
pub(crate) struct Prepared<'a> {
    pub(crate) scene: &'a Scene,
    /// Pixels, sea, ships and radar.
    pub(crate) models: Models,
    /// Optional effects.
    pub(crate) effects: Effects,
    /// First-order theory of the sea without ships.
    pub(crate) open: OpenSea,
}

impl<'a> Prepared<'a> {
    /// Builds the models of a valid scene.
    pub(crate) fn new(scene: &'a Scene) -> Self {
        let models = Models::new(scene);
        Self {
            effects: Effects::new(scene, &models),
            open: OpenSea::new(&models),
            scene,
            models,
        }
    }

    /// The same scene for the mean over all seas: the models average over the effects of its waves.
    pub(crate) fn over_all_seas(self) -> Self {
        Self {
            models: self.open.averaged(&self.models),
            ..self
        }
    }
}
