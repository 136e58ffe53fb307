//! Conditioning on a scene: its numbers, positions in the ship's frame, and the expected image.

use burn::tensor::{Tensor, TensorData};
use rayon::prelude::*;
use wake_physics::grey::GreyScale;
use wake_physics::{LinearSea, Scene, expected_intensity};

use super::patches::PatchTransform;
use super::windows::ChannelWindows;
use crate::error::Result;
use crate::wake_model::conditioning::{FEATURES, MapGrid, PLACES, features, places};

/// Conditioning of a batch of scenes.
#[derive(Debug, Clone)]
pub struct ConditioningInputs {
    /// Numbers of the scenes, `[batch, FEATURES]`.
    pub numbers: Tensor<2>,
    /// Position maps of the latent pixels, `[batch, PLACES, rows, columns]`.
    pub places: Tensor<4>,
    /// Latents of the expected images, `[batch, channels, rows, columns]`.
    pub wake: Tensor<4>,
    /// Logarithms of the linear sea's standard deviations in the channels, `[batch, channels]`.
    pub log_deviations: Tensor<2>,
}

impl ConditioningInputs {
    /// Conditioning of scenes at all latent pixels.
    ///
    /// - `wake`: see [`PhysicsPrior`]; the result is on the same device
    /// - `log_deviations`: of the channels, see [`PhysicsPrior`], scene by scene
    pub fn new(scenes: &[Scene], wake: Tensor<4>, log_deviations: &[f32]) -> Self {
        let cells: Vec<Vec<usize>> = scenes
            .iter()
            .map(|s| MapGrid::of(&s.grid).cells())
            .collect();
        Self::of_cells(scenes, &cells, wake, log_deviations)
    }

    /// Conditioning of scenes at some latent pixels.
    ///
    /// - `cells`: indices of the pixels of each scene
    /// - `wake`: at these pixels, `[batch, channels, rows, columns]`
    pub fn of_cells(
        scenes: &[Scene],
        cells: &[Vec<usize>],
        wake: Tensor<4>,
        log_deviations: &[f32],
    ) -> Self {
        let ([batch, channels, rows, columns], device) = (wake.dims(), wake.device());
        let numbers: Vec<f32> = scenes.iter().flat_map(features).collect();
        let pairs: Vec<_> = scenes.iter().zip(cells).collect();
        let maps = pairs.par_iter().map(|(scene, cells)| places(scene, cells));
        let places = maps.collect::<Vec<_>>().concat();
        let shape = [batch, PLACES, rows, columns];
        let deviations = TensorData::new(log_deviations.to_vec(), [batch, channels]);
        Self {
            numbers: Tensor::from_data(TensorData::new(numbers, [batch, FEATURES]), &device),
            places: Tensor::from_data(TensorData::new(places, shape), &device),
            wake,
            log_deviations: Tensor::from_data(deviations, &device),
        }
    }

    /// All conditioning that does not depend on the pixel, `[batch, FEATURES + channels]`.
    pub(super) fn told(&self) -> Tensor<2> {
        let deviations = self.log_deviations.clone() / LOG_DEVIATION;
        Tensor::cat(vec![self.numbers.clone(), deviations], 1)
    }
}

/// Unit of the logarithms of deviations.
const LOG_DEVIATION: f64 = 3.0;

/// Side of the image from which the mean of a uniform open sea is computed [pixels].
const EVEN: usize = 32;

/// Expected image and standard deviations of a scene, from physics.
#[derive(Debug, Clone)]
pub struct PhysicsPrior {
    /// Grey of the [`expected_intensity`], `[rows, columns]` of the scene.
    pub grey: Vec<f32>,
    /// Logarithm of the [`LinearSea`]'s standard deviation in each channel of the latents.
    pub log_deviations: Vec<f32>,
}

impl PhysicsPrior {
    /// Computes the prior of a scene for the latents of a transform.
    ///
    /// # Errors
    ///
    /// [`Error::Scene`](crate::Error::Scene) for a scene that is invalid or does not fit in memory.
    pub fn new(scene: &Scene, scale: &GreyScale, patches: &PatchTransform) -> Result<Self> {
        let grey = expected_grey(scene, scale)?;
        let (sea, windows) = (LinearSea::new(scene)?, ChannelWindows::new(patches));
        let log_deviations = windows.log_deviations(&sea, slope_of(&grey, scale));
        Ok(Self {
            grey,
            log_deviations,
        })
    }
}

/// Derivative of the grey with respect to the relative intensity, at the mean grey of an image.
pub fn slope_of(grey: &[f32], scale: &GreyScale) -> f64 {
    let mean = grey.iter().map(|&g| f64::from(g)).sum::<f64>() / grey.len().max(1) as f64;
    scale.slope(scale.sigma0(mean))
}

/// Grey of the expected image of a scene, averaged over all seas: [`expected_intensity`].
///
/// # Errors
///
/// [`Error::Scene`](crate::Error::Scene) for a scene that is invalid or does not fit in memory.
pub fn expected_grey(scene: &Scene, scale: &GreyScale) -> Result<Vec<f32>> {
    scene.validate()?;
    let grey = |power: &f32| scale.grey(f64::from(*power)) as f32;
    let pixels = scene.grid.rows * scene.grid.columns;
    if is_even(scene) && pixels > EVEN * EVEN {
        let mut small = scene.clone();
        (small.grid.rows, small.grid.columns) = (EVEN, EVEN);
        let mean = expected_intensity(&small)?.mean() as f32;
        return Ok(vec![grey(&mean); pixels]);
    }
    Ok(expected_intensity(scene)?.values.iter().map(grey).collect())
}

/// Whether the expected image of a scene is uniform.
fn is_even(scene: &Scene) -> bool {
    scene.ships.is_empty() && !is_drawn(scene)
}

/// Whether the expected image of a scene depends on the seed, as with random gusts, slicks and echoing points.
fn is_drawn(scene: &Scene) -> bool {
    let echoes = scene.ships.iter().any(|ship| ship.echo);
    let sea = &scene.sea;
    echoes || sea.gust_strength > 0.0 || sea.mottle_strength > 0.0 || sea.slick_damping > 0.0
}

/// [`expected_grey`] of some scenes, on all cores; equal scenes in succession are imaged once.
///
/// # Errors
///
/// As [`expected_grey`].
pub fn expected_greys(scenes: &[Scene], scale: &GreyScale) -> Result<Vec<Vec<f32>>> {
    runs_of_equals(scenes, |scene| expected_grey(scene, scale))
}

/// Images of scenes, all of one size, as `[scenes, 1, rows, columns]` on the device of `patches`.
pub fn images_of(scenes: &[Scene], images: &[Vec<f32>], patches: &PatchTransform) -> Tensor<4> {
    let [rows, columns] = scenes
        .first()
        .map_or([0, 0], |scene| [scene.grid.rows, scene.grid.columns]);
    let data = TensorData::new(images.concat(), [scenes.len(), 1, rows, columns]);
    Tensor::from_data(data, &patches.device())
}

/// Computes a function of every scene on all cores, once for equal scenes in succession.
///
/// Scenes may differ in their seeds if their expected images have no random parts.
pub(super) fn runs_of_equals<T: Clone + Send>(
    scenes: &[Scene],
    find: impl Fn(&Scene) -> Result<T> + Sync,
) -> Result<Vec<T>> {
    let seedless = |scene: &Scene| Scene {
        seed: if is_drawn(scene) { scene.seed } else { 0 },
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

    fn scene(assignments: &[&str]) -> Scene {
        let small = ["grid.rows=64", "grid.columns=64", "grid.spacing=4"];
        Scene::default()
            .with_assignments(&[&small[..], assignments].concat())
            .unwrap()
    }

    /// Each wake has its own image; the image of an open sea has one grey, the mean of all its pixels.
    #[test]
    fn open_sea_is_even_and_each_wake_its_own() {
        let scale = GreyScale::default();
        let (one, other) = (scene(&[]), scene(&["ship.heading=130"]));
        let mut calm = one.clone();
        calm.ships.clear();
        let images = [&one, &other, &calm].map(|scene| expected_grey(scene, &scale).unwrap());
        let distance = |a: &[f32], b: &[f32]| {
            let differences = a.iter().zip(b).map(|(a, b)| (a - b).abs());
            differences.fold(0f32, f32::max)
        };
        assert!(distance(&images[0], &images[1]) > 0.02);
        let whole = expected_intensity(&calm).unwrap();
        for power in whole.values {
            // The waves that are averaged are sampled on the image's own cells: 0.02 dB of brightness, for 40 dB of grey.
            let (grey, even) = (scale.grey(f64::from(power)) as f32, images[2][0]);
            assert!((grey - even).abs() < 5e-4, "{grey} {even}");
        }
        assert!(
            images[2]
                .iter()
                .all(|grey| grey.to_bits() == images[2][0].to_bits())
        );
    }

    /// Scenes that differ only in their seeds are imaged once, unless they have random gusts, slicks or echoes.
    #[test]
    fn the_seed_counts_where_something_is_drawn() {
        let scale = GreyScale::default();
        for (assignments, drawn) in [
            (vec![], false),
            (vec!["sea.gust_strength=0.1"], true),
            (vec!["sea.mottle_strength=0.1"], true),
            (
                vec![
                    "sea.slick_damping=0.5",
                    "sea.slick_scale=150",
                    "sea.slick_width=80",
                    "sea.wind_speed=3",
                ],
                true,
            ),
            (
                // A moving ship would be displaced out of such a small image.
                vec!["ship.echo=true", "ship.speed=0", "radar.range_resolution=6"],
                true,
            ),
        ] {
            let one = scene(&assignments);
            let other = Scene {
                seed: one.seed + 1,
                ..one.clone()
            };
            let images = expected_greys(&[one.clone(), other, one], &scale).unwrap();
            assert_eq!(images[0] != images[1], drawn, "{assignments:?}");
            assert_eq!(images[0], images[2]);
        }
    }
}
