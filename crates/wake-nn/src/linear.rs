//! Linear layers over token sequences.

use burn::nn::Linear;
use burn::tensor::Tensor;

/// Applies a linear layer to every token, `y = x W + b`: as `Linear::forward`, and faster for large layers on burn's CPU backend.
///
/// # Shapes
///
/// - `x`: `[batch, tokens, channels in]`
/// - result: `[batch, tokens, channels out]`
pub fn linear(layer: &Linear, x: Tensor<3>) -> Tensor<3> {
    #[cfg(feature = "flex")]
    if let Some(out) = native::linear(layer, &x) {
        return out;
    }
    layer.forward(x)
}

#[cfg(feature = "flex")]
mod native {
    use super::*;
    use crate::kernels::linear::{self, Sizes};
    use crate::operation::{Operation, apply};

    /// Products of fewer multiplications are left to burn.
    const LEAST: usize = 1 << 23;

    /// `None` where the tensors are elsewhere, or small.
    pub(super) fn linear(layer: &Linear, x: &Tensor<3>) -> Option<Tensor<3>> {
        let weight = layer.weight.val();
        let ([batch, tokens, from], [channels, to]) = (x.dims(), weight.dims());
        let sizes = Sizes {
            rows: batch * tokens,
            from,
            to,
        };
        if channels != from || sizes.rows.saturating_mul(from).saturating_mul(to) < LEAST {
            return None;
        }
        let shape = [batch, tokens, to];
        let (x, weight) = (x.clone().into_dispatch(), weight.into_dispatch());
        match &layer.bias {
            None => apply(sizes, [x, weight], shape),
            Some(bias) => apply(sizes, [x, weight, bias.val().into_dispatch()], shape),
        }
    }

    /// Gradients to x and W, those that are wanted.
    fn gradients(
        [x, weight]: [&[f32]; 2],
        gradient: &[f32],
        wanted: [bool; 2],
        sizes: Sizes,
    ) -> [Vec<f32>; 2] {
        [
            wanted[0].then(|| linear::to_input(gradient, weight, sizes)),
            wanted[1].then(|| linear::to_weight(x, gradient, sizes)),
        ]
        .map(Option::unwrap_or_default)
    }

    impl Operation<2> for Sizes {
        type Saved = ();

        fn forward(&self, [x, weight]: [&[f32]; 2]) -> (Vec<f32>, ()) {
            (linear::forward(x, weight, None, *self), ())
        }

        fn gradients(
            &self,
            inputs: [&[f32]; 2],
            (): &(),
            gradient: &[f32],
            wanted: [bool; 2],
        ) -> [Vec<f32>; 2] {
            gradients(inputs, gradient, wanted, *self)
        }
    }

    impl Operation<3> for Sizes {
        type Saved = ();

        fn forward(&self, [x, weight, bias]: [&[f32]; 3]) -> (Vec<f32>, ()) {
            (linear::forward(x, weight, Some(bias), *self), ())
        }

        fn gradients(
            &self,
            [x, weight, _]: [&[f32]; 3],
            (): &(),
            gradient: &[f32],
            [a, b, of_bias]: [bool; 3],
        ) -> [Vec<f32>; 3] {
            let [x, weight] = gradients([x, weight], gradient, [a, b], *self);
            let bias = of_bias.then(|| linear::to_bias(gradient, self.to));
            [x, weight, bias.unwrap_or_default()]
        }
    }
}
