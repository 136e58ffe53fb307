//! A scene with everything that is built from it before a field is computed: built once a run.

use crate::effects::Effects;
use crate::error::Result;
use crate::labels::{Labels, labels_with};
use crate::linear::{FirstOrder, OpenSea};
use crate::models::Models;
use crate::plan::Plan;
use crate::raster::Raster;
use crate::scene::{Scene, Term};

/// A valid scene, prepared.
pub(crate) struct Prepared<'a> {
    pub(crate) scene: &'a Scene,
    /// Pixels, sea, ships and radar.
    pub(crate) models: Models,
    /// Optional effects.
    pub(crate) effects: Effects,
    pub(crate) first: FirstOrder,
    pub(crate) plan: Plan,
}

impl<'a> Prepared<'a> {
    /// Builds the models and the plan of a scene.
    ///
    /// # Errors
    ///
    /// A value of the scene out of its range, or a grid that does not fit in memory.
    pub(crate) fn new(scene: &'a Scene) -> Result<Self> {
        scene.validate()?;
        let models = Models::new(scene);
        let effects = Effects::new(scene, &models);
        let first = FirstOrder::new(&models, OpenSea::new(&models));
        Ok(Self {
            plan: Plan::of(scene, &models, &effects, &first)?,
            scene,
            models,
            effects,
            first,
        })
    }

    /// The computed pixels with their margin.
    pub(crate) fn with_margin(&self) -> Raster {
        let [rows, columns] = self.plan.sizes.margin;
        self.models.pixels.computed.with_margin(rows, columns)
    }

    /// The labels of the scene.
    pub(crate) fn labels(&self) -> Labels {
        labels_with(self.scene, &self.models, &self.effects, &self.first.open)
    }

    /// The mean over all seas of this scene: no sea is drawn, and what its waves do is averaged over.
    pub(crate) fn over_all_seas(self) -> Self {
        if !self.plan.uses(Term::Sea) && !self.plan.uses(Term::Swell) {
            return self;
        }
        Self {
            models: self.first.open.averaged(&self.models),
            plan: self.plan.over_all_seas(),
            ..self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::labels::labels_of;

    /// Labels from the models of a run are those of the scene alone, bit for bit.
    #[test]
    fn labels_of_a_run_are_those_of_its_scene() {
        for keys in [
            &[][..],
            &["ship.turn_rate=0.3", "ship.echo=true"],
            &["radar.sensor=sentinel-1-iw", "ship.edge=true"],
            &["grid.spacing=10", "ship.speed=6.5"],
            &["sea.wind_speed=0"],
        ] {
            let size = ["grid.rows=96", "grid.columns=80"];
            let scene = Scene::default()
                .with_assignments(&[&size, keys].concat())
                .unwrap();
            let labels = Prepared::new(&scene).unwrap().labels();
            assert_eq!(labels, labels_of(&scene), "{keys:?}");
        }
    }
}
