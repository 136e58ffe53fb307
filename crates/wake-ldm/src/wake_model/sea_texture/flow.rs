//! Flow from Gaussian noise with the correlation of a sea to the sea itself.

use burn::module::Module;
use burn::nn::conv::Conv2d;
use burn::tensor::{DType, Device, Tensor};
use serde_json::{Value, json};

use super::style::FEATURES;
use wake_nn::activation::silu;
use wake_nn::cast_to;
use wake_nn::conv::{conv3x3, convolve};
use wake_nn::norm::GroupNorm;
use wake_nn::patch::{depth_to_space, space_to_depth};
use wake_nn::resample::{Downsample, Upsample};
use wake_nn::resnet::{ResnetBlock, ResnetShape};
use wake_nn::timestep::{TimestepEmbedding, sinusoidal_embedding};

/// Side of the squares of pixels that the network folds into channels of one pixel.
const FOLD: usize = 4;
/// Channels at the folded size, and at half that size.
const WIDTHS: [usize; 2] = [48, 96];
/// Rows and columns of an image are multiples of this.
pub(super) const MULTIPLE: usize = 2 * FOLD;
const TIME: usize = 4 * WIDTHS[0];
const GROUPS: usize = 16;
const EPSILON: f64 = 1e-5;
/// Number of steps that σ = 1 corresponds to in the embedding of the step.
const STEPS: f64 = 1000.0;

/// Flow from noise n to the standardised amplitude r of a patch, along x = cos φ r + sin φ n, φ = πσ/2.
///
/// The noise has the correlation of the patch's style. If the sea were Gaussian, the velocity would be 0 everywhere: the
/// flow has to learn only the difference between a sea and Gaussian noise with its spectrum.
///
/// The network has only convolutions, with 0.8 million weights, and takes images of any size that is a multiple of 8.
/// Beyond the edge the outermost pixels see zeros, so images are sampled with a margin that is cut off.
///
/// # References
///
/// Albergo, Boffi & Vanden-Eijnden (2023), "Stochastic Interpolants: A Unifying Framework for Flows and Diffusions";
/// Ronneberger, Fischer & Brox (2015), "U-Net".
#[derive(Module, Debug)]
pub struct SeaFlow {
    time: TimestepEmbedding,
    style: TimestepEmbedding,
    conv_in: Conv2d,
    down: ResnetBlock,
    halve: Downsample,
    low: Vec<ResnetBlock>,
    narrow: Conv2d,
    double: Upsample,
    up: ResnetBlock,
    norm_out: GroupNorm,
    conv_out: Conv2d,
}

impl SeaFlow {
    /// Makes a flow with random weights.
    pub fn new(device: &Device) -> Self {
        let block = |channels_in, channels_out| {
            let shape = ResnetShape {
                channels_in,
                channels_out,
                time_channels: Some(TIME),
                groups: GROUPS,
                epsilon: EPSILON,
            };
            ResnetBlock::new(shape, device)
        };
        let [wide, low] = WIDTHS;
        let folded = FOLD * FOLD;
        Self {
            time: TimestepEmbedding::new(wide, TIME, device),
            style: TimestepEmbedding::new(FEATURES, TIME, device),
            conv_in: conv3x3(folded, wide, device),
            down: block(wide, wide),
            halve: Downsample::padded(wide, device),
            low: vec![block(wide, low), block(low, low), block(low, low)],
            narrow: conv3x3(low, wide, device),
            double: Upsample::new(wide, device),
            up: block(2 * wide, wide),
            norm_out: GroupNorm::new(GROUPS, wide, EPSILON, device),
            conv_out: conv3x3(wide, folded, device),
        }
    }

    /// Shape of the network, as recorded by a training run.
    pub fn shape() -> Value {
        json!({"sea": {"fold": FOLD, "widths": WIDTHS, "features": FEATURES}})
    }

    /// Type of the weights.
    pub fn dtype(&self) -> DType {
        self.conv_in.weight.val().dtype()
    }

    /// Predicts the velocity ∂x/∂φ = cos φ n − sin φ r, averaged over all r and n that give x.
    ///
    /// - `features`: features of the styles, `[batch, 8]`
    ///
    /// # Shapes
    ///
    /// `x` and result: `[batch, 1, rows, columns]`, multiples of 8; `sigma`: 0 to 1, `[batch]`.
    pub fn velocity(&self, x: Tensor<4>, sigma: Tensor<1>, features: Tensor<2>) -> Tensor<4> {
        let dtype = self.dtype();
        let waves = sinusoidal_embedding(sigma * STEPS, WIDTHS[0], true, 0.0);
        let told =
            self.time.forward(cast_to(waves, dtype)) + self.style.forward(cast_to(features, dtype));
        let told = Some(silu(told));
        let x = convolve(&self.conv_in, space_to_depth(cast_to(x, dtype), FOLD));
        let skip = self.down.forward(x, told.clone());
        let mut x = self.halve.forward(skip.clone());
        for block in &self.low {
            x = block.forward(x, told.clone());
        }
        let x = self.double.forward(convolve(&self.narrow, x), None);
        let x = self.up.forward(Tensor::cat(vec![x, skip], 1), told);
        let x = convolve(&self.conv_out, self.norm_out.forward_silu(x));
        depth_to_space(x, FOLD)
    }
}
