//! Maps between an image and a transformer's tokens.

use burn::module::Module;
use burn::nn::conv::Conv2d;
use burn::nn::{Linear, LinearConfig};
use burn::tensor::{Device, Tensor};

use super::conv::conv1x1;

/// Linear map of every pixel's channels, stored as a 1 × 1 convolution (Stable Diffusion v1) or as a matrix (v2).
///
/// Both are computed as a matrix product that also turns pixels into tokens or back, so nothing is transposed in memory.
#[derive(Module, Debug)]
pub(super) enum Projection {
    Conv(Conv2d),
    Linear(Linear),
}

impl Projection {
    pub(super) fn new(channels: usize, linear: bool, device: &Device) -> Self {
        if linear {
            Self::Linear(LinearConfig::new(channels, channels).init(device))
        } else {
            Self::Conv(conv1x1(channels, channels, device))
        }
    }

    /// The matrix `[out, in]` and the bias.
    fn matrix(&self) -> (Tensor<2>, Option<Tensor<1>>) {
        match self {
            Self::Linear(layer) => {
                let bias = layer.bias.as_ref().map(|b| b.val());
                (layer.weight.val().transpose(), bias)
            }
            Self::Conv(layer) => {
                let weight = layer.weight.val();
                let [channels_out, channels_in, _, _] = weight.dims();
                let bias = layer.bias.as_ref().map(|b| b.val());
                (weight.reshape([channels_out, channels_in]), bias)
            }
        }
    }

    /// Maps pixels `[batch, channels, pixels]` to tokens `[batch, pixels, channels]`.
    pub(super) fn to_tokens(&self, pixels: Tensor<3>) -> Tensor<3> {
        let (matrix, bias) = self.matrix();
        let tokens = to_tokens(pixels, matrix.transpose());
        match bias {
            Some(bias) => tokens + bias.unsqueeze(),
            None => tokens,
        }
    }

    /// Maps tokens `[batch, pixels, channels]` to pixels `[batch, channels, pixels]`.
    pub(super) fn to_pixels(&self, tokens: Tensor<3>) -> Tensor<3> {
        let (matrix, bias) = self.matrix();
        let pixels = to_pixels(tokens, matrix);
        match bias {
            Some(bias) => pixels + bias.unsqueeze_dims(&[0, -1]),
            None => pixels,
        }
    }
}

/// `Xᵀ M` of each image, `[batch, channels, pixels]` and `[in, out]` to `[batch, pixels, out]`.
fn to_tokens(pixels: Tensor<3>, matrix: Tensor<2>) -> Tensor<3> {
    #[cfg(feature = "flex")]
    if let Some(tokens) = native::to_tokens(&pixels, &matrix) {
        return tokens;
    }
    pixels.swap_dims(1, 2).matmul(matrix.unsqueeze())
}

/// `M Tᵀ` of each image, `[batch, pixels, channels]` and `[out, in]` to `[batch, out, pixels]`.
fn to_pixels(tokens: Tensor<3>, matrix: Tensor<2>) -> Tensor<3> {
    #[cfg(feature = "flex")]
    if let Some(pixels) = native::to_pixels(&tokens, &matrix) {
        return pixels;
    }
    matrix.unsqueeze().matmul(tokens.swap_dims(1, 2))
}

#[cfg(feature = "flex")]
mod native {
    use super::*;
    use crate::kernels::linear::{self, Sizes};
    use crate::operation::{Operation, apply};

    /// Pixels to tokens, with inputs X and M.
    #[derive(Debug, Clone, Copy)]
    struct ToTokens {
        pixels: usize,
        from: usize,
        to: usize,
    }

    /// Tokens to pixels, with inputs T and M.
    #[derive(Debug, Clone, Copy)]
    struct ToPixels {
        pixels: usize,
        from: usize,
        to: usize,
    }

    /// `None` unless the tensors are in f32 on burn's CPU backend.
    pub(super) fn to_tokens(x: &Tensor<3>, matrix: &Tensor<2>) -> Option<Tensor<3>> {
        let ([batch, from, pixels], [_, to]) = (x.dims(), matrix.dims());
        let inputs = [x.clone().into_dispatch(), matrix.clone().into_dispatch()];
        apply(ToTokens { pixels, from, to }, inputs, [batch, pixels, to])
    }

    /// `None` unless the tensors are in f32 on burn's CPU backend.
    pub(super) fn to_pixels(tokens: &Tensor<3>, matrix: &Tensor<2>) -> Option<Tensor<3>> {
        let ([batch, pixels, from], [to, _]) = (tokens.dims(), matrix.dims());
        let inputs = [
            tokens.clone().into_dispatch(),
            matrix.clone().into_dispatch(),
        ];
        apply(ToPixels { pixels, from, to }, inputs, [batch, to, pixels])
    }

    /// Computes the product of each image in turn and joins the results.
    fn each(x: &[f32], image: usize, product: impl Fn(&[f32]) -> Vec<f32>) -> Vec<f32> {
        let mut images = x.chunks_exact(image).map(product);
        let mut all = images.next().unwrap_or_default();
        images.for_each(|image| all.extend(image));
        all
    }

    /// Sum of the products of all images.
    fn sum<'a>(
        pairs: impl Iterator<Item = (&'a [f32], &'a [f32])>,
        product: impl Fn(&[f32], &[f32]) -> Vec<f32>,
    ) -> Vec<f32> {
        let mut products = pairs.map(|(a, b)| product(a, b));
        let mut total = products.next().unwrap_or_default();
        for product in products {
            total.iter_mut().zip(product).for_each(|(t, v)| *t += v);
        }
        total
    }

    impl ToTokens {
        /// Sizes of the layer whose gradient with respect to W is this product.
        fn sizes(&self) -> Sizes {
            Sizes {
                rows: self.from,
                from: self.pixels,
                to: self.to,
            }
        }
    }

    impl Operation<2> for ToTokens {
        type Saved = ();

        fn forward(&self, [x, matrix]: [&[f32]; 2]) -> (Vec<f32>, ()) {
            let Self { pixels, from, .. } = *self;
            let sizes = self.sizes();
            let product = |x: &[f32]| linear::to_weight(x, matrix, sizes);
            (each(x, from * pixels, product), ())
        }

        fn gradients(
            &self,
            [x, matrix]: [&[f32]; 2],
            (): &(),
            dy: &[f32],
            wanted: [bool; 2],
        ) -> [Vec<f32>; 2] {
            let Self { pixels, from, to } = *self;
            let back = self.sizes();
            let images = x
                .chunks_exact(from * pixels)
                .zip(dy.chunks_exact(pixels * to));
            [
                wanted[0].then(|| each(dy, pixels * to, |dy| linear::to_input(matrix, dy, back))),
                wanted[1].then(|| sum(images, |x, dy| linear::forward(x, dy, None, back))),
            ]
            .map(Option::unwrap_or_default)
        }
    }

    impl ToPixels {
        /// Sizes of the layer whose gradient with respect to x is this product.
        fn sizes(&self) -> Sizes {
            Sizes {
                rows: self.to,
                from: self.pixels,
                to: self.from,
            }
        }
    }

    impl Operation<2> for ToPixels {
        type Saved = ();

        fn forward(&self, [tokens, matrix]: [&[f32]; 2]) -> (Vec<f32>, ()) {
            let Self { pixels, from, .. } = *self;
            let sizes = self.sizes();
            let product = |tokens: &[f32]| linear::to_input(matrix, tokens, sizes);
            (each(tokens, pixels * from, product), ())
        }

        fn gradients(
            &self,
            [tokens, matrix]: [&[f32]; 2],
            (): &(),
            dy: &[f32],
            wanted: [bool; 2],
        ) -> [Vec<f32>; 2] {
            let Self { pixels, from, to } = *self;
            let back = self.sizes();
            let images = dy
                .chunks_exact(to * pixels)
                .zip(tokens.chunks_exact(pixels * from));
            [
                wanted[0].then(|| each(dy, to * pixels, |dy| linear::to_weight(dy, matrix, back))),
                wanted[1]
                    .then(|| sum(images, |dy, tokens| linear::forward(dy, tokens, None, back))),
            ]
            .map(Option::unwrap_or_default)
        }
    }
}

#[cfg(all(test, feature = "flex", feature = "autodiff"))]
mod tests {
    use super::*;
    use burn::tensor::{Device, Distribution};

    /// Both maps and their gradients against burn's, for one image and for several.
    #[test]
    fn maps_are_those_of_burn() {
        let device = Device::flex().autodiff();
        let normal = Distribution::Normal(0.0, 1.0);
        let random = |shape: [usize; 3]| Tensor::<3>::random(shape, normal, &device);
        let matrix = Tensor::<2>::random([70, 45], normal, &device);
        for batch in [1, 3] {
            let compare =
                |x: Tensor<3>,
                 matrix: Tensor<2>,
                 ways: [&dyn Fn(Tensor<3>, Tensor<2>) -> Tensor<3>; 2]| {
                    let [ours, burns] = ways.map(|way| -> [Vec<f32>; 3] {
                        let (x, matrix) = (x.clone().require_grad(), matrix.clone().require_grad());
                        let y = way(x.clone(), matrix.clone());
                        // This loss makes the result its own gradient, which differs everywhere.
                        let gradients = y.clone().square().sum().mul_scalar(0.5).backward();
                        let dx = x.grad(&gradients).unwrap().into_data();
                        let dmatrix = matrix.grad(&gradients).unwrap().into_data();
                        [y.into_data(), dx, dmatrix].map(|data| data.iter::<f32>().collect())
                    });
                    for (ours, burns) in ours.iter().zip(&burns) {
                        assert_eq!(ours.len(), burns.len());
                        let largest = burns.iter().fold(0f32, |m, v| m.max(v.abs()));
                        // At most 3 · 90 terms are summed in another order.
                        let near = |(a, b): (&f32, &f32)| (a - b).abs() < 270.0 * 6e-8 * largest;
                        assert!(ours.iter().zip(burns).all(near), "{batch}");
                    }
                };
            let tokens = |x: Tensor<3>, m: Tensor<2>| x.swap_dims(1, 2).matmul(m.unsqueeze());
            let ours = |x: Tensor<3>, m: Tensor<2>| native::to_tokens(&x, &m).unwrap();
            compare(random([batch, 70, 90]), matrix.clone(), [&ours, &tokens]);
            let pixels = |t: Tensor<3>, m: Tensor<2>| m.unsqueeze().matmul(t.swap_dims(1, 2));
            let ours = |t: Tensor<3>, m: Tensor<2>| native::to_pixels(&t, &m).unwrap();
            compare(random([batch, 90, 45]), matrix.clone(), [&ours, &pixels]);
        }
    }
}
