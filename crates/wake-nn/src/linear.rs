//! Linear layers over token sequences.

use burn::nn::Linear;
use burn::tensor::Tensor;

/// Applies a linear layer to every token, `y = x W + b`.
///
/// The result equals the result of `Linear::forward`, computed faster for large layers on burn's CPU backend.
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

    /// Products with fewer multiplications are left to burn.
    const LEAST: usize = 1 << 23;

    /// `None` unless the tensors are in f32 on burn's CPU backend and the product is large.
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

    /// Gradients with respect to x and W, where wanted.
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

#[cfg(all(test, feature = "flex", feature = "autodiff"))]
mod tests {
    use super::*;
    use burn::nn::LinearConfig;
    use burn::tensor::{Device, Distribution};

    /// Results and gradients of a layer large enough for the kernels, with and without bias, against burn's.
    #[test]
    fn large_layers_are_those_of_burn() {
        let device = Device::flex().autodiff();
        for bias in [true, false] {
            let layer = LinearConfig::new(512, 300).with_bias(bias).init(&device);
            let normal = Distribution::Normal(0.0, 1.0);
            let x = Tensor::<3>::random([2, 40, 512], normal, &device);
            let seen = |apply: &dyn Fn(Tensor<3>) -> Tensor<3>| -> Vec<Vec<f32>> {
                let x = x.clone().require_grad();
                let y = apply(x.clone());
                // This loss makes the result its own gradient, which differs everywhere.
                let gradients = y.clone().square().sum().mul_scalar(0.5).backward();
                let mut all = vec![
                    y.into_data(),
                    x.grad(&gradients).unwrap().into_data(),
                    layer.weight.val().grad(&gradients).unwrap().into_data(),
                ];
                let bias = layer.bias.as_ref();
                all.extend(bias.map(|bias| bias.val().grad(&gradients).unwrap().into_data()));
                let numbers = all.into_iter().map(|data| data.iter::<f32>().collect());
                numbers.collect()
            };
            let (ours, burns) = (
                seen(&|x| native::linear(&layer, &x).unwrap()),
                seen(&|x| layer.forward(x)),
            );
            assert_eq!(ours.len(), 3 + usize::from(bias));
            for (ours, burns) in ours.iter().zip(&burns) {
                assert_eq!(ours.len(), burns.len());
                let largest = burns.iter().fold(0f32, |m, v| m.max(v.abs()));
                // At most 512 terms are summed in another order.
                let near = |(a, b): (&f32, &f32)| (a - b).abs() < 512.0 * 6e-8 * largest;
                assert!(ours.iter().zip(burns).all(near), "{bias}");
            }
        }
    }
}
