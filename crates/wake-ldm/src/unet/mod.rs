//! Conditional U-Net, which predicts the noise from a noisy image, a step and a prompt.

mod blocks;
mod config;

use std::path::Path;

use burn::module::Module;
use burn::nn::conv::Conv2d;
use burn::tensor::{Device, Tensor};

use blocks::{DownBlock, Levels, MidBlock, UpBlock};
use wake_nn::Result;
use wake_nn::activation::silu;
use wake_nn::cast_to;
use wake_nn::conv::{conv3x3, convolve};
use wake_nn::norm::GroupNorm;
use wake_nn::timestep::{TimestepEmbedding, sinusoidal_embedding};
use wake_nn::weights::{Layout, load};

pub use config::UNetConfig;

/// Inputs of a U-Net.
#[derive(Debug, Clone)]
pub struct UNetInput {
    /// The noisy latent image, `[batch, in_channels, rows, columns]`.
    pub sample: Tensor<4>,
    /// The step of each image, `[batch]`; fractions are allowed.
    pub timesteps: Tensor<1>,
    /// The prompt's tokens, `[batch, tokens, cross_attention_dim]`; `None` for a model without cross-attention, which
    /// ignores a context.
    pub context: Option<Tensor<3>>,
    /// Numbers that condition the image in addition to the prompt, `[batch, condition_channels]`; `None`
    /// leaves the model unconditioned by them.
    pub condition: Option<Tensor<2>>,
}

/// A U-shaped stack of residual blocks and transformers.
///
/// ```text
/// image ─► conv ─► down ─► down ─► … ─► middle ─► … ─► up ─► up ─► norm, conv ─► prediction
///                    └────────┴───────── skip ──────────┘─────┘
/// ```
///
/// The step (and the condition vector) enters every residual block, the prompt every transformer.
///
/// # References
///
/// Rombach et al. (2022), "High-Resolution Image Synthesis with Latent Diffusion Models", section
/// 3.2 and appendix E.2.
#[derive(Module, Debug)]
pub struct UNet {
    conv_in: Conv2d,
    time_embedding: TimestepEmbedding,
    class_embedding: Option<TimestepEmbedding>,
    down_blocks: Vec<DownBlock>,
    mid_block: MidBlock,
    up_blocks: Vec<UpBlock>,
    conv_norm_out: GroupNorm,
    conv_out: Conv2d,
    #[module(skip)]
    config: UNetConfig,
}

impl UNetConfig {
    /// Makes a U-Net with random weights, which are drawn on first use.
    ///
    /// # Panics
    ///
    /// When [`validate`](Self::validate) fails.
    pub fn init(&self, device: &Device) -> UNet {
        if let Err(error) = self.validate() {
            panic!("{error}");
        }
        let levels = Levels::new(self);
        let width = self.block_out_channels[0];
        let time = levels.time_channels;
        UNet {
            conv_in: conv3x3(self.in_channels, width, device),
            time_embedding: TimestepEmbedding::new(width, time, device),
            class_embedding: self
                .condition_channels
                .map(|channels| TimestepEmbedding::new(channels, time, device)),
            down_blocks: levels.down(device),
            mid_block: levels.mid(device),
            up_blocks: levels.up(device),
            conv_norm_out: GroupNorm::new(self.norm_groups, width, self.norm_epsilon, device),
            conv_out: conv3x3(width, self.out_channels, device),
            config: self.clone(),
        }
    }
}

impl UNet {
    /// Reads a folder with `config.json` and weights, as f32.
    ///
    /// # Errors
    ///
    /// The errors of [`load`] and of [`UNetConfig::read`].
    pub fn from_folder(folder: &Path, device: &Device) -> Result<Self> {
        let config = UNetConfig::read(&folder.join("config.json"))?;
        load(config.init(device), Layout::Diffusers, folder)
    }

    /// The configuration of the model.
    pub fn config(&self) -> &UNetConfig {
        &self.config
    }

    /// Length of the condition vector, if the model has one.
    pub fn condition_channels(&self) -> Option<usize> {
        self.config.condition_channels
    }

    /// Predicts the noise, velocity or clean image, whichever the model was trained for.
    ///
    /// Inputs are cast to the precision of the weights, the result to the precision of the sample.
    ///
    /// # Shapes
    ///
    /// See [`UNetInput`]; result `[batch, out_channels, rows, columns]`. Rows and columns are arbitrary;
    /// powers of two times 2^(levels − 1) avoid resizing on the way up.
    ///
    /// # Panics
    ///
    /// When the shapes do not fit, when a condition is given to a model without one, or when a model with cross-attention gets
    /// no context.
    pub fn forward(&self, input: UNetInput) -> Tensor<4> {
        let dtype = self.conv_in.weight.val().dtype();
        let sample_dtype = input.sample.dtype();
        let context = input.context.map(|context| cast_to(context, dtype));
        let context = context.as_ref();
        let time = cast_to(
            silu(self.embed_step(input.timesteps, input.condition)),
            dtype,
        );

        let mut x = convolve(&self.conv_in, cast_to(input.sample, dtype));
        let mut skips = vec![x.clone()];
        for block in &self.down_blocks {
            x = block.forward(x, &time, context, &mut skips);
        }
        x = self.mid_block.forward(x, &time, context);
        for block in &self.up_blocks {
            x = block.forward(x, &time, context, &mut skips);
        }
        cast_to(
            convolve(&self.conv_out, self.conv_norm_out.forward_silu(x)),
            sample_dtype,
        )
    }

    /// Embedding of step and condition, an input of every residual block.
    fn embed_step(&self, timesteps: Tensor<1>, condition: Option<Tensor<2>>) -> Tensor<2> {
        let dtype = self.conv_in.weight.val().dtype();
        let waves = sinusoidal_embedding(
            timesteps,
            self.config.block_out_channels[0],
            self.config.cos_first,
            self.config.frequency_shift,
        );
        let embedded = self.time_embedding.forward(cast_to(waves, dtype));
        match (condition, &self.class_embedding) {
            (None, _) => embedded,
            (Some(condition), Some(layer)) => embedded + layer.forward(cast_to(condition, dtype)),
            (Some(_), None) => panic!("this U-Net has no condition vector; give `None`"),
        }
    }
}
