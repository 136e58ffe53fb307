//! Mean and spread of the latents of a scene, from its numbers and the expected image.

use burn::module::Module;
use burn::nn::conv::Conv2d;
use burn::nn::{Linear, LinearConfig};
use burn::tensor::{Device, Tensor};

use super::config::WakeModelConfig;
use super::inputs::ConditioningInputs;
use crate::wake_model::conditioning::{FEATURES, PLACES};
use wake_nn::activation::silu;
use wake_nn::cast_to;
use wake_nn::conv::{conv1x1, convolve};

/// Largest |c|.
const LARGEST_LOG_STD: f64 = 3.0;
/// Number of layers after the first.
const LAYERS: usize = 3;
/// Width of the network for the mean grey.
const GREY_WIDTH: usize = 128;

/// Mean and spread of the latents of a scene, over all its possible seas.
///
/// ```text
/// mean μ = (1 + a) w + d m,    spread s = d e^c
/// ```
///
/// - w: latents of the expected image from physics; d: standard deviation of the linear sea in the channel, see
///   [`PhysicsPrior`](super::PhysicsPrior)
/// - a, m, c: from a network of one latent pixel, its position in the ship's frame and the numbers, which corrects for what
///   the formulas of w and d neglect
///
/// The residual (z − μ)/s has mean 0 and variance 1 at every pixel; it is sampled by the flow.
///
/// # References
///
/// Lee et al. (2022), "`PriorGrad`: Improving Conditional Denoising Diffusion Models with Data-Dependent Adaptive
/// Prior"; Han, Zheng & Zhou (2022), "CARD: Classification and Regression Diffusion Models" (a regression first, then a
/// diffusion about it); Nix & Weigend (1994), "Estimating the Mean and Variance of the Target Probability Distribution".
#[derive(Module, Debug)]
pub struct Prior {
    places: Conv2d,
    wake: Conv2d,
    layers: Vec<Conv2d>,
    numbers: Vec<Linear>,
    gain: Conv2d,
    mean: Conv2d,
    spread: Conv2d,
    grey_in: Linear,
    grey_out: Linear,
}

/// Mean and spread from a [`Prior`] for a batch.
#[derive(Debug, Clone)]
pub struct Expected {
    /// μ, `[batch, channels, rows, columns]`.
    pub mean: Tensor<4>,
    /// ln s, `[batch, channels, rows, columns]`.
    pub log_std: Tensor<4>,
    /// Mean grey of each image minus the mean grey of its expected image, `[batch, 1]`.
    pub grey: Tensor<2>,
}

impl Prior {
    pub(super) fn new(config: &WakeModelConfig, device: &Device) -> Self {
        let (width, channels) = (config.prior_width, config.latent_channels);
        let linear = |from, to| LinearConfig::new(from, to).init(device);
        Self {
            places: conv1x1(PLACES, width, device),
            wake: conv1x1(channels, width, device),
            layers: (0..LAYERS).map(|_| conv1x1(width, width, device)).collect(),
            numbers: (0..=LAYERS)
                .map(|_| linear(FEATURES + channels, width))
                .collect(),
            gain: conv1x1(width, channels, device),
            mean: conv1x1(width, channels, device),
            spread: conv1x1(width, channels, device),
            grey_in: linear(FEATURES + channels, GREY_WIDTH),
            grey_out: linear(GREY_WIDTH, 1),
        }
    }

    /// Mean, spread and brightness at the latent pixels of `inputs`, with its number type.
    pub fn forward(&self, inputs: &ConditioningInputs) -> Expected {
        let (dtype, wide) = (self.mean.weight.val().dtype(), inputs.wake.dtype());
        let numbers = cast_to(inputs.told(), dtype);
        let told = |layer: &Linear| {
            let told = layer.forward(numbers.clone());
            let [batch, width] = told.dims();
            told.reshape([batch, width, 1, 1])
        };
        let seen = convolve(&self.places, cast_to(inputs.places.clone(), dtype))
            + convolve(&self.wake, cast_to(inputs.wake.clone(), dtype));
        let mut x = silu(seen + told(&self.numbers[0]));
        for (layer, numbers) in self.layers.iter().zip(&self.numbers[1..]) {
            x = silu(convolve(layer, x.clone()) + told(numbers)) + x;
        }
        let out = |layer: &Conv2d| cast_to(convolve(layer, x.clone()), wide);
        let hidden = silu(self.grey_in.forward(numbers.clone()));
        let [batch, channels, ..] = inputs.wake.dims();
        let deviations = inputs
            .log_deviations
            .clone()
            .reshape([batch, channels, 1, 1]);
        let change = (out(&self.spread) / LARGEST_LOG_STD).tanh() * LARGEST_LOG_STD;
        Expected {
            mean: inputs.wake.clone() * (out(&self.gain) + 1.0)
                + out(&self.mean) * deviations.clone().exp(),
            log_std: change + deviations,
            grey: cast_to(self.grey_out.forward(hidden), wide),
        }
    }
}

impl Expected {
    /// Residual (z − μ)/s, which the flow samples.
    pub fn residual(&self, latents: Tensor<4>) -> Tensor<4> {
        (latents - self.mean.clone()) * self.log_std.clone().neg().exp()
    }

    /// Latents z = μ + s r of a residual r.
    pub fn latents(&self, residual: Tensor<4>) -> Tensor<4> {
        residual * self.log_std.clone().exp() + self.mean.clone()
    }
}
