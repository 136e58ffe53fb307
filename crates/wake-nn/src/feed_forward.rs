//! The gated feed-forward layer of the U-Net's transformers.

use burn::module::Module;
use burn::nn::{Linear, LinearConfig};
use burn::tensor::{Device, Tensor};

use super::activation::geglu;
use super::linear::linear;

/// Gated feed-forward layer, which widens every token to four times its channels and narrows it again.
///
/// ```text
/// y = (a ⊙ gelu(b)) W_out,   (a, b) = x W_proj
/// ```
///
/// The first half of the product is the value, the second the gate, with the exact (error
/// function) gelu.
///
/// # References
///
/// Shazeer (2020), "GLU Variants Improve Transformer", Eq. 6 (GEGLU).
#[derive(Module, Debug)]
pub struct FeedForward {
    proj: Linear,
    out: Linear,
}

impl FeedForward {
    /// A layer with random weights.
    pub fn new(channels: usize, device: &Device) -> Self {
        let inner = 4 * channels;
        Self {
            proj: LinearConfig::new(channels, 2 * inner).init(device),
            out: LinearConfig::new(inner, channels).init(device),
        }
    }

    /// Applies the layer to every token.
    ///
    /// # Shapes
    ///
    /// `[batch, tokens, channels]`, in and out.
    pub fn forward(&self, x: Tensor<3>) -> Tensor<3> {
        linear(&self.out, geglu(linear(&self.proj, x)))
    }
}
