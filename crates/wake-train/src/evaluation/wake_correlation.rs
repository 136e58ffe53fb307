//! Wake correlation: mean images of a scene over many seas, the model's against the simulator's.

use serde::Serialize;
use wake_physics::measure::kelvin_wedge;
use wake_physics::{Field, Scene};

use super::baseline::Baseline;
use super::reading::{place, raster};
use super::source::{ImageSource, Told, other_sea};
use super::statistics::quantile;
use super::view::View;
use crate::error::{Error, Result};
use crate::metrics::{Plane, correlation};

/// Images of each mean.
const IMAGES: u64 = 8;

/// Correlation of mean images inside the Kelvin wedge, scene by scene.
#[derive(Debug, Clone, Serialize)]
pub struct WakeCorrelation {
    /// Mean of 4 simulated images against the mean of 4 others.
    pub simulator: Vec<f64>,
    /// Mean of 8 generated images against the mean of 8 simulated ones.
    pub model: Vec<f64>,
    /// Median over the scenes of the simulator's.
    pub simulator_median: Option<f64>,
    /// Median over the scenes of the model's.
    pub model_median: Option<f64>,
    /// Median over the scenes of model over simulator.
    pub ratio_median: Option<f64>,
}

/// Measures the wake correlation of grey, inside the Kelvin wedge of each scene's first ship and over eight seas per scene.
///
/// - `model`: conditioned on sentence and numbers
/// - `step`: called after each scene
///
/// # Errors
///
/// As [`ImageSource::draw`]; [`wake_nn::Error::InvalidOption`] for a scene without a ship.
pub(super) fn wake_correlation(
    scenes: &[Scene],
    model: &dyn ImageSource,
    view: &View,
    mut step: impl FnMut(),
) -> Result<WakeCorrelation> {
    let (mut simulator, mut generated) = (Vec::new(), Vec::new());
    for scene in scenes {
        let inside = wedge(scene)?;
        let seas: Vec<Scene> = (1..=IMAGES).map(|n| other_sea(scene, 100 + n)).collect();
        let simulated = greys(view, &Baseline::Simulator, &seas)?;
        let half = simulated.len() / 2;
        let halves = [mean_of(&simulated[..half]), mean_of(&simulated[half..])];
        simulator.push(correlated(&halves[0], &halves[1], &inside));
        let mean = mean_of(&greys(view, model, &seas)?);
        generated.push(correlated(&mean, &mean_of(&simulated), &inside));
        step();
    }
    let ratios = generated.iter().zip(&simulator).map(|(m, s)| m / s);
    let ratios: Vec<f64> = ratios.collect();
    Ok(WakeCorrelation {
        simulator_median: quantile(&simulator, 0.5),
        model_median: quantile(&generated, 0.5),
        ratio_median: quantile(&ratios, 0.5),
        model: generated,
        simulator,
    })
}

fn greys(view: &View, source: &dyn ImageSource, scenes: &[Scene]) -> Result<Vec<Field>> {
    let images = view.draw(source, scenes, Told::Both)?;
    Ok(images.iter().map(|image| view.grey(image)).collect())
}

/// The pixels inside the Kelvin wedge of the first ship.
pub(super) fn wedge(scene: &Scene) -> Result<Vec<bool>> {
    let ship = scene.ships.first().ok_or_else(|| {
        Error::Value(wake_nn::Error::InvalidOption {
            option: "scene".to_owned(),
            value: "without a ship".to_owned(),
            expected: "a scene with a ship, whose wake can be correlated".to_owned(),
        })
    })?;
    let place = place(ship, scene);
    Ok(kelvin_wedge(
        &raster(scene),
        &place,
        ship.heading,
        ship.speed,
    ))
}

/// Pixel-wise mean of images.
fn mean_of(images: &[Field]) -> Field {
    let mut mean = images[0].clone();
    for image in &images[1..] {
        for (sum, v) in mean.values.iter_mut().zip(&image.values) {
            *sum += v;
        }
    }
    for v in &mut mean.values {
        *v /= images.len() as f32;
    }
    mean
}

/// Correlation inside a mask; 0 for a constant image.
fn correlated(one: &Field, other: &Field, inside: &[bool]) -> f64 {
    let planes = [one, other].map(|f| Plane::new(&f.values, f.columns));
    correlation(&planes[0], &planes[1], inside).unwrap_or(0.0)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;

    /// The simulator as the model draws the very images that it is compared with; a constant correlates with nothing.
    #[test]
    fn what_is_the_same_in_all_seas_correlates() {
        let keys = ["grid.rows = 64", "grid.columns = 64"];
        let scene = Scene::default().with_assignments(&keys).unwrap();
        let scenes = [scene.clone()];
        let view = View::default();
        let same = wake_correlation(&scenes, &Baseline::Simulator, &view, || {}).unwrap();
        assert!((same.model[0] - 1.0).abs() < 1e-6, "{same:?}");
        assert!((-1.0..1.0).contains(&same.simulator[0]));
        let flat = wake_correlation(&scenes, &Baseline::Constant, &view, || {}).unwrap();
        assert!(flat.model[0].abs() < 1e-12, "{flat:?}");
        let open = Scene {
            ships: Vec::new(),
            ..scene
        };
        let refused = wake_correlation(&[open], &Baseline::Constant, &view, || {}).unwrap_err();
        assert!(refused.to_string().contains("without a ship"), "{refused}");
    }
}
