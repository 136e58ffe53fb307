//! Wake correlation: what is the same in every image of a scene, against what the simulator says it is.

use crate::measurements::raster;
use crate::pixels::grey;
use crate::scenes::{other_sea, ship};
use crate::source::{ImageSource, Result, Simulator, Told};
use crate::statistics::quantile;
use serde::Serialize;
use wake_ldm::metrics::{Plane, correlation};
use wake_physics::measure::{ShipPlace, kelvin_wedge};
use wake_physics::{Field, Scene};

/// Images of each mean.
const IMAGES: u64 = 8;

/// Correlation inside the Kelvin wedge, scene by scene.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct WakeCorrelation {
    /// Mean of 4 simulated images against the mean of 4 others.
    pub(crate) simulator: Vec<f64>,
    /// Mean of 8 generated images against the mean of 8 simulated ones.
    pub(crate) model: Option<Vec<f64>>,
    /// Median over the scenes of the simulator's.
    pub(crate) simulator_median: Option<f64>,
    /// Median over the scenes of the model's.
    pub(crate) model_median: Option<f64>,
    /// Median over the scenes of model over simulator.
    pub(crate) ratio_median: Option<f64>,
}

/// Measures the correlation over `scenes`.
pub(crate) fn wake_correlation(
    scenes: &[Scene],
    model: Option<&dyn ImageSource>,
    mut progress: impl FnMut(),
) -> Result<WakeCorrelation> {
    let (mut simulator, mut generated) = (Vec::new(), Vec::new());
    for scene in scenes {
        let seas: Vec<Scene> = (1..=IMAGES).map(|n| other_sea(scene, 100 + n)).collect();
        let simulated = greys(&Simulator, &seas)?;
        let half = simulated.len() / 2;
        let inside = wedge(scene);
        let halves = [mean_of(&simulated[..half]), mean_of(&simulated[half..])];
        simulator.push(correlated(&halves[0], &halves[1], &inside));
        if let Some(model) = model {
            let mean = mean_of(&greys(model, &seas)?);
            generated.push(correlated(&mean, &mean_of(&simulated), &inside));
        }
        progress();
    }
    let ratios: Vec<f64> = generated
        .iter()
        .zip(&simulator)
        .map(|(m, s)| m / s)
        .collect();
    Ok(WakeCorrelation {
        simulator_median: quantile(&simulator, 0.5),
        model_median: quantile(&generated, 0.5),
        ratio_median: quantile(&ratios, 0.5),
        model: model.map(|_| generated),
        simulator,
    })
}

fn greys(source: &dyn ImageSource, scenes: &[Scene]) -> Result<Vec<Field>> {
    Ok(source.draw(scenes, Told::Both)?.iter().map(grey).collect())
}

fn wedge(scene: &Scene) -> Vec<bool> {
    let ship = ship(scene);
    let place = ShipPlace {
        position: ship.position,
        length: ship.length,
        depth: scene.sea.depth,
    };
    kelvin_wedge(&raster(scene), &place, ship.heading, ship.speed)
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

/// A constant image correlates with nothing.
fn correlated(one: &Field, other: &Field, inside: &[bool]) -> f64 {
    let planes = [one, other].map(|f| Plane::new(&f.values, f.columns));
    correlation(&planes[0], &planes[1], inside).unwrap_or(0.0)
}
