//! Layer normalisation: burn's layer, computed by the crate's own kernels on burn's CPU backend.

use burn::nn::LayerNorm;
use burn::tensor::Tensor;

/// ε of the normalisations computed by [`layer_norm`], the default of burn and PyTorch.
pub(super) const EPSILON: f64 = 1e-5;

/// Normalises every token as `LayerNorm::forward` does, but faster with gradients on burn's CPU backend.
///
/// # Shapes
///
/// `[batch, tokens, channels]`, in and out.
pub(super) fn layer_norm(layer: &LayerNorm, x: Tensor<3>) -> Tensor<3> {
    #[cfg(feature = "flex")]
    if let Some(y) = native::normalize(layer, &x) {
        return y;
    }
    layer.forward(x)
}

#[cfg(feature = "flex")]
mod native {
    use super::*;
    use crate::kernels::layer_norm::{self, Moments};
    use crate::operation::{Operation, apply};

    #[derive(Debug, Clone, Copy)]
    struct Normalization;

    /// `None` unless the tensors are in f32 on burn's CPU backend and the layer has a bias.
    pub(super) fn normalize(layer: &LayerNorm, x: &Tensor<3>) -> Option<Tensor<3>> {
        let [weight, bias] = [&layer.gamma, layer.beta.as_ref()?].map(|p| p.val());
        let inputs = [
            x.clone().into_dispatch(),
            weight.into_dispatch(),
            bias.into_dispatch(),
        ];
        apply(Normalization, inputs, x.dims())
    }

    impl Operation<3> for Normalization {
        type Saved = Moments;

        fn forward(&self, [x, weight, bias]: [&[f32]; 3]) -> (Vec<f32>, Moments) {
            layer_norm::normalize(x, [weight, bias], EPSILON as f32)
        }

        fn gradients(
            &self,
            [x, weight, _]: [&[f32]; 3],
            moments: &Moments,
            dy: &[f32],
            [to_x, to_weight, to_bias]: [bool; 3],
        ) -> [Vec<f32>; 3] {
            let dx = to_x.then(|| layer_norm::to_input(x, dy, weight, moments));
            let parameters = (to_weight || to_bias)
                .then(|| layer_norm::to_parameters(x, dy, moments, weight.len()));
            let [weight, bias] = parameters.unwrap_or_default();
            [dx.unwrap_or_default(), weight, bias]
        }
    }
}

#[cfg(all(test, feature = "flex", feature = "autodiff"))]
mod tests {
    use super::*;
    use crate::noise::NoiseSource;
    use burn::module::Param;
    use burn::nn::LayerNormConfig;
    use burn::tensor::Device;

    /// Results and gradients against burn's, for sizes that fill vectors and parts and for sizes that do not.
    #[test]
    fn layers_are_those_of_burn() {
        let device = Device::flex().autodiff();
        for [batch, tokens, channels] in [[1, 1, 3], [2, 40, 96], [1, 900, 70]] {
            let normal = |stream, length| -> Vec<f32> {
                let values = NoiseSource::new(7).normal(stream, length);
                values.iter().map(|v| 0.5 + 2.0 * v).collect()
            };
            let [gamma, beta] = [0, 1].map(|stream| normal(stream, channels));
            let values = normal(2, batch * tokens * channels);
            let mut layer = LayerNormConfig::new(channels)
                .with_epsilon(EPSILON)
                .init(&device);
            layer.gamma = Param::from_tensor(Tensor::from_floats(&gamma[..], &device));
            layer.beta = Some(Param::from_tensor(Tensor::from_floats(&beta[..], &device)));
            let x = Tensor::<1>::from_floats(&values[..], &device);
            let x = x.reshape([batch, tokens, channels]);
            let seen = |apply: &dyn Fn(Tensor<3>) -> Tensor<3>| -> [Vec<f32>; 4] {
                let x = x.clone().require_grad();
                let y = apply(x.clone());
                // This loss makes the result its own gradient, which differs everywhere.
                let gradients = y.clone().square().sum().mul_scalar(0.5).backward();
                let parameters = [&layer.gamma, layer.beta.as_ref().unwrap()];
                let [weight, bias] = parameters.map(|p| p.val().grad(&gradients).unwrap());
                let dx = x.grad(&gradients).unwrap();
                [
                    y.into_data(),
                    dx.into_data(),
                    weight.into_data(),
                    bias.into_data(),
                ]
                .map(|data| data.iter::<f32>().collect())
            };
            let ours = seen(&|x| native::normalize(&layer, &x).unwrap());
            let burns = seen(&|x| layer.forward(x));
            let allowed = roundings(&values, &gamma, &ours[0]);
            for (n, (ours, burns)) in ours.iter().zip(&burns).enumerate() {
                assert_eq!(ours.len(), burns.len());
                for (a, b) in ours.iter().zip(burns) {
                    assert!(
                        (a - b).abs() <= allowed[n],
                        "{n}, {channels} channels: {a} and {b}"
                    );
                }
            }
        }
    }

    /// Largest difference between two orders of summation, in `y` and in the gradients of `½ Σ y²` for x, weight and bias.
    ///
    /// A token's mean μ and deviation σ are sums of as many terms as there are channels, so x̂ = (x − μ)/σ is uncertain by
    /// u = terms · ε · max|x|/σ · max(1, x̂²), and y by γ u. The gradient with respect to x is γ (y − …)/σ, three terms that
    /// cancel: its error follows from the size of the terms, not from its own. (With three channels, normalisation leaves one
    /// degree of freedom of two, and the gradient nearly vanishes.)
    fn roundings(x: &[f32], gamma: &[f32], y: &[f32]) -> [f32; 4] {
        let largest = |values: &[f32]| values.iter().fold(0f32, |m, v| m.max(v.abs()));
        let channels = gamma.len() as f32;
        let mut deviation = f32::INFINITY;
        let mut normalized = 1f32;
        for token in x.chunks_exact(gamma.len()) {
            let mean = token.iter().sum::<f32>() / channels;
            let square = token.iter().map(|v| (v - mean).powi(2)).sum::<f32>() / channels;
            let of_token = (square + EPSILON as f32).sqrt();
            let from_mean = token.iter().fold(0f32, |m, v| m.max((v - mean).abs()));
            deviation = deviation.min(of_token);
            normalized = normalized.max(from_mean / of_token);
        }
        let terms = channels + 12.0; // and a dozen roundings beside the sums
        let of_normalized =
            terms * f32::EPSILON / 2.0 * largest(x) / deviation * normalized * normalized;
        let of_y = largest(gamma) * of_normalized;
        // Each of the three terms is at most γ y (1, x̂²)/σ.
        let y = largest(y);
        let of_input = largest(gamma) / deviation
            * (of_y
                + (terms * f32::EPSILON / 2.0 * y + of_y) * normalized * normalized
                + 2.0 * y * normalized * of_normalized);
        let tokens = x.len() as f32 / channels;
        let of_sum = tokens * f32::EPSILON / 2.0 * tokens * y;
        [
            of_y,
            of_input,
            tokens * (of_y * normalized + y * of_normalized) + of_sum * normalized,
            tokens * of_y + of_sum,
        ]
    }
}
