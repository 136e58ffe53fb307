//! Group normalisation that stays finite in half precision.

use burn::module::{Initializer, Module, Param};
use burn::tensor::{DType, Device, Tensor};

use super::activation::silu;
use super::{cast_to, is_half};

/// Normalises groups of channels to mean 0 and variance 1, then scales and shifts each channel.
///
/// ```text
/// y = (x − μ_g) / √(σ_g² + ε) · weight_c + bias_c
/// ```
///
/// - `μ_g`, `σ_g²`: mean and (biased) variance over all pixels of the channels of one group
/// - `ε`: keeps constant images finite; they give `bias_c`
///
/// The statistics of f16 and bf16 images are taken in f32: a sum of squares overflows in f16 and
/// loses its digits in bf16.
///
/// # References
///
/// Wu & He (2018), "Group Normalization", Eq. 1 and 7.
#[derive(Module, Debug)]
pub struct GroupNorm {
    weight: Param<Tensor<1>>,
    bias: Param<Tensor<1>>,
    groups: usize,
    epsilon: f64,
}

impl GroupNorm {
    /// A layer that normalises without scale and shift, until it is trained or loaded.
    ///
    /// # Panics
    ///
    /// When the channels cannot be divided into that many groups.
    pub fn new(groups: usize, channels: usize, epsilon: f64, device: &Device) -> Self {
        assert!(
            groups > 0 && channels.is_multiple_of(groups),
            "{channels} channels cannot be divided into {groups} groups"
        );
        Self {
            weight: Initializer::Ones.init([channels], device),
            bias: Initializer::Zeros.init([channels], device),
            groups,
            epsilon,
        }
    }

    /// Normalises an image.
    ///
    /// # Shapes
    ///
    /// `[batch, channels, rows, columns]`, in and out.
    pub fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        #[cfg(feature = "flex")]
        if let Some(y) = native::normalize(self, &x, false) {
            return y;
        }
        let dtype = x.dtype();
        if is_half(dtype) {
            return cast_to(self.normalize(cast_to(x, DType::F32)), dtype);
        }
        self.normalize(x)
    }

    /// Normalises an image and applies SiLU, the pair that precedes every convolution.
    ///
    /// # Shapes
    ///
    /// `[batch, channels, rows, columns]`, in and out.
    pub fn forward_silu(&self, x: Tensor<4>) -> Tensor<4> {
        #[cfg(feature = "flex")]
        if let Some(y) = native::normalize(self, &x, true) {
            return y;
        }
        silu(self.forward(x))
    }

    fn normalize(&self, x: Tensor<4>) -> Tensor<4> {
        let [batch, channels, rows, columns] = x.dims();
        let per_group = channels / self.groups;
        let x = x.reshape([batch, self.groups, per_group * rows * columns]);
        let mean = x.clone().mean_dim(2);
        let x = x - mean;
        let variance = x.clone().square().mean_dim(2);
        let inverse = (variance + self.epsilon).sqrt().recip();
        let inverse = inverse.expand([batch, self.groups, per_group]);
        let scale = inverse.reshape([batch, channels, 1, 1]) * self.per_channel(&self.weight);
        x.reshape([batch, channels, rows, columns]) * scale + self.per_channel(&self.bias)
    }

    fn per_channel(&self, parameter: &Param<Tensor<1>>) -> Tensor<4> {
        let parameter = parameter.val();
        let [channels] = parameter.dims();
        cast_to(parameter, DType::F32).reshape([1, channels, 1, 1])
    }
}

/// Normalisation by the crate's own kernels on burn's CPU backend.
#[cfg(feature = "flex")]
mod native {
    use super::*;
    use crate::kernels::group_norm::{self, Moments, Shape};
    use crate::operation::{Operation, apply};

    /// `None` unless the tensors are in f32 on burn's CPU backend.
    pub(super) fn normalize(layer: &GroupNorm, x: &Tensor<4>, silu: bool) -> Option<Tensor<4>> {
        let [_, channels, rows, columns] = x.dims();
        let shape = Shape {
            channels,
            groups: layer.groups,
            pixels: rows * columns,
            epsilon: layer.epsilon as f32,
            silu,
        };
        let [weight, bias] = [&layer.weight, &layer.bias].map(|p| p.val().into_dispatch());
        apply(shape, [x.clone().into_dispatch(), weight, bias], x.dims())
    }

    impl Operation<3> for Shape {
        type Saved = Moments;

        fn forward(&self, [x, weight, bias]: [&[f32]; 3]) -> (Vec<f32>, Moments) {
            group_norm::normalize(x, [weight, bias], self)
        }

        fn gradients(
            &self,
            [x, weight, bias]: [&[f32]; 3],
            moments: &Moments,
            dy: &[f32],
            _: [bool; 3],
        ) -> [Vec<f32>; 3] {
            group_norm::gradients(x, dy, [weight, bias], moments, self)
        }
    }
}
