//! Residual block of the autoencoder and the U-Net.

use burn::module::Module;
use burn::nn::conv::Conv2d;
use burn::nn::{Linear, LinearConfig};
use burn::tensor::{Device, Tensor};

use super::conv::{conv1x1, conv3x3, convolve};
use super::norm::GroupNorm;

/// Widths and constants of a [`ResnetBlock`].
#[derive(Debug, Clone, Copy)]
pub struct ResnetShape {
    /// Channels of the input image.
    pub channels_in: usize,
    /// Channels of the output image.
    pub channels_out: usize,
    /// Channels of the time embedding; `None` in the autoencoder.
    pub time_channels: Option<usize>,
    /// Groups of both normalisations.
    pub groups: usize,
    /// ε of both normalisations.
    pub epsilon: f64,
}

/// Residual block: two convolutions and a shortcut.
///
/// ```text
/// h = conv(silu(norm(x))) + W t
/// y = conv(silu(norm(h))) + shortcut(x)
/// ```
///
/// - `t`: the time embedding after SiLU, in the U-Net only
/// - `shortcut`: a 1 × 1 convolution where the width changes, else x itself
///
/// # References
///
/// Ho, Jain & Abbeel (2020), "Denoising Diffusion Probabilistic Models", appendix B.
#[derive(Module, Debug)]
pub struct ResnetBlock {
    norm1: GroupNorm,
    conv1: Conv2d,
    time_emb_proj: Option<Linear>,
    norm2: GroupNorm,
    conv2: Conv2d,
    conv_shortcut: Option<Conv2d>,
}

impl ResnetBlock {
    /// A block with random weights.
    pub fn new(shape: ResnetShape, device: &Device) -> Self {
        let ResnetShape {
            channels_in,
            channels_out,
            time_channels,
            groups,
            epsilon,
        } = shape;
        Self {
            norm1: GroupNorm::new(groups, channels_in, epsilon, device),
            conv1: conv3x3(channels_in, channels_out, device),
            time_emb_proj: time_channels
                .map(|channels| LinearConfig::new(channels, channels_out).init(device)),
            norm2: GroupNorm::new(groups, channels_out, epsilon, device),
            conv2: conv3x3(channels_out, channels_out, device),
            conv_shortcut: (channels_in != channels_out)
                .then(|| conv1x1(channels_in, channels_out, device)),
        }
    }

    /// Applies the block; `time` is the embedding after SiLU.
    ///
    /// # Shapes
    ///
    /// - `x`: `[batch, channels_in, rows, columns]`
    /// - `time`: `[batch, time_channels]`
    /// - result: `[batch, channels_out, rows, columns]`
    pub fn forward(&self, x: Tensor<4>, time: Option<Tensor<2>>) -> Tensor<4> {
        let mut h = convolve(&self.conv1, self.norm1.forward_silu(x.clone()));
        if let (Some(projection), Some(time)) = (&self.time_emb_proj, time) {
            h = h + projection.forward(time).unsqueeze_dims(&[2, 3]);
        }
        let h = convolve(&self.conv2, self.norm2.forward_silu(h));
        match &self.conv_shortcut {
            Some(shortcut) => h + convolve(shortcut, x),
            None => h + x,
        }
    }
}
