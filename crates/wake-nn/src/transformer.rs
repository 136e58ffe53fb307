//! The transformer that mixes the pixels of an image with each other and with a prompt.

use burn::module::Module;
use burn::nn::conv::Conv2d;
use burn::nn::{LayerNorm, LayerNormConfig, Linear, LinearConfig};
use burn::tensor::module::linear;
use burn::tensor::{Device, Tensor};

use super::attention::CrossAttention;
use super::conv::conv1x1;
use super::feed_forward::FeedForward;
use super::norm::GroupNorm;

/// Widths and constants of a [`Transformer2d`].
#[derive(Debug, Clone, Copy)]
pub struct TransformerShape {
    /// Channels of the image.
    pub channels: usize,
    /// Channels of the prompt's tokens; `None` for pixels that are mixed with each other alone.
    pub context_channels: Option<usize>,
    /// Heads of both attentions.
    pub heads: usize,
    /// Blocks in a row.
    pub layers: usize,
    /// Groups of the normalisation before the first block.
    pub groups: usize,
    /// Whether the maps in and out are stored as matrices instead of 1 × 1 convolutions.
    pub linear_projection: bool,
}

/// Pixels as tokens: a normalisation, a map in, transformer blocks, a map out, and a shortcut.
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
    /// - `context`: `[batch, tokens, context_channels]`, where the blocks attend to one
    /// - result: as `x`
    ///
    /// # Panics
    ///
    /// Without a context that the blocks attend to.
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

/// Self-attention, attention to the context where there is one, and a feed-forward layer, each added to its input.
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
        let norm = || LayerNormConfig::new(channels).init(device);
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
    /// - `context`: `[batch, tokens of the context, context_channels]`, where the block attends to one
    /// - result: as `x`
    ///
    /// # Panics
    ///
    /// Without a context that the block attends to.
    pub fn forward(&self, x: Tensor<3>, context: Option<&Tensor<3>>) -> Tensor<3> {
        let x = self.attn1.forward(self.norm1.forward(x.clone()), None) + x;
        let x = match (&self.norm2, &self.attn2, context) {
            (Some(norm), Some(attention), Some(context)) => {
                attention.forward(norm.forward(x.clone()), Some(context.clone())) + x
            }
            (Some(_), Some(_), None) => panic!("this transformer attends to a context; give one"),
            _ => x,
        };
        self.ff.forward(self.norm3.forward(x.clone())) + x
    }
}

/// A linear map of every pixel's channels, stored as a 1 × 1 convolution (Stable Diffusion v1) or
/// as a matrix (v2). Both are computed as a matrix product that turns pixels into tokens or back on
/// its way, so that nothing is transposed in memory.
#[derive(Module, Debug)]
enum Projection {
    Conv(Conv2d),
    Linear(Linear),
}

impl Projection {
    fn new(channels: usize, linear: bool, device: &Device) -> Self {
        if linear {
            Self::Linear(LinearConfig::new(channels, channels).init(device))
        } else {
            Self::Conv(conv1x1(channels, channels, device))
        }
    }

    /// The matrix `[in, out]` and the bias.
    fn matrix(&self) -> (Tensor<2>, Option<Tensor<1>>) {
        match self {
            Self::Linear(layer) => (layer.weight.val(), layer.bias.as_ref().map(|b| b.val())),
            Self::Conv(layer) => {
                let weight = layer.weight.val();
                let [channels_out, channels_in, _, _] = weight.dims();
                let matrix = weight.reshape([channels_out, channels_in]).transpose();
                (matrix, layer.bias.as_ref().map(|b| b.val()))
            }
        }
    }

    /// `[batch, channels, pixels]` to `[batch, pixels, channels]`.
    fn to_tokens(&self, pixels: Tensor<3>) -> Tensor<3> {
        let (matrix, bias) = self.matrix();
        linear(pixels.swap_dims(1, 2), matrix, bias)
    }

    /// `[batch, pixels, channels]` to `[batch, channels, pixels]`.
    fn to_pixels(&self, tokens: Tensor<3>) -> Tensor<3> {
        let (matrix, bias) = self.matrix();
        let pixels = matrix
            .transpose()
            .unsqueeze::<3>()
            .matmul(tokens.swap_dims(1, 2));
        match bias {
            Some(bias) => pixels + bias.unsqueeze_dims(&[0, -1]),
            None => pixels,
        }
    }
}
