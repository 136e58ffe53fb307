//! The transformer that mixes the pixels of an image with each other and with a prompt.

use burn::module::Module;
use burn::nn::{LayerNorm, LayerNormConfig};
use burn::tensor::{Device, Tensor};

use super::attention::CrossAttention;
use super::feed_forward::FeedForward;
use super::layer_norm::{EPSILON, layer_norm};
use super::norm::GroupNorm;
use super::projection::Projection;

/// Widths and constants of a [`Transformer2d`].
#[derive(Debug, Clone, Copy)]
pub struct TransformerShape {
    /// Channels of the image.
    pub channels: usize,
    /// Channels of the prompt's tokens; `None` for self-attention alone.
    pub context_channels: Option<usize>,
    /// Heads of both attentions.
    pub heads: usize,
    /// Number of blocks.
    pub layers: usize,
    /// Groups of the normalisation before the first block.
    pub groups: usize,
    /// Whether the input and output maps are stored as matrices instead of 1 × 1 convolutions.
    pub linear_projection: bool,
}

/// Transformer with pixels as tokens: a normalisation, an input map, blocks, an output map and a shortcut.
///
/// # References
///
/// Rombach et al. (2022), "High-Resolution Image Synthesis with Latent Diffusion Models",
/// appendix E.2.1.
#[derive(Module, Debug)]
pub struct Transformer2d {
    norm: GroupNorm,
    proj_in: Projection,
    transformer_blocks: Vec<TransformerBlock>,
    proj_out: Projection,
}

impl Transformer2d {
    /// A transformer with random weights.
    pub fn new(shape: TransformerShape, device: &Device) -> Self {
        let TransformerShape {
            channels,
            groups,
            layers,
            linear_projection,
            ..
        } = shape;
        Self {
            norm: GroupNorm::new(groups, channels, 1e-6, device),
            proj_in: Projection::new(channels, linear_projection, device),
            transformer_blocks: (0..layers)
                .map(|_| TransformerBlock::new(shape, device))
                .collect(),
            proj_out: Projection::new(channels, linear_projection, device),
        }
    }

    /// Mixes pixels and context.
    ///
    /// # Shapes
    ///
    /// - `x`: `[batch, channels, rows, columns]`
    /// - `context`: `[batch, tokens, context_channels]`, if the blocks attend to one
    /// - result: as `x`
    ///
    /// # Panics
    ///
    /// If the blocks attend to a context and none is given.
    pub fn forward(&self, x: Tensor<4>, context: Option<&Tensor<3>>) -> Tensor<4> {
        let [batch, channels, rows, columns] = x.dims();
        let pixels = self
            .norm
            .forward(x.clone())
            .reshape([batch, channels, rows * columns]);
        let mut tokens = self.proj_in.to_tokens(pixels);
        for block in &self.transformer_blocks {
            tokens = block.forward(tokens, context);
        }
        self.proj_out
            .to_pixels(tokens)
            .reshape([batch, channels, rows, columns])
            + x
    }
}

/// Self-attention, attention to a context if there is one, and a feed-forward layer, each added to its input.
#[derive(Module, Debug)]
pub struct TransformerBlock {
    norm1: LayerNorm,
    attn1: CrossAttention,
    norm2: Option<LayerNorm>,
    attn2: Option<CrossAttention>,
    norm3: LayerNorm,
    ff: FeedForward,
}

impl TransformerBlock {
    fn new(shape: TransformerShape, device: &Device) -> Self {
        let TransformerShape {
            channels,
            context_channels,
            heads,
            ..
        } = shape;
        let norm = || {
            LayerNormConfig::new(channels)
                .with_epsilon(EPSILON)
                .init(device)
        };
        Self {
            norm1: norm(),
            attn1: CrossAttention::new(channels, channels, heads, false, device),
            norm2: context_channels.map(|_| norm()),
            attn2: context_channels
                .map(|context| CrossAttention::new(channels, context, heads, false, device)),
            norm3: norm(),
            ff: FeedForward::new(channels, device),
        }
    }

    /// Applies the block.
    ///
    /// # Shapes
    ///
    /// - `x`: `[batch, tokens, channels]`
    /// - `context`: `[batch, tokens of the context, context_channels]`, if the block attends to one
    /// - result: as `x`
    ///
    /// # Panics
    ///
    /// If the block attends to a context and none is given.
    pub fn forward(&self, x: Tensor<3>, context: Option<&Tensor<3>>) -> Tensor<3> {
        let x = self.attn1.forward(layer_norm(&self.norm1, x.clone()), None) + x;
        let x = match (&self.norm2, &self.attn2, context) {
            (Some(norm), Some(attention), Some(context)) => {
                attention.forward(layer_norm(norm, x.clone()), Some(context.clone())) + x
            }
            (Some(_), Some(_), None) => panic!("this transformer needs a context; pass one"),
            _ => x,
        };
        self.ff.forward(layer_norm(&self.norm3, x.clone())) + x
    }
}
