//! What the numbers of a scene alone say of its image: mean and spread of the latents.

use burn::module::Module;
use burn::nn::conv::Conv2d;
use burn::nn::{Linear, LinearConfig};
use burn::tensor::activation::silu;
use burn::tensor::{Device, Tensor};

use super::config::WakeModelConfig;
use super::input::{Known, encoded_phases};
use super::patches::PatchTransform;
use crate::conditioning::{Conditions, DIRECTIONS, FEATURES, MapGrid, OSCILLATING, PLACES, WAVES};
use crate::nn::conv::{conv1x1, convolve};

/// Amplitude of a wave in the image \[grey\] for an output of 1.
const WAVE_AMPLITUDE: f64 = 0.1;
/// Harmonics of a wave's direction: 1, and cosine and sine of once, twice and three times its angle.
const HARMONICS: usize = 7;
/// Largest |ln s|.
const LARGEST_LOG_SPREAD: f64 = 3.0;
/// Layers after the first.
const LAYERS: usize = 3;
/// Width of the network of the mean grey.
const GREY_WIDTH: usize = 128;

/// Mean and spread of the latents of a scene, over all seas that it can have.
///
/// ```text
/// mean μ = Σ_j A_j φ_j + m,    A_j = Σ_h C_jh H_h,    spread s
/// ```
///
/// - φ: phases of the Kelvin waves, encoded as an image would be
///   ([`wave_squares`](crate::conditioning::wave_squares))
/// - H: harmonics of the direction of each wave, since a radar sees waves of each direction otherwise
/// - C, m, ln s: of a network that sees one latent pixel, its place in the ship's frame and the numbers
///
/// What is left, (z − μ)/s, has mean 0 and variance 1 at every pixel; the flow draws it.
///
/// # References
///
/// Lee et al. (2022), "`PriorGrad`: Improving Conditional Denoising Diffusion Models with Data-Dependent Adaptive
/// Prior"; Han, Zheng & Zhou (2022), "CARD: Classification and Regression Diffusion Models" (a regression first, then a
/// diffusion about it); Nix & Weigend (1994), "Estimating the Mean and Variance of the Target Probability Distribution".
#[derive(Module, Debug)]
pub struct Prior {
    places: Conv2d,
    layers: Vec<Conv2d>,
    numbers: Vec<Linear>,
    amplitudes: Conv2d,
    mean: Conv2d,
    spread: Conv2d,
    grey_in: Linear,
    grey_out: Linear,
}

/// What a [`Prior`] says of the images of a batch.
#[derive(Debug, Clone)]
pub struct Expected {
    /// μ, `[batch, channels, rows, columns]`.
    pub mean: Tensor<4>,
    /// ln s, `[batch, channels, rows, columns]`.
    pub log_spread: Tensor<4>,
    /// Mean grey of each image, `[batch, 1]`.
    pub grey: Tensor<2>,
}

impl Prior {
    pub(super) fn new(config: &WakeModelConfig, device: &Device) -> Self {
        let (width, channels) = (config.prior_width, config.latent_channels);
        let linear = |from, to| LinearConfig::new(from, to).init(device);
        Self {
            places: conv1x1(PLACES, width, device),
            layers: (0..LAYERS).map(|_| conv1x1(width, width, device)).collect(),
            numbers: (0..=LAYERS).map(|_| linear(FEATURES, width)).collect(),
            amplitudes: conv1x1(width, HARMONICS * OSCILLATING + WAVES - OSCILLATING, device),
            mean: conv1x1(width, channels, device),
            spread: conv1x1(width, channels, device),
            grey_in: linear(FEATURES, GREY_WIDTH),
            grey_out: linear(GREY_WIDTH, 1),
        }
    }

    /// Mean, spread and brightness of some scenes.
    ///
    /// - `known`: of the same scenes
    /// - `patches`: what latents are encoded with
    pub fn expect(
        &self,
        conditions: &[Conditions],
        known: &Known,
        patches: &PatchTransform,
        grid: MapGrid,
    ) -> Expected {
        let [_, _, rows, columns] = known.places.dims();
        let cells = vec![grid.cells(); conditions.len()];
        let waves = encoded_phases(conditions, grid, &cells, [rows, columns], patches);
        self.forward(known, waves)
    }

    /// Mean, spread and brightness at the latent pixels of `known`.
    ///
    /// # Shapes
    ///
    /// `waves`: encoded phases, `[batch, WAVES · channels, rows, columns]`; result: see [`Expected`].
    pub fn forward(&self, known: &Known, waves: Tensor<4>) -> Expected {
        let told = |layer: &Linear| {
            let told = layer.forward(known.numbers.clone());
            let [batch, width] = told.dims();
            told.reshape([batch, width, 1, 1])
        };
        let mut x = silu(convolve(&self.places, known.places.clone()) + told(&self.numbers[0]));
        for (layer, numbers) in self.layers.iter().zip(&self.numbers[1..]) {
            x = silu(convolve(layer, x.clone()) + told(numbers)) + x;
        }
        let hidden = silu(self.grey_in.forward(known.numbers.clone()));
        let spread = convolve(&self.spread, x.clone()) / LARGEST_LOG_SPREAD;
        Expected {
            mean: self.waves(x.clone(), known.places.clone(), waves) + convolve(&self.mean, x),
            log_spread: spread.tanh() * LARGEST_LOG_SPREAD,
            grey: self.grey_out.forward(hidden),
        }
    }

    /// The sum of the waves, each with its amplitude.
    fn waves(&self, x: Tensor<4>, places: Tensor<4>, waves: Tensor<4>) -> Tensor<4> {
        let amplitudes = convolve(&self.amplitudes, x) * WAVE_AMPLITUDE;
        let [batch, _, rows, columns] = amplitudes.dims();
        let pixels = rows * columns;
        let many = HARMONICS * OSCILLATING;
        let oscillating = amplitudes.clone().narrow(1, 0, many);
        // From bow or stern, which wave, cosine or sine.
        let oscillating: Tensor<6> = oscillating.reshape([batch, 2, 5, 2, HARMONICS, pixels]);
        let harmonics: Tensor<6> = harmonics(places).reshape([batch, 1, 5, 1, HARMONICS, pixels]);
        let oscillating = (oscillating * harmonics).sum_dim(4);
        let oscillating: Tensor<4> = oscillating.reshape([batch, OSCILLATING, rows, columns]);
        let steady = amplitudes.narrow(1, many, WAVES - OSCILLATING);
        let amplitudes = Tensor::cat(vec![oscillating, steady], 1);
        let channels = waves.dims()[1] / WAVES;
        let waves: Tensor<5> = waves.reshape([batch, WAVES, channels, rows, columns]);
        let amplitudes = amplitudes.reshape([batch, WAVES, 1, rows, columns]);
        (waves * amplitudes)
            .sum_dim(1)
            .reshape([batch, channels, rows, columns])
    }
}

/// 1, cos α, sin α, cos 2α, sin 2α, cos 3α, sin 3α of the directions of each wave:
/// transverse, divergent, cusp, and the second harmonics of the first two.
///
/// # Shapes
///
/// `[batch, PLACES, rows, columns]` to `[batch, 5 · HARMONICS, rows, columns]`
fn harmonics(places: Tensor<4>) -> Tensor<4> {
    let of_wave = |wave: usize| {
        let cos = places.clone().narrow(1, DIRECTIONS + 2 * wave, 1);
        let sin = places.clone().narrow(1, DIRECTIONS + 2 * wave + 1, 1);
        let cos2 = cos.clone().square() - sin.clone().square();
        let sin2 = cos.clone() * sin.clone() * 2.0;
        let cos3 = cos2.clone() * cos.clone() - sin2.clone() * sin.clone();
        let sin3 = sin2.clone() * cos.clone() + cos2.clone() * sin.clone();
        [cos.ones_like(), cos, sin, cos2, sin2, cos3, sin3]
    };
    Tensor::cat([0, 1, 2, 0, 1].map(of_wave).concat(), 1)
}

impl Expected {
    /// What the flow draws: (z − μ)/s.
    pub fn residual(&self, latents: Tensor<4>) -> Tensor<4> {
        (latents - self.mean.clone()) * self.log_spread.clone().neg().exp()
    }

    /// The latents z = μ + s r of a residual r.
    pub fn latents(&self, residual: Tensor<4>) -> Tensor<4> {
        residual * self.log_spread.clone().exp() + self.mean.clone()
    }
}
