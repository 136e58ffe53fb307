//! Flow from noise to the residual that mean and spread leave open: the random sea.

use burn::module::Module;
use burn::nn::conv::Conv2d;
use burn::tensor::{DType, Device, Tensor};

use super::config::WakeModelConfig;
use super::inputs::ConditioningInputs;
use crate::unet::{UNet, UNetInput};
use crate::wake_model::conditioning::PLACES;
use wake_nn::activation::silu;
use wake_nn::cast_to;
use wake_nn::conv::{conv3x3, convolve};
use wake_nn::patch::{depth_to_space, space_to_depth};

/// Number of steps that σ = 1 corresponds to in the embedding of the step.
const STEPS: f64 = 1000.0;

/// Flow that turns noise n into the residual r of a scene's latents, along x = cos φ r + sin φ n, φ = πσ/2.
///
/// The noise is Gaussian, with the correlation of the sea (`sea.rs`). If the residual had the same distribution, the
/// velocity would be 0 everywhere: the flow has to learn only the difference between the two.
///
/// The numbers enter every residual block; the positions in the ship's frame and the expected image are
/// concatenated to the noisy image.
///
/// # References
///
/// Albergo, Boffi & Vanden-Eijnden (2023), "Stochastic Interpolants: A Unifying Framework for Flows and Diffusions"
/// (the trigonometric interpolant); Salimans & Ho (2022), "Progressive Distillation for Fast Sampling of Diffusion Models"
/// (v in terms of an angle).
#[derive(Module, Debug)]
pub struct Flow {
    maps: Conv2d,
    unet: UNet,
    fold: usize,
}

/// Conditioning of some scenes in the form that every step uses.
#[derive(Debug, Clone)]
pub struct CachedConditioning {
    numbers: Tensor<2>,
    maps: Tensor<4>,
}

impl Flow {
    pub(super) fn new(config: &WakeModelConfig, device: &Device) -> Self {
        let folded = (PLACES + config.latent_channels) * config.fold * config.fold;
        Self {
            maps: conv3x3(folded, config.map_channels, device),
            unet: config.unet().init(device),
            fold: config.fold,
        }
    }

    /// Type of the weights.
    pub fn dtype(&self) -> DType {
        self.maps.weight.val().dtype()
    }

    /// Converts the conditioning to the form that every step uses.
    pub fn cached(&self, inputs: &ConditioningInputs) -> CachedConditioning {
        let dtype = self.dtype();
        let maps = Tensor::cat(vec![inputs.places.clone(), inputs.wake.clone()], 1);
        let maps = space_to_depth(cast_to(maps, dtype), self.fold);
        CachedConditioning {
            numbers: cast_to(inputs.told(), dtype),
            maps: silu(convolve(&self.maps, maps)),
        }
    }

    /// Predicts the velocity ∂x/∂φ = cos φ n − sin φ r, averaged over all r and n that give x.
    ///
    /// # Shapes
    ///
    /// `x` and result: `[batch, channels, rows, columns]`; `sigma`: 0 to 1, `[batch]`.
    pub fn velocity(
        &self,
        x: Tensor<4>,
        sigma: Tensor<1>,
        inputs: &CachedConditioning,
    ) -> Tensor<4> {
        let maps = cast_to(inputs.maps.clone(), x.dtype());
        let folded = space_to_depth(x, self.fold);
        let velocity = self.unet.forward(UNetInput {
            sample: Tensor::cat(vec![folded, maps], 1),
            timesteps: sigma * STEPS,
            context: None,
            condition: Some(inputs.numbers.clone()),
        });
        depth_to_space(velocity, self.fold)
    }
}
