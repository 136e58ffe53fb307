//! Activations that burn lacks.

use burn::tensor::Tensor;
use burn::tensor::activation::{gelu, sigmoid};

/// The activation between the two matrices of a transformer's feed-forward layer.
#[derive(burn::config::Config, Debug, Copy, PartialEq, Eq)]
pub enum Activation {
    /// `x · σ(1.702 x)`, as in the text encoder of Stable Diffusion v1.
    QuickGelu,
    /// `x · Φ(x)` with the exact normal distribution function.
    Gelu,
}

impl Activation {
    /// Applies the activation to every element.
    pub fn forward<const D: usize>(self, x: Tensor<D>) -> Tensor<D> {
        match self {
            Self::QuickGelu => quick_gelu(x),
            Self::Gelu => gelu(x),
        }
    }
}

/// Sigmoid approximation of the Gaussian error linear unit.
///
/// ```text
/// y = x · σ(1.702 x)
/// ```
///
/// # References
///
/// Hendrycks & Gimpel (2016), "Gaussian Error Linear Units", section 2.
pub fn quick_gelu<const D: usize>(x: Tensor<D>) -> Tensor<D> {
    sigmoid(x.clone() * 1.702) * x
}
