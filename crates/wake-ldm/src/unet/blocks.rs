//! Levels of the U-Net: down, middle and up.

use burn::module::Module;
use burn::tensor::{Device, Tensor};

use super::config::UNetConfig;
use wake_nn::resample::{Downsample, Upsample};
use wake_nn::resnet::{ResnetBlock, ResnetShape};
use wake_nn::transformer::{Transformer2d, TransformerShape};

/// Residual blocks (each with its transformer, if any), then downsampling by two.
#[derive(Module, Debug)]
pub(super) struct DownBlock {
    resnets: Vec<ResnetBlock>,
    attentions: Vec<Transformer2d>,
    downsamplers: Vec<Downsample>,
}

impl DownBlock {
    /// Pushes the image after every block onto `skips`.
    pub(super) fn forward(
        &self,
        mut x: Tensor<4>,
        time: &Tensor<2>,
        context: Option<&Tensor<3>>,
        skips: &mut Vec<Tensor<4>>,
    ) -> Tensor<4> {
        for (i, resnet) in self.resnets.iter().enumerate() {
            x = resnet.forward(x, Some(time.clone()));
            if let Some(attention) = self.attentions.get(i) {
                x = attention.forward(x, context);
            }
            skips.push(x.clone());
        }
        for downsampler in &self.downsamplers {
            x = downsampler.forward(x);
            skips.push(x.clone());
        }
        x
    }
}

/// A residual block, a transformer and another residual block.
#[derive(Module, Debug)]
pub(super) struct MidBlock {
    resnets: Vec<ResnetBlock>,
    attentions: Vec<Transformer2d>,
}

impl MidBlock {
    pub(super) fn forward(
        &self,
        x: Tensor<4>,
        time: &Tensor<2>,
        context: Option<&Tensor<3>>,
    ) -> Tensor<4> {
        let mut x = self.resnets[0].forward(x, Some(time.clone()));
        for (attention, resnet) in self.attentions.iter().zip(&self.resnets[1..]) {
            x = attention.forward(x, context);
            x = resnet.forward(x, Some(time.clone()));
        }
        x
    }
}

/// Residual blocks with skip connections from the way down, then upsampling by two.
#[derive(Module, Debug)]
pub(super) struct UpBlock {
    resnets: Vec<ResnetBlock>,
    attentions: Vec<Transformer2d>,
    upsamplers: Vec<Upsample>,
}

impl UpBlock {
    /// Pops as many images off `skips` as there are residual blocks.
    pub(super) fn forward(
        &self,
        mut x: Tensor<4>,
        time: &Tensor<2>,
        context: Option<&Tensor<3>>,
        skips: &mut Vec<Tensor<4>>,
    ) -> Tensor<4> {
        for (i, resnet) in self.resnets.iter().enumerate() {
            let skip = skips.split_off(skips.len() - 1);
            x = resnet.forward(concatenate(x, skip), Some(time.clone()));
            if let Some(attention) = self.attentions.get(i) {
                x = attention.forward(x, context);
            }
        }
        let size = skips
            .last()
            .map(|skip| skip.dims())
            .map(|[_, _, rows, columns]| [rows, columns]);
        for upsampler in &self.upsamplers {
            x = upsampler.forward(x, size);
        }
        x
    }
}

fn concatenate(x: Tensor<4>, skip: Vec<Tensor<4>>) -> Tensor<4> {
    let mut parts = vec![x];
    parts.extend(skip);
    Tensor::cat(parts, 1)
}

/// Widths of all levels, from which the blocks are built.
pub(super) struct Levels<'a> {
    config: &'a UNetConfig,
    /// Channels of the embedded step: four times the first width.
    pub(super) time_channels: usize,
}

impl<'a> Levels<'a> {
    pub(super) fn new(config: &'a UNetConfig) -> Self {
        Self {
            config,
            time_channels: 4 * config.block_out_channels[0],
        }
    }

    pub(super) fn down(&self, device: &Device) -> Vec<DownBlock> {
        let config = self.config;
        let widths = &config.block_out_channels;
        (0..widths.len())
            .map(|level| {
                let (before, width) = (widths[level.saturating_sub(1)], widths[level]);
                let layers = config.layers_per_block;
                let attending = if config.down_attention[level] {
                    layers
                } else {
                    0
                };
                let last = level + 1 == widths.len();
                DownBlock {
                    resnets: (0..layers)
                        .map(|i| self.resnet(if i == 0 { before } else { width }, width, device))
                        .collect(),
                    attentions: self.attentions(level, attending, device),
                    downsamplers: (!last)
                        .then(|| Downsample::padded(width, device))
                        .into_iter()
                        .collect(),
                }
            })
            .collect()
    }

    pub(super) fn mid(&self, device: &Device) -> MidBlock {
        let level = self.config.block_out_channels.len() - 1;
        let width = self.config.block_out_channels[level];
        MidBlock {
            resnets: (0..2).map(|_| self.resnet(width, width, device)).collect(),
            attentions: self.attentions(level, 1, device),
        }
    }

    pub(super) fn up(&self, device: &Device) -> Vec<UpBlock> {
        let config = self.config;
        let levels = config.block_out_channels.len();
        (0..levels)
            .map(|i| {
                let level = levels - 1 - i;
                let width = config.block_out_channels[level];
                let inputs = up_inputs(&config.block_out_channels, level, config.layers_per_block);
                let attending = if config.up_attention[i] {
                    inputs.len()
                } else {
                    0
                };
                UpBlock {
                    resnets: inputs
                        .iter()
                        .map(|&channels| self.resnet(channels, width, device))
                        .collect(),
                    attentions: self.attentions(level, attending, device),
                    upsamplers: (level > 0)
                        .then(|| Upsample::new(width, device))
                        .into_iter()
                        .collect(),
                }
            })
            .collect()
    }

    fn resnet(&self, channels_in: usize, channels_out: usize, device: &Device) -> ResnetBlock {
        let shape = ResnetShape {
            channels_in,
            channels_out,
            time_channels: Some(self.time_channels),
            groups: self.config.norm_groups,
            epsilon: self.config.norm_epsilon,
        };
        ResnetBlock::new(shape, device)
    }

    fn attentions(&self, level: usize, count: usize, device: &Device) -> Vec<Transformer2d> {
        let shape = TransformerShape {
            channels: self.config.block_out_channels[level],
            context_channels: self.config.cross_attention_dim,
            heads: self.config.heads[level],
            layers: self.config.transformer_layers,
            groups: self.config.norm_groups,
            linear_projection: self.config.linear_projection,
        };
        (0..count)
            .map(|_| Transformer2d::new(shape, device))
            .collect()
    }
}

/// Input channels of the residual blocks of one level on the way up: the image from below (or from
/// the block before) and the skipped image.
fn up_inputs(widths: &[usize], level: usize, layers: usize) -> Vec<usize> {
    let width = widths[level];
    let below = widths.get(level + 1).copied().unwrap_or(width);
    let above = widths[level.saturating_sub(1)];
    (0..=layers)
        .map(|i| {
            let image = if i == 0 { below } else { width };
            let skip = if i == layers { above } else { width };
            image + skip
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn widths_on_the_way_up_are_those_of_stable_diffusion() {
        // Read off the shapes of `up_blocks.N.resnets.M.conv1.weight` in the published weights.
        let widths = [320, 640, 1280, 1280];
        assert_eq!(up_inputs(&widths, 3, 2), [2560, 2560, 2560]);
        assert_eq!(up_inputs(&widths, 2, 2), [2560, 2560, 1920]);
        assert_eq!(up_inputs(&widths, 1, 2), [1920, 1280, 960]);
        assert_eq!(up_inputs(&widths, 0, 2), [960, 640, 640]);
    }
}
