//! Linear autoencoder, fitted in closed form: principal components of squares of pixels, decoded with those of their neighbours.

use burn::module::Param;
use burn::tensor::{Device, Tensor, TensorData};
use rayon::prelude::*;
use wake_nn::patch::space_to_depth;

use super::{AutoencoderKl, AutoencoderKlConfig};
use crate::eigen::symmetric_eigen;

/// Smallest variance of a component relative to the largest that is amplified in full.
const SMALLEST: f64 = 1e-8;
/// Logarithm of the posterior variances: encoding has no noise.
const LOG_VARIANCE: f32 = -30.0;
/// Squares along each axis from which a square is decoded.
const WINDOW: usize = 3;
/// Added to the variances of latents, which are 1 on average, for the decoder: more than the rounding of their sums.
const RIDGE: f64 = 1e-5;

impl AutoencoderKlConfig {
    /// Fits a linear model to images.
    ///
    /// ```text
    /// cov p = E Λ Eᵀ        p: a square of patch_size × patch_size pixels
    /// z = s Λ^(−¼) Eᵀ (p − mean p)                            E, Λ: as many components as latent channels
    /// p ≈ Σ D_ij z_ij + d,  D, d = argmin Σ |p − p̂|²           i, j = −1…1: the square and its eight neighbours, 0 beyond the image
    /// ```
    ///
    /// No other linear map of single squares to as many numbers loses less. The z are uncorrelated, with mean 0 and a mean variance
    /// of 1 over the images (s). With Λ⁰, weak components, which hold the waves, would lie below the noise of all diffusion steps;
    /// with Λ^(−½), small errors of the strongest, the brightness, would hide the waves. The neighbours tell what a square lost, and
    /// hide the borders of the squares.
    ///
    /// - `batches`: images in [−1, 1], each `[batch, in_channels, rows, columns]` with rows and columns that are multiples of
    ///   `patch_size`; at least one; read twice
    ///
    /// # Panics
    ///
    /// When [`validate`](Self::validate) fails, the configuration has levels, or the images have another number of channels.
    ///
    /// # References
    ///
    /// Pearson (1901), "On Lines and Planes of Closest Fit to Systems of Points in Space".
    pub fn fit(
        &self,
        batches: impl Iterator<Item = Tensor<4>> + Clone,
        device: &Device,
    ) -> AutoencoderKl {
        assert!(self.is_linear(), "an autoencoder without levels");
        let mut model = self.init(device);
        let (mean, covariance) = moments(batches.clone(), self.patch_size);
        let (weights, bias) = self.analysis(&mean, covariance);
        if let Some(layer) = &mut model.quant_conv {
            layer.weight = parameter(weights, [bias.len(), mean.len(), 1, 1], device);
            layer.bias = Some(parameter(bias, [2 * self.latent_channels], device));
        }
        let (weights, bias) = self.synthesis(&model, batches);
        if let Some(layer) = &mut model.post_quant_conv {
            let shape = [bias.len(), self.latent_channels, WINDOW, WINDOW];
            layer.weight = parameter(weights, shape, device);
            layer.bias = Some(parameter(bias, [shape[0]], device));
        }
        model
    }

    /// Weights and bias of the encoder, from mean and covariance of the squares.
    fn analysis(&self, mean: &[f64], covariance: Vec<Vec<f64>>) -> (Vec<f32>, Vec<f32>) {
        let (pixels, channels) = (mean.len(), self.latent_channels);
        let (variances, vectors) = symmetric_eigen(covariance);
        let floor = (SMALLEST * variances[0]).max(f64::MIN_POSITIVE);
        let kept = variances[..channels].iter().map(|v| v.max(floor).sqrt());
        let deviations: Vec<f64> = kept.collect();
        let mean_deviation = deviations.iter().sum::<f64>() / channels as f64;
        let (mut weights, mut bias) = (Vec::new(), Vec::new());
        for (component, deviation) in deviations.iter().enumerate() {
            // s Λ^(−¼) of the component.
            let gain = (deviation * mean_deviation).sqrt().recip();
            let row = vectors.iter().map(|of_pixel| of_pixel[component] * gain);
            let offset: f64 = row
                .clone()
                .zip(mean)
                .map(|(weight, mean)| weight * mean)
                .sum();
            weights.extend(row.map(|weight| weight as f32));
            bias.push(-offset as f32);
        }
        weights.resize(2 * channels * pixels, 0.0);
        bias.resize(2 * channels, LOG_VARIANCE);
        (weights, bias)
    }

    /// Weights and bias of the decoder of least squared error, for latents of a model.
    fn synthesis(
        &self,
        model: &AutoencoderKl,
        batches: impl Iterator<Item = Tensor<4>>,
    ) -> (Vec<f32>, Vec<f32>) {
        let (mut count, mut products, mut targets) = (0.0, Vec::new(), Vec::new());
        for images in batches {
            let latents = windows(model.encode(images.clone()).mode());
            let squares = space_to_depth(images, self.patch_size);
            let [_, pixels, _, _] = squares.dims();
            let squares = squares.swap_dims(0, 1).reshape([pixels as i32, -1]);
            count += squares.dims()[1] as f64;
            add(
                &mut products,
                latents.clone().matmul(latents.clone().transpose()),
            );
            add(&mut targets, latents.matmul(squares.transpose()));
        }
        let inputs = WINDOW * WINDOW * self.latent_channels + 1;
        let pixels = targets.len() / inputs;
        let mut rows: Vec<Vec<f64>> = (products.chunks(inputs))
            .zip(targets.chunks(pixels))
            .map(|(products, targets)| [products, targets].concat())
            .collect();
        for (n, row) in rows.iter_mut().enumerate().take(inputs - 1) {
            row[n] += RIDGE * count;
        }
        let solution = solved(rows);
        let place = |pixel: usize, input: usize| solution[input][pixel] as f32;
        let weights = (0..pixels).flat_map(|p| (0..inputs - 1).map(move |n| (p, n)));
        (
            weights.map(|(p, n)| place(p, n)).collect(),
            (0..pixels).map(|p| place(p, inputs - 1)).collect(),
        )
    }
}

/// Latents of each square and its neighbours, and a 1, `[channels · WINDOW² + 1, batch · rows · columns]`; 0 beyond the image.
fn windows(latents: Tensor<4>) -> Tensor<2> {
    let [batch, channels, rows, columns] = latents.dims();
    let device = latents.device();
    let border = WINDOW / 2;
    let padded = latents.pad((border, border, border, border), 0.0);
    let shifted = |n: usize| {
        let [row, column] = [n / WINDOW, n % WINDOW];
        let part = padded
            .clone()
            .narrow(2, row, rows)
            .narrow(3, column, columns);
        part.swap_dims(0, 1)
            .reshape([channels, 1, batch * rows * columns])
    };
    let all: Vec<Tensor<3>> = (0..WINDOW * WINDOW).map(shifted).collect();
    let all = Tensor::cat(all, 1).reshape([channels * WINDOW * WINDOW, batch * rows * columns]);
    let one = Tensor::ones([1, batch * rows * columns], &device);
    Tensor::cat(vec![all, one], 0)
}

/// Solutions X of A X = B for a positive definite A, from the rows of A and B side by side, by Gauss's elimination.
fn solved(mut rows: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    let count = rows.len();
    for n in 0..count {
        let (above, below) = rows.split_at_mut(n + 1);
        let pivot = &above[n];
        below.par_iter_mut().for_each(|row| {
            let factor = row[n] / pivot[n];
            let pairs = row[n..].iter_mut().zip(&pivot[n..]);
            pairs.for_each(|(value, above)| *value -= factor * above);
        });
    }
    for n in (0..count).rev() {
        let (above, below) = rows.split_at_mut(n);
        let row = &mut below[0];
        let pivot = row[n];
        row[count..].iter_mut().for_each(|value| *value /= pivot);
        above.par_iter_mut().for_each(|other| {
            let factor = other[n];
            let pairs = other[count..].iter_mut().zip(&row[count..]);
            pairs.for_each(|(value, known)| *value -= factor * known);
        });
    }
    rows.iter_mut().map(|row| row.split_off(count)).collect()
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
    use wake_nn::patch::depth_to_space;

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
            // What one component loses is told by its neighbours in part.
            let found = squares(model.decode(z) - images.clone());
            assert!(found < lost, "{channels}: {found:e} of {lost:e}");
        }
    }

    /// Sums of waves of all directions.
    fn waves(device: &Device) -> Tensor<4> {
        let side = 32;
        let wave = |image: usize, row: usize, column: usize| {
            let wave = |n: usize| {
                let (angle, length) = ((image * 7 + n) as f32 * 2.4, 5.0 + n as f32);
                let along = row as f32 * angle.sin() + column as f32 * angle.cos();
                (along * std::f32::consts::TAU / length + image as f32).sin()
            };
            0.1 * (0..7).map(wave).sum::<f32>()
        };
        let at = |n: usize| wave(n / (side * side), n / side % side, n % side);
        let pixels: Vec<f32> = (0..24 * side * side).map(at).collect();
        Tensor::from_data(TensorData::new(pixels, [24, 1, side, side]), device)
    }

    /// The errors of the decoder of least squares do not correlate with any latent of a square or its neighbours, their mean is 0, and
    /// squares have weaker borders and smaller errors than when each is decoded alone, E Λ^¼ z/s + mean p.
    #[test]
    fn nothing_in_the_neighbours_is_left_unused() {
        let device = Device::flex();
        let images = waves(&device);
        let model = AutoencoderKlConfig::linear(4, 4).fit(std::iter::once(images.clone()), &device);
        let z = model.encode(images.clone()).mode();
        let decoded = model.decode(z.clone());
        let squares = |x: Tensor<4>| space_to_depth(x, 4).swap_dims(0, 1).reshape([16, -1]);
        let error: Tensor<2> = squares(decoded.clone() - images.clone());
        let unused = windows(z.clone()).matmul(error.transpose()) / (24.0 * 64.0);
        let unused = unused.abs().max().into_scalar::<f32>();
        // The ridge leaves RIDGE times the weights, which are at most 1 pixel per latent.
        assert!(unused < 1e-5, "{unused:e}");

        let alone = squares(images.clone());
        let middle = alone.clone().mean_dim(1);
        let off = alone - middle.clone();
        let z: Tensor<2> = z.swap_dims(0, 1).reshape([4, -1]);
        // Uncorrelated latents: each has its own weights.
        let power = z.clone().square().sum_dim(1).transpose();
        let weights = off.matmul(z.clone().transpose()) / power;
        let alone = weights.matmul(z) + middle;
        let alone = depth_to_space(alone.reshape([16, 24, 8, 8]).swap_dims(0, 1), 4);
        let error = |x: &Tensor<4>| {
            let square = (x.clone() - images.clone()).square();
            square.mean().into_scalar::<f32>()
        };
        let borders = |x: &Tensor<4>| {
            let across = (x.clone().narrow(3, 4, 1) - x.clone().narrow(3, 3, 1)).square();
            let within = (x.clone().narrow(3, 6, 1) - x.clone().narrow(3, 5, 1)).square();
            across.mean().into_scalar::<f32>() / within.mean().into_scalar::<f32>()
        };
        assert!(error(&decoded) < 0.5 * error(&alone));
        let [before, after, truth] = [&alone, &decoded, &images].map(borders);
        assert!((after / truth - 1.0).abs() < 0.5 * (before / truth - 1.0).abs());
    }

    #[test]
    fn a_system_is_solved() {
        let rows = vec![vec![4.0, 1.0, 6.0, 1.0], vec![1.0, 3.0, 7.0, 3.0]];
        // Cramer: x = (18 − 7)/11, (28 − 6)/11 and (3 − 3)/11, (12 − 1)/11.
        let expected = [[1.0, 0.0], [2.0, 1.0]];
        for (found, expected) in solved(rows).into_iter().flatten().zip(expected.concat()) {
            assert!((found - expected).abs() < 1e-15);
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
