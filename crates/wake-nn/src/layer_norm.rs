//! Layer normalisation: burn's layer, computed by kernels of our own on burn's CPU backend.

use burn::nn::LayerNorm;
use burn::tensor::Tensor;

/// ε of the normalisations that [`layer_norm`] is applied to: burn's and PyTorch's default.
pub(super) const EPSILON: f64 = 1e-5;

/// Normalises every token: as `LayerNorm::forward`, and faster with gradients on burn's CPU backend.
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

    /// `None` where the tensors are elsewhere, or the layer has no bias.
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
    use burn::module::Param;
    use burn::nn::LayerNormConfig;
    use burn::tensor::{Device, Distribution};

    /// Results and all gradients beside burn's, for numbers of channels and tokens that fill vectors and parts, and for others.
    #[test]
    fn layers_are_those_of_burn() {
        let device = Device::flex().autodiff();
        let normal = Distribution::Normal(0.5, 2.0);
        for [batch, tokens, channels] in [[1, 1, 3], [2, 40, 96], [1, 900, 70]] {
            let mut layer = LayerNormConfig::new(channels)
                .with_epsilon(EPSILON)
                .init(&device);
            layer.gamma = Param::from_tensor(Tensor::random([channels], normal, &device));
            layer.beta = Some(Param::from_tensor(Tensor::random(
                [channels],
                normal,
                &device,
            )));
            let x = Tensor::<3>::random([batch, tokens, channels], normal, &device);
            let seen = |apply: &dyn Fn(Tensor<3>) -> Tensor<3>| -> [Vec<f32>; 4] {
                let x = x.clone().require_grad();
                let y = apply(x.clone());
                // The gradient of the result is the result: unlike everywhere.
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
            for (n, (ours, burns)) in ours.iter().zip(&burns).enumerate() {
                assert_eq!(ours.len(), burns.len());
                let largest = burns.iter().fold(0f32, |m, v| m.max(v.abs()));
                // Sums over tokens or channels in another order, one rounding after the other, and a dozen roundings before.
                let terms = (batch * tokens).max(channels) + 12;
                let allowed = terms as f32 * 6e-8 * largest;
                for (a, b) in ours.iter().zip(burns) {
                    assert!(
                        (a - b).abs() <= allowed,
                        "{n}, {channels} channels: {a} and {b}"
                    );
                }
            }
        }
    }
}
