//! What is known of a scene before its sea is drawn: its numbers, places in the ship's frame, and the expected image.

use burn::tensor::{Tensor, TensorData};
use rayon::prelude::*;
use wake_physics::grey::GreyScale;
use wake_physics::{Scene, expected_intensity};

use super::patches::PatchTransform;
use crate::error::Result;
use crate::wake_model::conditioning::{Conditions, FEATURES, MapGrid, PLACES, features, places};

/// What is known of the scenes of a batch.
#[derive(Debug, Clone)]
pub struct Known {
    /// Their numbers, `[batch, FEATURES]`.
    pub numbers: Tensor<2>,
    /// Where the pixels of the latents lie, `[batch, PLACES, rows, columns]`.
    pub places: Tensor<4>,
    /// Latents of the images expected of them, `[batch, channels, rows, columns]`.
    pub wake: Tensor<4>,
}

impl Known {
    /// What is known of some scenes at all their latent pixels.
    ///
    /// - `wake`: see [`expected_latents`]; its device is that of the result
    pub fn new(conditions: &[Conditions], grid: MapGrid, wake: Tensor<4>) -> Self {
        let cells = vec![grid.cells(); conditions.len()];
        Self::of_cells(conditions, grid, &cells, wake)
    }

    /// What is known of some scenes at some of their latent pixels.
    ///
    /// - `cells`: which, for each scene
    /// - `wake`: at these pixels, `[batch, channels, rows, columns]`
    pub(crate) fn of_cells(
        conditions: &[Conditions],
        grid: MapGrid,
        cells: &[Vec<usize>],
        wake: Tensor<4>,
    ) -> Self {
        let ([batch, _, rows, columns], device) = (wake.dims(), wake.device());
        let numbers: Vec<f32> = conditions.iter().flat_map(features).collect();
        let scenes: Vec<_> = conditions.iter().zip(cells).collect();
        let maps = scenes.par_iter().map(|(c, cells)| places(c, grid, cells));
        let places = maps.collect::<Vec<_>>().concat();
        let shape = [batch, PLACES, rows, columns];
        Self {
            numbers: Tensor::from_data(TensorData::new(numbers, [batch, FEATURES]), &device),
            places: Tensor::from_data(TensorData::new(places, shape), &device),
            wake,
        }
    }
}

/// Grey of the image expected of a scene over all its seas, [`expected_intensity`]; one grey if there is no ship.
///
/// # Errors
///
/// [`Error::Scene`](crate::Error::Scene) for a scene that is not valid or does not fit in memory.
pub fn expected_grey(scene: &Scene, scale: &GreyScale) -> Result<Vec<f32>> {
    scene.validate()?;
    if scene.ships.is_empty() {
        return Ok(vec![0.5; scene.grid.rows * scene.grid.columns]);
    }
    let intensity = expected_intensity(scene)?;
    Ok(intensity
        .values
        .iter()
        .map(|&power| scale.grey(f64::from(power)) as f32)
        .collect())
}

/// [`expected_grey`] of some scenes, on all cores; scenes that follow on their equal are imaged once.
///
/// # Errors
///
/// As [`expected_grey`].
pub(crate) fn expected_greys(scenes: &[Scene], scale: &GreyScale) -> Result<Vec<Vec<f32>>> {
    runs_of_equals(scenes, |scene| expected_grey(scene, scale))
}

/// Latents of the images expected of some scenes of one size, see [`expected_grey`].
///
/// # Shapes
///
/// `[scenes, channels, rows / 8, columns / 8]`, on the device of `patches`
///
/// # Errors
///
/// As [`expected_grey`].
pub fn expected_latents(
    scenes: &[Scene],
    scale: &GreyScale,
    patches: &PatchTransform,
) -> Result<Tensor<4>> {
    let images = expected_greys(scenes, scale)?;
    Ok(latents_of(scenes, images, patches))
}

/// Latents of an image of each scene.
pub(crate) fn latents_of(
    scenes: &[Scene],
    images: Vec<Vec<f32>>,
    patches: &PatchTransform,
) -> Tensor<4> {
    let [rows, columns] = scenes
        .first()
        .map_or([0, 0], |scene| [scene.grid.rows, scene.grid.columns]);
    let data = TensorData::new(images.concat(), [scenes.len(), 1, rows, columns]);
    patches.encode(Tensor::from_data(data, &patches.device())).0
}

/// A function of every scene, which does not depend on its seed: found once for scenes that follow on their equal, for
/// several at once on all cores.
pub(super) fn runs_of_equals<T: Clone + Send>(
    scenes: &[Scene],
    find: impl Fn(&Scene) -> Result<T> + Sync,
) -> Result<Vec<T>> {
    let seedless = |scene: &Scene| Scene {
        seed: 0,
        ..scene.clone()
    };
    let scenes: Vec<Scene> = scenes.iter().map(seedless).collect();
    let runs: Vec<&[Scene]> = scenes.chunk_by(|a, b| a == b).collect();
    let found: Vec<Result<T>> = runs.par_iter().map(|run| find(&run[0])).collect();
    let mut all = Vec::with_capacity(scenes.len());
    for (run, value) in runs.iter().zip(found) {
        all.extend(vec![value?; run.len()]);
    }
    Ok(all)
}

#[cfg(all(test, feature = "flex"))]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;

    #[test]
    fn open_sea_has_no_latents_and_each_wake_its_own() {
        let device = burn::tensor::Device::flex();
        let mut scene = Scene::default();
        (scene.grid.rows, scene.grid.columns, scene.grid.spacing) = (64, 64, 4.0);
        let mut other = scene.clone();
        other.ships[0].heading += 90.0;
        let calm = Scene {
            ships: Vec::new(),
            ..scene.clone()
        };
        let scale = GreyScale::default();
        let images = [&scene, &other].map(|scene| expected_grey(scene, &scale).unwrap());
        let pixels = images.iter().map(Vec::as_slice);
        let (patches, _) = PatchTransform::fit(pixels, 64, 4, &device);
        let same = Scene {
            seed: scene.seed + 1,
            ..scene.clone()
        };
        let all = [scene.clone(), same, other, calm, scene];
        let latents = expected_latents(&all, &scale, &patches).unwrap();
        assert_eq!(latents.dims(), [5, 4, 8, 8]);
        let of = |k: usize| latents.clone().narrow(0, k, 1);
        let distance = |a, b| (of(a) - of(b)).abs().max().into_scalar::<f32>();
        assert!(distance(0, 1) == 0.0 && distance(0, 4) == 0.0);
        assert!(distance(0, 2) > 0.1);
        // 0.5 less its mean, by f32.
        assert!(of(3).abs().max().into_scalar::<f32>() < 1e-4);
    }
}
