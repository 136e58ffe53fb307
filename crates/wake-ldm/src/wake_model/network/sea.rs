//! Initial noise of a flow: seas to first order.

use burn::tensor::{Tensor, TensorData};
use rayon::prelude::*;
use wake_physics::{LinearSea, Scene};

use super::inputs::{images_of, runs_of_equals};
use super::patches::PatchTransform;
use super::windows::ChannelWindows;
use crate::error::Result;
use crate::streams::{INITIAL_STREAM, WHITE_STREAM};
use wake_nn::noise::{NoiseSource, normal_batch};

/// White share of the noise in every channel, from which components beyond the first order can start.
const WHITE: f64 = 0.05;

/// Gaussian noise in the latents of a scene, with variance 1 in every channel and the correlation of its sea.
///
/// ```text
/// n = √(1 − ε) f/√(var f) + √ε g
/// ```
///
/// - f: latents of a [`LinearSea`] of the scene, with their variance in each channel
/// - g: white noise; the only term if the sea has no waves
///
/// # References
///
/// Lee et al. (2022), "`PriorGrad`", section 3 (noise with the variance of the data); Kollovieh et al. (2024), "Flow
/// Matching with Gaussian Process Priors for Probabilistic Time Series Forecasting".
#[derive(Debug, Clone)]
struct SeaNoise {
    sea: LinearSea,
    /// Variances of the relative intensity in the channels.
    variances: Vec<f64>,
    /// Factors of f, and of g, in each channel.
    shares: Vec<[f32; 2]>,
}

impl SeaNoise {
    /// Noise of a scene, with or without its ship.
    ///
    /// # Errors
    ///
    /// [`Error::Scene`](crate::Error::Scene) for a scene that is invalid or does not fit in memory.
    fn new(scene: &Scene, channels: &ChannelWindows) -> Result<Self> {
        let sea = LinearSea::new(scene)?;
        let share = |variance: f64| match variance {
            0.0 => [0.0, 1.0],
            _ => [((1.0 - WHITE) / variance).sqrt(), WHITE.sqrt()].map(|x| x as f32),
        };
        let variances = channels.variances(&sea);
        Ok(Self {
            shares: variances.iter().copied().map(share).collect(),
            variances,
            sea,
        })
    }

    /// Sea of a source, `[rows, columns]` of the scene.
    fn field(&self, source: NoiseSource) -> Vec<f32> {
        let normals = source.normal(INITIAL_STREAM, self.sea.normals());
        self.sea.field(&normals).values
    }
}

/// Seas of some scenes, each from its own source, before they are encoded.
#[derive(Debug)]
pub struct SeaFields {
    seas: Vec<SeaNoise>,
    fields: Vec<Vec<f32>>,
}

impl SeaFields {
    /// Draws the seas of scenes of one size, on all cores; the spectrum of equal scenes in succession is computed once.
    ///
    /// # Errors
    ///
    /// [`Error::Scene`](crate::Error::Scene) for a scene that is invalid or does not fit in memory.
    pub fn new(
        scenes: &[Scene],
        sources: &[NoiseSource],
        channels: &ChannelWindows,
    ) -> Result<Self> {
        let seas = runs_of_equals(scenes, |scene| SeaNoise::new(scene, channels))?;
        let drawn = seas.par_iter().zip(sources);
        let fields = drawn.map(|(sea, &source)| sea.field(source)).collect();
        Ok(Self { seas, fields })
    }

    /// [`PhysicsPrior::log_deviations`](super::PhysicsPrior::log_deviations) of each scene, scene by scene.
    ///
    /// - `slopes`: derivative of the grey with respect to the relative intensity, for each scene
    pub fn log_deviations(&self, channels: &ChannelWindows, slopes: &[f64]) -> Vec<f32> {
        let scenes = self.seas.iter().zip(slopes);
        scenes
            .flat_map(|(sea, &slope)| channels.of_variances(&sea.variances, slope))
            .collect()
    }

    /// Encodes the seas and adds white noise, which gives the noise in latents.
    ///
    /// # Shapes
    ///
    /// `[scenes, channels, rows / 8, columns / 8]`, on the device of `patches`
    pub fn noise(
        self,
        scenes: &[Scene],
        sources: &[NoiseSource],
        patches: &PatchTransform,
    ) -> Tensor<4> {
        let device = patches.device();
        let waves = patches.encode(images_of(scenes, &self.fields, patches)).0;
        let [batch, channels, rows, columns] = waves.dims();
        let white = normal_batch(sources, WHITE_STREAM, [channels, rows, columns], &device);
        let factor = |which: usize| -> Tensor<4> {
            let shares = self.seas.iter().flat_map(|sea| &sea.shares);
            let factors: Vec<f32> = shares.map(|share| share[which]).collect();
            Tensor::from_data(TensorData::new(factors, [batch, channels, 1, 1]), &device)
        };
        waves * factor(0) + white * factor(1)
    }
}

#[cfg(all(test, feature = "flex"))]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;
    use burn::tensor::Device;
    use wake_physics::grey::GreyScale;
    use wake_physics::simulate;

    fn scene(seed: u64) -> Scene {
        let mut scene = Scene::default();
        (scene.grid.rows, scene.grid.columns, scene.grid.spacing) = (128, 128, 4.0);
        scene.sea.wind_speed = 5.0;
        scene.ships.clear();
        scene.seed = seed;
        scene
    }

    /// Grey of a simulated open sea.
    fn grey(scene: &Scene) -> Vec<f32> {
        let scale = GreyScale::default();
        let values = simulate(scene).unwrap().intensity.values;
        values
            .iter()
            .map(|&v| scale.grey(f64::from(v)) as f32)
            .collect()
    }

    fn patches(images: &[Vec<f32>]) -> PatchTransform {
        let pixels = images.iter().map(Vec::as_slice);
        PatchTransform::fit(pixels, 128, 16, &Device::flex()).0
    }

    fn sea_noise(scenes: &[Scene], sources: &[NoiseSource], patches: &PatchTransform) -> Tensor<4> {
        let seas = SeaFields::new(scenes, sources, &ChannelWindows::new(patches)).unwrap();
        seas.noise(scenes, sources, patches)
    }

    fn numbers(tensor: Tensor<4>) -> Vec<f32> {
        tensor.into_data().iter::<f32>().collect()
    }

    #[test]
    fn every_channel_has_variance_one() {
        let patches = patches(&[grey(&scene(1)), grey(&scene(2))]);
        let noise_of =
            |scene: Scene, seed: u64| sea_noise(&[scene], &[NoiseSource::new(seed)], &patches);
        let mut sums = [0.0; 16];
        let draws = 40;
        for seed in 0..draws {
            let noise = numbers(noise_of(scene(0), seed));
            for (channel, pixels) in noise.chunks(256).enumerate() {
                sums[channel] += pixels.iter().map(|&x| f64::from(x).powi(2)).sum::<f64>();
            }
        }
        for sum in sums {
            let variance = sum / (draws * 256) as f64;
            // 10,240 numbers with short correlations: at least 500 independent ones, so 6 % of error, times 4.
            assert!((variance - 1.0).abs() < 0.25, "{variance}");
        }
        let again = sea_noise(
            &[scene(5), scene(6)],
            &[3, 4].map(NoiseSource::new),
            &patches,
        );
        let one = noise_of(scene(0), 4);
        let second = again.narrow(0, 1, 1);
        assert_eq!(numbers(second), numbers(one));
    }

    /// Correlations of channels 0…5 of a latent pixel with the same channels of the pixels to its right, below it, and below to its right.
    fn correlations(images: &[Vec<f32>]) -> Vec<f64> {
        let at = |z: &[f32], c: usize, i: usize, j: usize| f64::from(z[(c * 16 + i) * 16 + j]);
        let mut all = Vec::new();
        for (down, right) in [(0, 1), (1, 0), (1, 1)] {
            for (a, b) in (0..36).map(|n| (n / 6, n % 6)) {
                let mut sums = [0.0; 3];
                for z in images {
                    for (i, j) in (0..225).map(|n| (n / 15, n % 15)) {
                        let (x, y) = (at(z, a, i, j), at(z, b, i + down, j + right));
                        sums[0] += x * y;
                        sums[1] += x * x;
                        sums[2] += y * y;
                    }
                }
                all.push(sums[0] / (sums[1] * sums[2]).sqrt());
            }
        }
        all
    }

    /// Neighbouring latents of the noise have the correlations of the linear sea except for the white share, and nearly the
    /// same pattern as those of the simulator's sea.
    #[test]
    fn noise_is_correlated_as_the_sea_is() {
        const SEAS: u64 = 48;
        let seas: Vec<Vec<f32>> = (1..=SEAS).map(|seed| grey(&scene(seed))).collect();
        let patches = patches(&seas);
        let encoded = |image: Vec<f32>| {
            let data = TensorData::new(image, [1, 1, 128, 128]);
            numbers(patches.encode(Tensor::from_data(data, &Device::flex())).0)
        };
        let linear_sea = |scene: &Scene| {
            let sea = LinearSea::new(scene).unwrap();
            let drawn = |seed| {
                let normals = NoiseSource::new(seed + 1000).normal(INITIAL_STREAM, sea.normals());
                encoded(sea.field(&normals).values)
            };
            correlations(&(0..SEAS).map(drawn).collect::<Vec<_>>())
        };
        let mut turned = scene(0);
        turned.sea.wind_toward += 90.0;
        let drawn = |seed| {
            let sources = [NoiseSource::new(seed)];
            numbers(sea_noise(&[scene(0)], &sources, &patches))
        };
        let [linear, turned] = [&scene(0), &turned].map(linear_sea);
        let drawn = correlations(&(0..SEAS).map(drawn).collect::<Vec<_>>());
        let simulated = correlations(&seas.into_iter().map(encoded).collect::<Vec<_>>());
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
        let likeness = |a: &[f64], b: &[f64]| dot(a, b) / (dot(a, a) * dot(b, b)).sqrt();
        let slope = dot(&linear, &drawn) / dot(&linear, &linear);
        // Correlations have a root mean square of 0.09; 10,800 pairs of latents give a standard error of 0.012 each.
        assert!((slope - (1.0 - WHITE)).abs() < 0.04, "{slope}");
        let [same, other] = [&drawn, &turned].map(|seas| likeness(&simulated, seas));
        assert!(same > 0.85 && other < 0.6, "{same} {other}");
    }

    #[test]
    fn noise_of_a_flat_sea_is_white() {
        let patches = patches(&[grey(&scene(1))]);
        let mut calm = scene(0);
        calm.sea.wind_speed = 0.0;
        let drawn = sea_noise(&[calm], &[NoiseSource::new(1)], &patches);
        let white = normal_batch(
            &[NoiseSource::new(1)],
            WHITE_STREAM,
            [16, 16, 16],
            &Device::flex(),
        );
        assert_eq!(numbers(drawn), numbers(white));
    }
}
