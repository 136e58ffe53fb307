//! Activation functions: burn's formulas, computed by the crate's own kernels on burn's CPU backend.

use burn::tensor::Tensor;
use burn::tensor::activation::{gelu as fused_gelu, sigmoid, silu as fused_silu};

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

/// Sigmoid linear unit.
///
/// ```text
/// y = x · σ(x)
/// ```
///
/// # References
///
/// Hendrycks & Gimpel (2016), "Gaussian Error Linear Units", section 4.
pub fn silu<const D: usize>(x: Tensor<D>) -> Tensor<D> {
    #[cfg(feature = "flex")]
    if let Some(y) = native::map(&x, Curve::Swish(1.0)) {
        return y;
    }
    fused_silu(x)
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
    #[cfg(feature = "flex")]
    if let Some(y) = native::map(&x, Curve::Swish(1.702)) {
        return y;
    }
    sigmoid(x.clone() * 1.702) * x
}

/// Gaussian error linear unit, with an exact derivative.
///
/// ```text
/// y = x · Φ(x) = ½ x (1 + erf(x / √2))
/// ```
///
/// The fused operation of most backends differentiates the tanh approximation instead, which is off by
/// about 1e-4; the formula is therefore written out when gradients are needed.
///
/// # References
///
/// Hendrycks & Gimpel (2016), "Gaussian Error Linear Units", section 2.
pub fn gelu<const D: usize>(x: Tensor<D>) -> Tensor<D> {
    #[cfg(feature = "flex")]
    if let Some(y) = native::map(&x, Curve::Gelu) {
        return y;
    }
    if !x.is_autodiff() {
        return fused_gelu(x);
    }
    ((x.clone() * std::f64::consts::FRAC_1_SQRT_2).erf() + 1.0) * x * 0.5
}

/// Gated GELU of a feed-forward layer.
///
/// ```text
/// y = a ⊙ gelu(b),   x = (a, b)
/// ```
///
/// # Shapes
///
/// `[batch, tokens, 2 · inner]` to `[batch, tokens, inner]`
///
/// # References
///
/// Shazeer (2020), "GLU Variants Improve Transformer", Eq. 6 (GEGLU).
pub(super) fn geglu(x: Tensor<3>) -> Tensor<3> {
    let inner = x.dims()[2] / 2;
    #[cfg(feature = "flex")]
    if let Some(y) = native::gate(&x, inner) {
        return y;
    }
    let gate = gelu(x.clone().narrow(2, inner, inner));
    x.narrow(2, 0, inner) * gate
}

#[cfg(feature = "flex")]
use crate::kernels::pointwise::Curve;

#[cfg(feature = "flex")]
mod native {
    use super::*;
    use crate::kernels::pointwise;
    use crate::operation::{Operation, apply};

    /// `None` unless the tensor is in f32 on burn's CPU backend.
    pub(super) fn map<const D: usize>(x: &Tensor<D>, curve: Curve) -> Option<Tensor<D>> {
        apply(curve, [x.clone().into_dispatch()], x.dims())
    }

    /// `None` unless the tensor is in f32 on burn's CPU backend.
    pub(super) fn gate(x: &Tensor<3>, inner: usize) -> Option<Tensor<3>> {
        let [batch, tokens, _] = x.dims();
        apply(
            Gate { inner },
            [x.clone().into_dispatch()],
            [batch, tokens, inner],
        )
    }

    impl Operation<1> for Curve {
        type Saved = ();

        fn forward(&self, [x]: [&[f32]; 1]) -> (Vec<f32>, ()) {
            (pointwise::map(x, *self), ())
        }

        fn gradients(&self, [x]: [&[f32]; 1], (): &(), dy: &[f32], _: [bool; 1]) -> [Vec<f32>; 1] {
            [pointwise::map_gradient(x, dy, *self)]
        }
    }

    #[derive(Debug, Clone, Copy)]
    struct Gate {
        inner: usize,
    }

    impl Operation<1> for Gate {
        type Saved = ();

        fn forward(&self, [x]: [&[f32]; 1]) -> (Vec<f32>, ()) {
            (pointwise::gate(x, self.inner), ())
        }

        fn gradients(&self, [x]: [&[f32]; 1], (): &(), dy: &[f32], _: [bool; 1]) -> [Vec<f32>; 1] {
            [pointwise::gate_gradient(x, dy, self.inner)]
        }
    }
}
