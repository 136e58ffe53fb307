//! Activations that burn lacks.

use burn::tensor::Tensor;
use burn::tensor::activation::{gelu as fused_gelu, sigmoid};

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

/// Gaussian error linear unit, with an exact derivative.
///
/// ```text
/// y = x · Φ(x) = ½ x (1 + erf(x / √2))
/// ```
///
/// The fused operation of most backends differentiates the tanh approximation instead, which is off by
/// about 1e-4; where gradients are wanted, the formula is therefore spelled out.
///
/// # References
///
/// Hendrycks & Gimpel (2016), "Gaussian Error Linear Units", section 2.
pub fn gelu<const D: usize>(x: Tensor<D>) -> Tensor<D> {
    if !x.is_autodiff() {
        return fused_gelu(x);
    }
    ((x.clone() * std::f64::consts::FRAC_1_SQRT_2).erf() + 1.0) * x * 0.5
}
