//! Multi-head attention over token sequences.

use burn::module::Module;
use burn::nn::{Linear, LinearConfig};
use burn::tensor::module::attention as scaled_dot_product;
use burn::tensor::ops::AttentionModuleOptions;
use burn::tensor::{DType, Device, Tensor};

use super::linear::linear;
use super::{cast_to, is_half};

/// Multi-head attention, with an equal share of the channels for each head.
///
/// ```text
/// head_h = softmax(Q_h K_hᵀ / √d) V_h
/// ```
///
/// - `d`: channels per head
/// - `causal`: position i attends only to positions 0…i
///
/// Half-precision inputs are widened to f32 for the products and the softmax, so that logits
/// beyond 65,504 stay finite, and narrowed again.
///
/// # Shapes
///
/// - `query`: `[batch, tokens, channels]`
/// - `key`, `value`: `[batch, tokens of the context, channels]`
/// - result: `[batch, tokens, channels]`
///
/// # References
///
/// Vaswani et al. (2017), "Attention Is All You Need", Eq. 1.
pub fn attention(
    query: Tensor<3>,
    key: Tensor<3>,
    value: Tensor<3>,
    heads: usize,
    causal: bool,
) -> Tensor<3> {
    #[cfg(feature = "flex")]
    if let Some(out) = native::attention([&query, &key, &value], heads, causal) {
        return out;
    }
    let dtype = query.dtype();
    if is_half(dtype) {
        let wide = |x| cast_to(x, DType::F32);
        let out = attention(wide(query), wide(key), wide(value), heads, causal);
        return cast_to(out, dtype);
    }
    let [batch, tokens, channels] = query.dims();
    let options = AttentionModuleOptions {
        is_causal: causal,
        ..Default::default()
    };
    let (query, key, value) = (
        split_heads(query, heads),
        split_heads(key, heads),
        split_heads(value, heads),
    );
    scaled_dot_product(query, key, value, None, None, options)
        .swap_dims(1, 2)
        .reshape([batch, tokens, channels])
}

fn split_heads(x: Tensor<3>, heads: usize) -> Tensor<4> {
    let [batch, tokens, channels] = x.dims();
    x.reshape([batch, tokens, heads, channels / heads])
        .swap_dims(1, 2)
}

/// Attention of the U-Net and the autoencoder: self-attention, or attention to a context such as a prompt.
#[derive(Module, Debug)]
pub struct CrossAttention {
    to_q: Linear,
    to_k: Linear,
    to_v: Linear,
    to_out: Linear,
    heads: usize,
}

impl CrossAttention {
    /// A layer with random weights; `bias` says whether query, key and value have one.
    pub fn new(
        channels: usize,
        context_channels: usize,
        heads: usize,
        bias: bool,
        device: &Device,
    ) -> Self {
        let linear = |from, bias| {
            LinearConfig::new(from, channels)
                .with_bias(bias)
                .init(device)
        };
        Self {
            to_q: linear(channels, bias),
            to_k: linear(context_channels, bias),
            to_v: linear(context_channels, bias),
            to_out: linear(channels, true),
            heads,
        }
    }

    /// Attends from `x` to `context`, or to `x` itself without a context.
    ///
    /// The softmax over a single token is 1: every token of `x` then gets that token's value, and nothing else is computed.
    ///
    /// # Shapes
    ///
    /// - `x`: `[batch, tokens, channels]`
    /// - `context`: `[batch, tokens of the context, context_channels]`
    /// - result: as `x`
    pub fn forward(&self, x: Tensor<3>, context: Option<Tensor<3>>) -> Tensor<3> {
        let context = context.unwrap_or_else(|| x.clone());
        if context.dims()[1] == 1 {
            let seen = linear(&self.to_out, linear(&self.to_v, context));
            return seen.repeat_dim(1, x.dims()[1]);
        }
        let key = linear(&self.to_k, context.clone());
        let value = linear(&self.to_v, context);
        let query = linear(&self.to_q, x);
        let seen = attention(query, key, value, self.heads, false);
        linear(&self.to_out, seen)
    }
}

/// Attention on burn's CPU backend, one block of queries at a time.
#[cfg(feature = "flex")]
mod native {
    use super::*;
    use crate::kernels::attention::{self, Attended, Shape, Softmax};
    use crate::operation::{Operation, apply, values_of};
    use burn::backend::flex::FlexTensor;

    /// Results of the forward pass that the gradients need in addition to the inputs.
    #[derive(Debug, Clone)]
    pub(crate) struct Saved {
        softmax: Vec<Softmax>,
        result: Option<FlexTensor>,
    }

    /// `None` unless the tensors are in f32 on burn's CPU backend.
    pub(super) fn attention(
        inputs: [&Tensor<3>; 3],
        heads: usize,
        causal: bool,
    ) -> Option<Tensor<3>> {
        let [batch, asking, channels] = inputs[0].dims();
        let [_, seen, _] = inputs[1].dims();
        let shape = Shape {
            batch,
            heads,
            channels,
            tokens: [asking, seen],
            causal,
        };
        let seen_dims = [batch, seen, channels];
        let same = inputs[1].dims() == seen_dims && inputs[2].dims() == seen_dims;
        let plain = same && channels.is_multiple_of(heads) && batch * asking * seen > 0;
        if !plain || (causal && asking != seen) {
            return None;
        }
        let tensors = inputs.map(|x| x.clone().into_dispatch());
        apply(shape, tensors, [batch, asking, channels])
    }

    impl Operation<3> for Shape {
        type Saved = Saved;

        fn forward(&self, [query, key, value]: [&[f32]; 3]) -> (Vec<f32>, Saved) {
            let (values, softmax) = attention::attend(query, key, value, self);
            let result = None;
            (values, Saved { softmax, result })
        }

        fn keep(saved: &mut Saved, result: &FlexTensor) {
            saved.result = Some(result.clone());
        }

        fn gradients(
            &self,
            inputs: [&[f32]; 3],
            saved: &Saved,
            gradient: &[f32],
            _: [bool; 3],
        ) -> [Vec<f32>; 3] {
            let attended = Attended {
                values: saved.result.as_ref().map_or(&[], values_of),
                softmax: &saved.softmax,
            };
            attention::gradients(inputs, attended, gradient, self)
        }
    }
}

#[cfg(all(test, feature = "flex"))]
mod tests {
    use super::*;
    use crate::noise::{NoiseSource, normal_batch};

    /// A single token gives the same result as two copies of it, which take the full computation.
    #[test]
    fn a_single_token_is_seen_as_two_of_it_are() {
        let device = Device::flex();
        let layer = CrossAttention::new(8, 6, 2, true, &device);
        let noise = |seed, [tokens, channels]: [usize; 2]| -> Tensor<3> {
            normal_batch(&[NoiseSource::new(seed)], 0, [1, tokens, channels], &device)
                .reshape([1, tokens, channels])
        };
        let (x, token) = (noise(1, [5, 8]), noise(2, [1, 6]));
        let one = layer.forward(x.clone(), Some(token.clone()));
        let two = layer.forward(x, Some(token.repeat_dim(1, 2)));
        assert_eq!(one.dims(), [1, 5, 8]);
        // Values are around 1, with a few roundings of 6e-8 each.
        assert!((one - two).abs().max().into_scalar::<f32>() < 1e-6);
    }
}
