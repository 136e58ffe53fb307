//! Encoder and decoder: residual blocks between a first and a last convolution.

use burn::module::Module;
use burn::nn::conv::Conv2d;
use burn::tensor::{DType, Device, Tensor};

use super::config::AutoencoderKlConfig;
use wake_nn::attention::CrossAttention;
use wake_nn::conv::{conv3x3, convolve};
use wake_nn::norm::GroupNorm;
use wake_nn::resample::{Downsample, Upsample};
use wake_nn::resnet::{ResnetBlock, ResnetShape};

/// ε of every normalisation in an autoencoder.
const EPSILON: f64 = 1e-6;

/// Encoder from an image to means and log-variances.
#[derive(Module, Debug)]
pub(super) struct Encoder {
    conv_in: Conv2d,
    down_blocks: Vec<EncoderBlock>,
    mid_block: MidBlock,
    conv_norm_out: GroupNorm,
    conv_out: Conv2d,
}

/// Residual blocks, then downsampling by two.
#[derive(Module, Debug)]
struct EncoderBlock {
    resnets: Vec<ResnetBlock>,
    downsamplers: Vec<Downsample>,
}

/// Decoder from a latent image to an image.
#[derive(Module, Debug)]
pub(super) struct Decoder {
    conv_in: Conv2d,
    mid_block: MidBlock,
    up_blocks: Vec<DecoderBlock>,
    conv_norm_out: GroupNorm,
    conv_out: Conv2d,
}

/// Residual blocks, then upsampling by two.
#[derive(Module, Debug)]
struct DecoderBlock {
    resnets: Vec<ResnetBlock>,
    upsamplers: Vec<Upsample>,
}

/// A residual block, attention of every pixel to every other, and another residual block.
#[derive(Module, Debug)]
struct MidBlock {
    resnets: Vec<ResnetBlock>,
    attentions: Vec<PixelAttention>,
}

/// Single-head attention of every pixel to every other, added to its input.
#[derive(Module, Debug)]
struct PixelAttention {
    group_norm: GroupNorm,
    attention: CrossAttention,
}

impl Encoder {
    pub(super) fn new(config: &AutoencoderKlConfig, device: &Device) -> Self {
        let widths = &config.block_out_channels;
        let channels_in = config.in_channels * config.patch_size * config.patch_size;
        let bottom = widths[widths.len() - 1];
        Self {
            conv_in: conv3x3(channels_in, widths[0], device),
            down_blocks: (0..widths.len())
                .map(|level| EncoderBlock::new(config, level, device))
                .collect(),
            mid_block: MidBlock::new(config, device),
            conv_norm_out: norm(config, bottom, device),
            conv_out: conv3x3(bottom, 2 * config.latent_channels, device),
        }
    }

    pub(super) fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        let mut x = convolve(&self.conv_in, x);
        for block in &self.down_blocks {
            x = block
                .resnets
                .iter()
                .fold(x, |x, resnet| resnet.forward(x, None));
            x = block.downsamplers.iter().fold(x, |x, down| down.forward(x));
        }
        let x = self.mid_block.forward(x);
        convolve(&self.conv_out, self.conv_norm_out.forward_silu(x))
    }
}

impl EncoderBlock {
    fn new(config: &AutoencoderKlConfig, level: usize, device: &Device) -> Self {
        let widths = &config.block_out_channels;
        let (before, width) = (widths[level.saturating_sub(1)], widths[level]);
        let last = level + 1 == widths.len();
        Self {
            resnets: resnets(config, before, width, config.layers_per_block, device),
            downsamplers: (!last)
                .then(|| Downsample::padded_at_end(width, device))
                .into_iter()
                .collect(),
        }
    }
}

impl Decoder {
    pub(super) fn new(config: &AutoencoderKlConfig, device: &Device) -> Self {
        let widths = &config.block_out_channels;
        let channels_out = config.out_channels * config.patch_size * config.patch_size;
        let bottom = widths[widths.len() - 1];
        Self {
            conv_in: conv3x3(config.latent_channels, bottom, device),
            mid_block: MidBlock::new(config, device),
            up_blocks: (0..widths.len())
                .rev()
                .map(|level| DecoderBlock::new(config, level, device))
                .collect(),
            conv_norm_out: norm(config, widths[0], device),
            conv_out: conv3x3(widths[0], channels_out, device),
        }
    }

    /// Floating-point type of the weights.
    pub(super) fn dtype(&self) -> DType {
        self.conv_in.weight.val().dtype()
    }

    pub(super) fn forward(&self, z: Tensor<4>) -> Tensor<4> {
        let mut x = self.mid_block.forward(convolve(&self.conv_in, z));
        for block in &self.up_blocks {
            x = block
                .resnets
                .iter()
                .fold(x, |x, resnet| resnet.forward(x, None));
            x = block.upsamplers.iter().fold(x, |x, up| up.forward(x, None));
        }
        convolve(&self.conv_out, self.conv_norm_out.forward_silu(x))
    }
}

impl DecoderBlock {
    fn new(config: &AutoencoderKlConfig, level: usize, device: &Device) -> Self {
        let widths = &config.block_out_channels;
        let width = widths[level];
        let below = widths.get(level + 1).copied().unwrap_or(width);
        Self {
            resnets: resnets(config, below, width, config.layers_per_block + 1, device),
            upsamplers: (level > 0)
                .then(|| Upsample::new(width, device))
                .into_iter()
                .collect(),
        }
    }
}

impl MidBlock {
    fn new(config: &AutoencoderKlConfig, device: &Device) -> Self {
        let width = config.block_out_channels[config.block_out_channels.len() - 1];
        let attention = || PixelAttention {
            group_norm: norm(config, width, device),
            attention: CrossAttention::new(width, width, 1, true, device),
        };
        Self {
            resnets: resnets(config, width, width, 2, device),
            attentions: config.mid_attention.then(attention).into_iter().collect(),
        }
    }

    fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        let x = self.resnets[0].forward(x, None);
        let x = self
            .attentions
            .iter()
            .fold(x, |x, attention| attention.forward(x));
        self.resnets[1].forward(x, None)
    }
}

impl PixelAttention {
    fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        let [batch, channels, rows, columns] = x.dims();
        let pixels = self
            .group_norm
            .forward(x.clone())
            .reshape([batch, channels, rows * columns]);
        let mixed = self.attention.forward(pixels.swap_dims(1, 2), None);
        x + mixed
            .swap_dims(1, 2)
            .reshape([batch, channels, rows, columns])
    }
}

fn norm(config: &AutoencoderKlConfig, channels: usize, device: &Device) -> GroupNorm {
    GroupNorm::new(config.norm_groups, channels, EPSILON, device)
}

/// Makes `count` residual blocks, of which the first changes the width.
fn resnets(
    config: &AutoencoderKlConfig,
    channels_in: usize,
    channels_out: usize,
    count: usize,
    device: &Device,
) -> Vec<ResnetBlock> {
    let shape = ResnetShape {
        channels_in,
        channels_out,
        time_channels: None,
        groups: config.norm_groups,
        epsilon: EPSILON,
    };
    let same = ResnetShape {
        channels_in: channels_out,
        ..shape
    };
    (0..count)
        .map(|i| ResnetBlock::new(if i == 0 { shape } else { same }, device))
        .collect()
}
