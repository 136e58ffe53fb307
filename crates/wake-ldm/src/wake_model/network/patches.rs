//! Autoencoder in closed form: overlapping squares of pixels as a few whitened principal components.

use burn::module::{Module, Param};
use burn::tensor::{Device, Tensor, TensorData};

use super::overlap::{self, PIXELS, REACH};
use crate::eigen::symmetric_eigen;
use crate::wake_model::conditioning::PATCH_SIZE;
use wake_nn::patch::{depth_to_space, space_to_depth};

/// Rows and columns of pixels covered by one latent pixel.
pub(super) const WINDOW: usize = PATCH_SIZE + 2 * REACH;

/// Linear map between overlapping squares of 8 × 8 pixels and a few numbers, in both directions.
///
/// ```text
/// z = W p,    p ≈ V z,    W = Λ^(−1/2) Eᵀ,  V = E Λ^(1/2)
/// ```
///
/// - p: a square of the grey of an image minus its mean, after an orthogonal filter across the borders of squares
///   (`overlap.rs`): each p depends on 16 × 16 pixels, so that omitted or wrong components leave no edges
/// - E, Λ: the first principal components of such squares and their variances
///
/// Each z has variance 1 over the data. No other linear map of p to as many numbers loses less.
///
/// # References
///
/// Pearson (1901), "On Lines and Planes of Closest Fit to Systems of Points in Space"; Malvar & Staelin (1989), "The LOT:
/// Transform Coding Without Blocking Effects".
#[derive(Module, Debug)]
pub struct PatchTransform {
    analysis: Param<Tensor<2>>,
    synthesis: Param<Tensor<2>>,
}

/// Variance explained by each principal component.
#[derive(Debug, Clone, PartialEq)]
pub struct ExplainedVariance {
    /// Variances in grey², in descending order.
    pub variances: Vec<f64>,
}

impl ExplainedVariance {
    /// Fraction of the variance in the first `channels`.
    pub fn kept(&self, channels: usize) -> f64 {
        let total: f64 = self.variances.iter().sum();
        self.variances.iter().take(channels).sum::<f64>() / total
    }

    /// Peak signal-to-noise ratio \[dB\] of images decoded from the first `channels`; the peak is 1.
    ///
    /// ```text
    /// PSNR = −10 log₁₀(Σ of the variances left out / 64)
    /// ```
    pub fn psnr(&self, channels: usize) -> f64 {
        let lost: f64 = self.variances.iter().skip(channels).sum();
        -10.0 * (lost / PIXELS as f64).log10()
    }
}

impl PatchTransform {
    /// Makes a transform that must be fitted or loaded.
    pub fn zeros(channels: usize, device: &Device) -> Self {
        Self {
            analysis: Param::from_tensor(Tensor::zeros([channels, PIXELS], device)),
            synthesis: Param::from_tensor(Tensor::zeros([PIXELS, channels], device)),
        }
    }

    /// Fits the transform to some images in closed form.
    ///
    /// - `images`: grey, each `size × size` pixels, in rows; `size` is a multiple of 8
    pub fn fit<'a>(
        images: impl Iterator<Item = &'a [f32]>,
        size: usize,
        channels: usize,
        device: &Device,
    ) -> (Self, ExplainedVariance) {
        let filtered = images.map(|image| {
            let data = TensorData::new(image.to_vec(), [1, 1, size, size]);
            let image = overlap::before_encoding(Tensor::from_data(data, device));
            image.into_data().iter::<f32>().collect()
        });
        let (values, vectors) = symmetric_eigen(covariance(filtered, size));
        let mut analysis = vec![0.0; channels * PIXELS];
        let mut synthesis = vec![0.0; PIXELS * channels];
        for (c, &value) in values.iter().take(channels).enumerate() {
            let deviation = value.max(1e-12).sqrt();
            for p in 0..PIXELS {
                analysis[c * PIXELS + p] = (vectors[p][c] / deviation) as f32;
                synthesis[p * channels + c] = (vectors[p][c] * deviation) as f32;
            }
        }
        let matrix = |numbers, shape: [usize; 2]| {
            Param::from_tensor(Tensor::from_data(TensorData::new(numbers, shape), device))
        };
        let transform = Self {
            analysis: matrix(analysis, [channels, PIXELS]),
            synthesis: matrix(synthesis, [PIXELS, channels]),
        };
        (transform, ExplainedVariance { variances: values })
    }

    /// Device of the transform.
    pub(super) fn device(&self) -> Device {
        self.analysis.val().device()
    }

    /// Weights of each channel for the pixels of a square and half of its neighbours, `[channels, 16 × 16]` in rows.
    pub fn windows(&self) -> Vec<f32> {
        let analysis = self.analysis.val();
        let [channels, _] = analysis.dims();
        let square = analysis.reshape([channels, PIXELS, 1, 1]);
        // The transpose of the filter is its inverse.
        let alone = square.pad((1, 1, 1, 1), 0.0);
        overlap::after_decoding(depth_to_space(alone, PATCH_SIZE))
            .narrow(2, PATCH_SIZE - REACH, WINDOW)
            .narrow(3, PATCH_SIZE - REACH, WINDOW)
            .into_data()
            .iter::<f32>()
            .collect()
    }

    /// Encodes images.
    ///
    /// # Shapes
    ///
    /// - `images`: `[batch, 1, rows, columns]`, multiples of 8, grey 0…1
    /// - result: latents `[batch, channels, rows / 8, columns / 8]` and the mean grey `[batch, 1]`
    pub fn encode(&self, images: Tensor<4>) -> (Tensor<4>, Tensor<2>) {
        let [batch, _, rows, columns] = images.dims();
        let mean = images.clone().reshape([batch, rows * columns]).mean_dim(1);
        let images = overlap::before_encoding(images - mean.clone().reshape([batch, 1, 1, 1]));
        let squares = space_to_depth(images, PATCH_SIZE);
        (mix(self.analysis.val(), squares), mean)
    }

    /// Decodes latents to grey; values may lie a little beyond 0…1.
    ///
    /// # Shapes
    ///
    /// - `latents`: `[batch, channels, rows, columns]`
    /// - `mean`: mean grey of each image, `[batch, 1]`
    /// - result: `[batch, 1, 8 rows, 8 columns]`
    pub fn decode(&self, latents: Tensor<4>, mean: Tensor<2>) -> Tensor<4> {
        let [batch, ..] = latents.dims();
        let squares = depth_to_space(mix(self.synthesis.val(), latents), PATCH_SIZE);
        overlap::after_decoding(squares) + mean.reshape([batch, 1, 1, 1])
    }
}

/// Applies a matrix to the channels of every pixel.
fn mix(matrix: Tensor<2>, image: Tensor<4>) -> Tensor<4> {
    let [batch, channels, rows, columns] = image.dims();
    let [out, _] = matrix.dims();
    let pixels = image.reshape([batch, channels, rows * columns]);
    matrix
        .unsqueeze::<3>()
        .matmul(pixels)
        .reshape([batch, out, rows, columns])
}

/// Covariance of the squares of images minus their means.
fn covariance(images: impl Iterator<Item = Vec<f32>>, size: usize) -> Vec<Vec<f64>> {
    let mut sums = vec![vec![0.0; PIXELS]; PIXELS];
    let mut count = 0.0;
    for image in images {
        let mean = image.iter().sum::<f32>() / image.len() as f32;
        for corner in 0..(size / PATCH_SIZE) * (size / PATCH_SIZE) {
            let start = corner / (size / PATCH_SIZE) * PATCH_SIZE * size
                + corner % (size / PATCH_SIZE) * PATCH_SIZE;
            let square: [f32; PIXELS] = std::array::from_fn(|p| {
                image[start + p / PATCH_SIZE * size + p % PATCH_SIZE] - mean
            });
            for (row, &a) in sums.iter_mut().zip(&square) {
                for (sum, &b) in row.iter_mut().zip(&square) {
                    *sum += f64::from(a * b);
                }
            }
            count += 1.0;
        }
    }
    for value in sums.iter_mut().flatten() {
        *value /= count;
    }
    sums
}

#[cfg(all(test, feature = "flex"))]
mod tests {
    use super::*;
    use wake_nn::noise::NoiseSource;
    use wake_physics::Field;
    use wake_physics::reference::seams;

    /// Waves of two directions, almost all of whose variance is in two components.
    fn images() -> Vec<Vec<f32>> {
        let wave = |k: [f64; 2], phase: f64| -> Vec<f32> {
            (0..64 * 64)
                .map(|i| {
                    let (y, x) = ((i / 64) as f64, (i % 64) as f64);
                    (0.5 + 0.1 * (k[0] * x + k[1] * y + phase).sin()) as f32
                })
                .collect()
        };
        (0..8).map(|i| wave([0.7, 0.05], f64::from(i))).collect()
    }

    #[test]
    fn decoding_loses_what_the_variances_say() {
        let images = images();
        let device = Device::flex();
        for channels in [1, 2] {
            let (transform, shares) =
                PatchTransform::fit(images.iter().map(Vec::as_slice), 64, channels, &device);
            let data = TensorData::new(images.concat(), [8, 1, 64, 64]);
            let batch = Tensor::<4>::from_data(data, &device);
            let (latents, mean) = transform.encode(batch.clone());
            let lost = (transform.decode(latents.clone(), mean) - batch)
                .square()
                .mean();
            let psnr = -10.0 * f64::from(lost.into_scalar::<f32>()).log10();
            // Two components give a PSNR of 60 dB and more, far from the rounding of f32 at 150 dB.
            assert!(
                (psnr - shares.psnr(channels)).abs() < 0.01,
                "{psnr} {shares:?}"
            );
            let variance = latents.square().mean().into_scalar::<f32>();
            assert!((variance - 1.0).abs() < 1e-3, "{variance}");
        }
    }

    #[test]
    fn a_channel_weighs_the_pixels_of_its_window() {
        let device = Device::flex();
        let images = images();
        let (transform, _) = PatchTransform::fit(images.iter().map(Vec::as_slice), 64, 3, &device);
        let windows = transform.windows();
        let (latents, mean) = {
            let data = TensorData::new(images[1].clone(), [1, 1, 64, 64]);
            transform.encode(Tensor::from_data(data, &device))
        };
        let mean = mean.into_scalar::<f32>();
        let latents: Vec<f32> = latents.into_data().iter::<f32>().collect();
        let (row, column) = (3, 5);
        for (c, window) in windows.chunks(WINDOW * WINDOW).enumerate() {
            let pixel = |n: usize| {
                let (i, j) = (8 * row - 4 + n / WINDOW, 8 * column - 4 + n % WINDOW);
                images[1][i * 64 + j] - mean
            };
            let sum: f32 = window.iter().enumerate().map(|(n, w)| w * pixel(n)).sum();
            let encoded = latents[(c * 8 + row) * 8 + column];
            // Latents are of order 1, and sums of 256 products in f32.
            assert!((sum - encoded).abs() < 1e-4, "{c}: {sum} {encoded}");
        }
    }

    /// Latents that are independent of their neighbours: without overlap, edges would be some 90 times the differences inside.
    #[test]
    fn squares_of_random_latents_have_no_edges() {
        let device = Device::flex();
        let images = images();
        let (transform, _) = PatchTransform::fit(images.iter().map(Vec::as_slice), 64, 2, &device);
        let random = NoiseSource::new(1).normal(0, 2 * 32 * 32);
        let latents = Tensor::from_data(TensorData::new(random, [1, 2, 32, 32]), &device);
        let image = transform.decode(latents, Tensor::zeros([1, 1], &device));
        let field = Field {
            rows: 256,
            columns: 256,
            values: image.into_data().iter::<f32>().collect(),
        };
        let seams = seams(&field, PATCH_SIZE).unwrap_or(f64::INFINITY);
        assert!(seams < 3.0, "{seams}");
    }
}
