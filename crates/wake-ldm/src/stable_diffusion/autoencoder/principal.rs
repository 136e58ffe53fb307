//! Linear autoencoder, fitted in closed form: principal components of squares of pixels.

use burn::module::Param;
use burn::tensor::{Device, Tensor, TensorData};
use wake_nn::patch::space_to_depth;

use super::{AutoencoderKl, AutoencoderKlConfig};
use crate::eigen::symmetric_eigen;

/// Smallest variance of a component relative to the largest that is amplified in full.
const SMALLEST: f64 = 1e-8;
/// Logarithm of the posterior variances: encoding has no noise.
const LOG_VARIANCE: f32 = -30.0;

impl AutoencoderKlConfig {
    /// Fits a linear model to images.
    ///
    /// ```text
    /// cov p = E Λ Eᵀ        p: a square of patch_size × patch_size pixels
    /// z = s Λ^(−¼) Eᵀ (p − mean p),    p ≈ E Λ^¼ z/s + mean p        E, Λ: as many components as latent channels
    /// ```
    ///
    /// No other linear map of squares to as many numbers loses less. The z are uncorrelated, with mean 0 and a mean variance of 1
    /// over the images (s). With Λ⁰, weak components, which hold the waves, would lie below the noise of all diffusion steps;
    /// with Λ^(−½), small errors of the strongest, the brightness, would hide the waves.
    ///
    /// - `batches`: images in [−1, 1], each `[batch, in_channels, rows, columns]` with rows and columns that are multiples of
    ///   `patch_size`; at least one
    ///
    /// # Panics
    ///
    /// When [`validate`](Self::validate) fails, the configuration has levels, or the images have another number of channels.
    ///
    /// # References
    ///
    /// Pearson (1901), "On Lines and Planes of Closest Fit to Systems of Points in Space".
    pub fn fit(&self, batches: impl Iterator<Item = Tensor<4>>, device: &Device) -> AutoencoderKl {
        assert!(self.is_linear(), "an autoencoder without levels");
        let (mean, covariance) = moments(batches, self.patch_size);
        let (pixels, channels) = (mean.len(), self.latent_channels);
        let (variances, vectors) = symmetric_eigen(covariance);
        let floor = (SMALLEST * variances[0]).max(f64::MIN_POSITIVE);
        let kept = variances[..channels].iter().map(|v| v.max(floor).sqrt());
        let deviations: Vec<f64> = kept.collect();
        let mean_deviation = deviations.iter().sum::<f64>() / channels as f64;
        // z of one component, over its pixels: Λ^(−¼) s.
        let gain = |component: usize| (deviations[component] * mean_deviation).sqrt().recip();
        let mut analysis = Vec::with_capacity(2 * channels * pixels);
        let mut offsets = Vec::with_capacity(2 * channels);
        for component in 0..channels {
            let row: Vec<f64> = (vectors.iter())
                .map(|of_pixel| of_pixel[component] * gain(component))
                .collect();
            let offset: f64 = row
                .iter()
                .zip(&mean)
                .map(|(weight, mean)| weight * mean)
                .sum();
            offsets.push(-offset as f32);
            analysis.extend(row.into_iter().map(|weight| weight as f32));
        }
        analysis.resize(2 * channels * pixels, 0.0);
        offsets.resize(2 * channels, LOG_VARIANCE);
        let synthesis = vectors.iter().flat_map(|of_pixel| {
            (0..channels).map(|component| (of_pixel[component] / gain(component)) as f32)
        });
        let synthesis = synthesis.collect();
        let mean = mean.into_iter().map(|grey| grey as f32).collect();

        let mut model = self.init(device);
        let layers = [
            (&mut model.quant_conv, analysis, offsets, pixels),
            (&mut model.post_quant_conv, synthesis, mean, channels),
        ];
        for (layer, weights, bias, inputs) in layers {
            let shape = [bias.len(), inputs, 1, 1];
            if let Some(layer) = layer {
                layer.weight = parameter(weights, shape, device);
                layer.bias = Some(parameter(bias, [shape[0]], device));
            }
        }
        model
    }
}

fn parameter<const D: usize>(
    numbers: Vec<f32>,
    shape: [usize; D],
    device: &Device,
) -> Param<Tensor<D>> {
    Param::from_tensor(Tensor::from_data(TensorData::new(numbers, shape), device))
}

/// Mean and covariance of the squares of pixels of images.
fn moments(batches: impl Iterator<Item = Tensor<4>>, side: usize) -> (Vec<f64>, Vec<Vec<f64>>) {
    let (mut count, mut sums, mut products) = (0.0, Vec::new(), Vec::new());
    // Sums of 32 bits keep small variances if the squares are near 0.
    let mut middle: Option<Tensor<2>> = None;
    for images in batches {
        let squares = space_to_depth(images, side).swap_dims(0, 1);
        let [pixels, batch, rows, columns] = squares.dims();
        let squares = squares.reshape([pixels, batch * rows * columns]);
        let middle = middle.get_or_insert_with(|| squares.clone().mean_dim(1));
        let squares = squares - middle.clone();
        count += (batch * rows * columns) as f64;
        add(&mut sums, squares.clone().sum_dim(1));
        add(&mut products, squares.clone().matmul(squares.transpose()));
    }
    let pixels = sums.len();
    let off: Vec<f64> = sums.into_iter().map(|sum| sum / count).collect();
    let covariance = products.chunks(pixels.max(1)).zip(&off).map(|(row, a)| {
        row.iter()
            .zip(&off)
            .map(|(product, b)| product / count - a * b)
            .collect()
    });
    let middle = middle.map(|middle| middle.into_data().iter::<f64>().collect::<Vec<_>>());
    let mean = middle
        .unwrap_or_default()
        .into_iter()
        .zip(&off)
        .map(|(m, off)| m + off);
    (mean.collect(), covariance.collect())
}

/// Adds the numbers of a tensor to sums, which are none at first.
fn add(sums: &mut Vec<f64>, numbers: Tensor<2>) {
    let numbers = numbers.into_data();
    sums.resize(numbers.num_elements(), 0.0);
    for (sum, number) in sums.iter_mut().zip(numbers.iter::<f64>()) {
        *sum += number;
    }
}

#[cfg(all(test, feature = "flex"))]
mod tests {
    use super::*;

    /// Squares of 2 × 2 pixels m + a u + b v + c w, with three orthonormal patterns and independent a, b, c of known variances.
    fn images(device: &Device) -> Tensor<4> {
        let patterns: [[f32; 4]; 3] = [
            [0.5, 0.5, 0.5, 0.5],
            [0.5, -0.5, 0.5, -0.5],
            [0.5, 0.5, -0.5, -0.5],
        ];
        let mut pixels = vec![0.0; 16 * 16];
        for square in 0..64 {
            // All 64 combinations of four values each, −3, −1, 1 and 3, with variance 5.
            let value = |digit: u32| 2.0 * (square as u32 / 4u32.pow(digit) % 4) as f32 - 3.0;
            let sizes = [0.1 * value(0), 0.02 * value(1), 0.005 * value(2)];
            for p in 0..4 {
                let (row, column) = (square / 8 * 2 + p / 2, square % 8 * 2 + p % 2);
                let sum: f32 = patterns
                    .iter()
                    .zip(sizes)
                    .map(|(u, size)| u[p] * size)
                    .sum();
                pixels[row * 16 + column] = 0.25 + sum;
            }
        }
        Tensor::from_data(TensorData::new(pixels, [1, 1, 16, 16]), device)
    }

    #[test]
    fn the_components_are_those_of_the_images() {
        let device = Device::flex();
        let images = images(&device);
        let squares = |x: Tensor<4>| f64::from(x.square().mean().into_scalar::<f32>());
        // What is lost has a variance of 5 times the squared sizes of the patterns left out, over four pixels.
        for (channels, lost) in [(1, 5.0 * (4e-4 + 2.5e-5) / 4.0), (2, 5.0 * 2.5e-5 / 4.0)] {
            let config = AutoencoderKlConfig::linear(channels, 2);
            let model = config.fit([images.clone(), images.clone()].into_iter(), &device);
            let posterior = model.encode(images.clone());
            assert_eq!(posterior.mean.dims(), [1, channels, 8, 8]);
            assert!(squares(posterior.std()) < 1e-12);
            let z = posterior.mode();
            // Variances in proportion to the deviations of the components, with a mean of 1.
            let deviations = [0.1, 0.02];
            let mean = deviations[..channels].iter().sum::<f32>() / channels as f32;
            let pixels = z.clone().reshape([channels, 64]);
            let covariance = pixels.clone().matmul(pixels.clone().transpose()) / 64.0;
            let covariance: Vec<f32> = covariance.into_data().iter::<f32>().collect();
            // Numbers of 32 bits near 0.25, amplified to waves of 0.02 or more.
            let rounding = 8.0 * 0.25 * f32::EPSILON / 0.02;
            for (n, found) in covariance.iter().enumerate() {
                let variance = match n / channels == n % channels {
                    true => deviations[n / channels] / mean,
                    false => 0.0,
                };
                assert!((found - variance).abs() < rounding, "{covariance:?}");
            }
            let means = pixels.mean_dim(1).abs().max().into_scalar::<f32>();
            assert!(means < rounding, "{means}");
            let found = squares(model.decode(z) - images.clone());
            assert!(
                (found / lost - 1.0).abs() < 1e-3,
                "{channels}: {found:e} of {lost:e}"
            );
        }
    }

    /// A model in a file is the fitted one; its configuration has no levels.
    #[test]
    fn a_fitted_model_is_saved_and_read() {
        use wake_nn::weights::{Layout, Precision, save_folder};
        let device = Device::flex();
        let images = images(&device);
        let model = AutoencoderKlConfig::linear(3, 2).fit(std::iter::once(images.clone()), &device);
        let folder = tempfile::tempdir().unwrap();
        let config = model.config().to_json();
        let (layout, precision) = (Layout::Diffusers, Precision::F32);
        save_folder(&model, layout, &config, folder.path(), precision).unwrap();
        let read = AutoencoderKl::from_folder(folder.path(), &device).unwrap();
        assert_eq!((read.config(), read.downsampling()), (model.config(), 2));
        let numbers = |model: &AutoencoderKl| model.moments(images.clone()).into_data();
        assert_eq!(numbers(&read), numbers(&model));
        let without = AutoencoderKlConfig::linear(3, 2).with_quant_conv(false);
        let error = without.validate().unwrap_err().to_string();
        assert!(error.contains("block_out_channels is empty"), "{error}");
    }
}
