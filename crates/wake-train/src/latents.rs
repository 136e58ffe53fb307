//! Training examples as latents in memory.

use burn::module::Module;
use burn::tensor::{Device, Tensor, TensorData};
use half::f16;
use rayon::prelude::*;
use wake_physics::Scene;

use crate::error::{Error, Result};
use wake_dataset::{Pair, Source};
use wake_ldm::network::{
    ConditioningInputs, ExplainedVariance, PatchTransform, PhysicsPrior, Prior, WakeModelConfig,
    expected_grey,
};

/// Images read or simulated at the same time.
const AT_ONCE: u64 = 64;
/// The patch transform is fitted to residuals of grey, image less expected image, each scaled to this standard deviation;
/// those with less than the least deviation are scaled as if they had that.
const DEVIATION: f32 = 0.05;
const LEAST_DEVIATION: f32 = 1e-3;
/// Examples whose residuals are computed at once.
const RESIDUALS: usize = 8;

/// Data of an example besides its latents.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Example {
    /// The scene that made the image.
    pub scene: Scene,
    /// Mean grey of the image minus mean grey of the expected image.
    pub grey: f32,
    /// Log standard deviations of the sea in the channels, see [`PhysicsPrior`].
    pub log_deviations: Vec<f32>,
}

/// Latents of many images and of the expected images of their scenes, 16 bits per number.
#[derive(Debug, Default)]
pub(crate) struct LatentSet {
    shape: [usize; 3],
    latents: Vec<f16>,
    expected: Vec<f16>,
    examples: Vec<Example>,
}

/// Fits the patch transform to residuals of the first images of a source, and returns it with the variance it explains.
///
/// - `config`: size of the transform, and grey mapping of the images
/// - `done`: called with the number of images after each batch is read
///
/// # Errors
///
/// As [`Source::items`], and [`Error::Scene`] for a scene that is not valid.
pub(crate) fn fit_patches(
    source: &dyn Source,
    count: u64,
    config: &WakeModelConfig,
    device: &Device,
    mut done: impl FnMut(u64),
) -> Result<(PatchTransform, ExplainedVariance)> {
    let mut images = Vec::new();
    for first in (0..count).step_by(AT_ONCE as usize) {
        let pairs = source.items(first..count.min(first + AT_ONCE))?;
        done(pairs.len() as u64);
        let left = pairs.into_par_iter().map(|pair| beyond(pair, config));
        images.extend(left.collect::<Result<Vec<_>>>()?);
    }
    let pixels = images.iter().map(Vec::as_slice);
    let (size, channels) = (config.image_size, config.latent_channels);
    Ok(PatchTransform::fit(pixels, size, channels, device))
}

/// Residual of an image from the expected one, scaled to the standard deviation `DEVIATION`.
fn beyond(pair: Pair, config: &WakeModelConfig) -> Result<Vec<f32>> {
    let expected = expected_grey(&pair.scene, &config.grey)?;
    let mut left = pair.image.pixels;
    left.iter_mut()
        .zip(&expected)
        .for_each(|(grey, expected)| *grey -= expected);
    let count = left.len() as f32;
    let mean = left.iter().sum::<f32>() / count;
    let variance = left.iter().map(|grey| (grey - mean).powi(2)).sum::<f32>() / count;
    let factor = DEVIATION / variance.sqrt().max(LEAST_DEVIATION);
    left.iter_mut().for_each(|grey| *grey *= factor);
    Ok(left)
}

impl LatentSet {
    /// Encodes the first pairs of a source and the expected images of their scenes.
    ///
    /// - `done`: called with the number of pairs after each batch
    ///
    /// # Errors
    ///
    /// As [`Source::items`] and [`extend`](Self::extend), and [`Error::Scene`] for a scene that is not valid.
    pub(crate) fn of(
        source: &dyn Source,
        count: u64,
        config: &WakeModelConfig,
        patches: &PatchTransform,
        mut done: impl FnMut(u64),
    ) -> Result<Self> {
        let mut set = Self::default();
        for first in (0..count).step_by(AT_ONCE as usize) {
            let read = |pair: Pair| -> Result<_> {
                let Pair { image, scene, .. } = pair;
                let physics = PhysicsPrior::new(&scene, &config.grey, patches)?;
                Ok((image.pixels, physics, scene))
            };
            let pairs = source.items(first..count.min(first + AT_ONCE))?;
            let count = pairs.len() as u64;
            let pairs = pairs.into_par_iter().map(read);
            set.extend(patches, pairs.collect::<Result<_>>()?)?;
            done(count);
        }
        Ok(set)
    }

    /// Memory of the latents of `pairs` pairs \[bytes\].
    pub(crate) fn bytes(config: &WakeModelConfig, pairs: u64) -> u64 {
        // Image and expected image: two 16-bit numbers per latent.
        let each = 4 * config.latent_channels * config.latent_size().pow(2);
        pairs.saturating_mul(each as u64)
    }

    /// Encodes images on all cores and adds them in order.
    ///
    /// - `pairs`: grey of an image row by row, the physics prior of its scene, and the scene
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::InvalidOption`] for an image that is not square, or whose size differs from its grid or earlier images.
    pub(crate) fn extend(
        &mut self,
        transform: &PatchTransform,
        pairs: Vec<(Vec<f32>, PhysicsPrior, Scene)>,
    ) -> Result<()> {
        let device = transform.devices().into_iter().next().unwrap_or_default();
        let encoded = pairs.into_par_iter().map(|(image, physics, scene)| {
            let images = [image, physics.grey];
            let (size, columns) = (scene.grid.rows, scene.grid.columns);
            if size != columns || images.iter().any(|image| image.len() != size * size) {
                return Err(Error::Value(wake_nn::Error::InvalidOption {
                    option: "grid".to_owned(),
                    value: format!("{size} x {columns} pixels"),
                    expected: format!("a square with the {} pixels of the image", images[0].len()),
                }));
            }
            let data = TensorData::new(images.concat(), [2, 1, size, size]);
            let (latents, grey) = transform.encode(Tensor::from_data(data, &device));
            let [_, channels, rows, columns] = latents.dims();
            let grey = grey.clone().narrow(0, 0, 1) - grey.narrow(0, 1, 1);
            let example = Example {
                scene,
                grey: grey.into_scalar::<f32>(),
                log_deviations: physics.log_deviations,
            };
            Ok(([channels, rows, columns], halves(latents), example))
        });
        for encoded in encoded.collect::<Vec<_>>() {
            let (shape, latents, example) = encoded?;
            if !self.examples.is_empty() && shape != self.shape {
                return Err(Error::Value(wake_nn::Error::InvalidOption {
                    option: "image size".to_owned(),
                    value: (8 * shape[1]).to_string(),
                    expected: format!("{}, as in the images before", 8 * self.shape[1]),
                }));
            }
            self.shape = shape;
            let (image, expected) = latents.split_at(latents.len() / 2);
            self.latents.extend(image);
            self.expected.extend(expected);
            self.examples.push(example);
        }
        Ok(())
    }

    /// Residuals of the latents from the mean and spread of a prior, computed on all cores.
    ///
    /// - `done`: called from several threads with the number of examples just done
    pub(crate) fn residuals(&self, prior: &Prior, done: impl Fn(usize) + Sync) -> Self {
        let all: Vec<usize> = (0..self.len()).collect();
        let chunks: Vec<&[usize]> = all.chunks(RESIDUALS).collect();
        let residuals = chunks.par_iter().map(|indices| {
            let residuals = self.residual(indices, prior);
            done(indices.len());
            residuals
        });
        let residuals: Vec<Vec<f16>> = residuals.collect();
        Self {
            shape: self.shape,
            latents: residuals.concat(),
            expected: self.expected.clone(),
            examples: self.examples.clone(),
        }
    }

    fn residual(&self, indices: &[usize], prior: &Prior) -> Vec<f16> {
        let device = prior.devices().into_iter().next().unwrap_or_default();
        let expected = prior.forward(&self.inputs(indices, &device));
        halves(expected.residual(self.latents(indices, &device)))
    }

    /// Number of examples.
    pub(crate) fn len(&self) -> usize {
        self.examples.len()
    }

    /// Channels, rows and columns of the latents.
    pub(crate) fn shape(&self) -> [usize; 3] {
        self.shape
    }

    /// One example.
    pub(crate) fn example(&self, index: usize) -> &Example {
        &self.examples[index]
    }

    /// Scenes of some examples.
    pub(super) fn scenes(&self, indices: &[usize]) -> Vec<Scene> {
        let scenes = indices.iter().map(|&i| &self.examples[i].scene);
        scenes.cloned().collect()
    }

    /// Log standard deviations of the channels of some examples, concatenated.
    pub(super) fn log_deviations(&self, indices: &[usize]) -> Vec<f32> {
        let examples = indices.iter().map(|&i| &self.examples[i]);
        examples
            .flat_map(|example| &example.log_deviations)
            .copied()
            .collect()
    }

    /// Conditioning inputs of some examples.
    pub(crate) fn inputs(&self, indices: &[usize], device: &Device) -> ConditioningInputs {
        let wake = self.expected(indices, device);
        ConditioningInputs::new(&self.scenes(indices), wake, &self.log_deviations(indices))
    }

    /// Some latent pixels of one example, `[channels, cells]`.
    pub(crate) fn pixels(&self, index: usize, cells: &[usize]) -> Vec<f32> {
        self.some(&self.latents, index, cells)
    }

    /// The same pixels of the expected image.
    pub(super) fn expected_pixels(&self, index: usize, cells: &[usize]) -> Vec<f32> {
        self.some(&self.expected, index, cells)
    }

    /// Latents of some examples, `[indices, channels, rows, columns]`.
    pub(crate) fn latents(&self, indices: &[usize], device: &Device) -> Tensor<4> {
        batch(&self.latents, self.shape, indices, device)
    }

    /// Latents of the expected images of some examples.
    pub(crate) fn expected(&self, indices: &[usize], device: &Device) -> Tensor<4> {
        batch(&self.expected, self.shape, indices, device)
    }

    fn some(&self, images: &[f16], index: usize, cells: &[usize]) -> Vec<f32> {
        let [channels, rows, columns] = self.shape;
        let image = &images[index * channels * rows * columns..];
        let of_channel = |channel: usize| cells.iter().map(move |c| channel * rows * columns + c);
        let places = (0..channels).flat_map(of_channel);
        places.map(|i| image[i].to_f32()).collect()
    }
}

/// Batch of selected images of one shape, `[indices, channels, rows, columns]`.
pub(super) fn batch(
    images: &[f16],
    [channels, rows, columns]: [usize; 3],
    indices: &[usize],
    device: &Device,
) -> Tensor<4> {
    let length = channels * rows * columns;
    let numbers: Vec<f32> = indices
        .iter()
        .flat_map(|&i| &images[i * length..(i + 1) * length])
        .map(|x| x.to_f32())
        .collect();
    let shape = [indices.len(), channels, rows, columns];
    Tensor::from_data(TensorData::new(numbers, shape), device)
}

/// The numbers of a tensor in 16 bits.
fn halves(tensor: Tensor<4>) -> Vec<f16> {
    let data = tensor.into_data();
    data.iter::<f32>().map(f16::from_f32).collect()
}
