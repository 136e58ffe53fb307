//! From noise to what mean and spread leave open: the random sea.

use burn::module::Module;
use burn::nn::conv::Conv2d;
use burn::tensor::activation::silu;
use burn::tensor::{Device, Tensor};

use super::config::WakeModelConfig;
use super::input::Known;
use crate::autoencoder::patch::{depth_to_space, space_to_depth};
use crate::conditioning::PLACES;
use crate::nn::cast_to;
use crate::nn::conv::{conv3x3, convolve};
use crate::unet::{UNet, UNetInput};

/// The steps that σ = 1 stands for in the embedding of the step.
const STEPS: f64 = 1000.0;

/// The flow that turns noise into the residual of a scene's latents.
///
/// The numbers enter every residual block, and every attention as its only token; the places in the ship's frame are
/// laid over the noisy image.
///
/// # References
///
/// Lipman et al. (2023), "Flow Matching for Generative Modeling", Eq. 22 without its least noise.
#[derive(Module, Debug)]
pub struct Flow {
    places: Conv2d,
    unet: UNet,
    fold: usize,
}

/// What is told about a scene, in the form that every step uses.
#[derive(Debug, Clone)]
pub struct Told {
    numbers: Tensor<2>,
    maps: Tensor<4>,
}

impl Flow {
    pub(super) fn new(config: &WakeModelConfig, device: &Device) -> Self {
        let folded = PLACES * config.fold * config.fold;
        Self {
            places: conv3x3(folded, config.map_channels, device),
            unet: config.unet().init(device),
            fold: config.fold,
        }
    }

    /// Puts numbers and places in the form that every step uses.
    pub fn told(&self, known: &Known) -> Told {
        let dtype = self.places.weight.val().dtype();
        let places = space_to_depth(cast_to(known.places.clone(), dtype), self.fold);
        Told {
            numbers: cast_to(known.numbers.clone(), dtype),
            maps: silu(convolve(&self.places, places)),
        }
    }

    /// The velocity n − r of the flow at x = (1 − σ) r + σ n.
    ///
    /// # Shapes
    ///
    /// `x` and result: `[batch, channels, rows, columns]`; `sigma`: 0 to 1, `[batch]`.
    pub fn velocity(&self, x: Tensor<4>, sigma: Tensor<1>, told: &Told) -> Tensor<4> {
        let maps = cast_to(told.maps.clone(), x.dtype());
        let folded = space_to_depth(x, self.fold);
        let velocity = self.unet.forward(UNetInput {
            sample: Tensor::cat(vec![folded, maps], 1),
            timesteps: sigma * STEPS,
            context: told.numbers.clone().unsqueeze_dim(1),
            condition: Some(told.numbers.clone()),
        });
        depth_to_space(velocity, self.fold)
    }
}
