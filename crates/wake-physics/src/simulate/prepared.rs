//! A scene with its models, first-order theory and plan, built once a run.

use crate::error::Result;
use crate::labels::{Labels, labels_with};
use crate::models::Models;
use crate::plan::Plan;
use crate::scene::Scene;
use crate::survey::Survey;

/// A valid scene with everything that is built from it before a field is computed.
pub(super) struct Prepared<'a> {
    pub(super) scene: &'a Scene,
    pub(super) models: Models,
    pub(super) survey: Survey,
    pub(super) plan: Plan,
}

impl<'a> Prepared<'a> {
    /// Builds the models and the plan of a scene.
    ///
    /// # Errors
    ///
    /// A value of the scene out of its range, or a grid that does not fit in memory.
    pub(super) fn new(scene: &'a Scene) -> Result<Self> {
        scene.validate()?;
        let models = Models::new(scene);
        let survey = Survey::new(scene, &models);
        let plan = Plan::of(scene, &models, &survey)?;
        Ok(Self {
            scene,
            models,
            survey,
            plan,
        })
    }

    /// The labels of the scene.
    pub(super) fn labels(&self) -> Labels {
        labels_with(self.scene, &self.models)
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
