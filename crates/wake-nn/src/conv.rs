//! Convolutions: burn's layers, computed by the crate's own kernels on burn's CPU backend.

use burn::nn::PaddingConfig2d;
use burn::nn::conv::{Conv2d, Conv2dConfig};
use burn::tensor::{Device, Tensor};

/// A 3 × 3 convolution that keeps the size of the image, with a border of one zero.
pub fn conv3x3(channels_in: usize, channels_out: usize, device: &Device) -> Conv2d {
    Conv2dConfig::new([channels_in, channels_out], [3, 3])
        .with_padding(PaddingConfig2d::Explicit(1, 1, 1, 1))
        .init(device)
}

/// A linear map of the channels of every pixel: a 1 × 1 convolution.
pub fn conv1x1(channels_in: usize, channels_out: usize, device: &Device) -> Conv2d {
    Conv2dConfig::new([channels_in, channels_out], [1, 1]).init(device)
}

/// Applies a layer to a batch of images.
///
/// # Shapes
///
/// `[batch, channels in, rows, columns]` to `[batch, channels out, rows out, columns out]`.
pub fn convolve(layer: &Conv2d, x: Tensor<4>) -> Tensor<4> {
    #[cfg(feature = "flex")]
    if let Some(y) = native::convolve(layer, &x) {
        return y;
    }
    layer.forward(x)
}

#[cfg(feature = "flex")]
mod native {
    use super::*;
    use crate::kernels::conv::{self, Geometry};
    use crate::operation::{Operation, apply};

    /// `None` unless the tensors are in f32 on burn's CPU backend and the kernels support the layer.
    pub(super) fn convolve(layer: &Conv2d, x: &Tensor<4>) -> Option<Tensor<4>> {
        let geometry = geometry(layer, x.dims())?;
        let [rows, columns] = geometry.size_out();
        let shape = [geometry.batch, geometry.channels[1], rows, columns];
        let x = x.clone().into_dispatch();
        let weight = layer.weight.val().into_dispatch();
        match &layer.bias {
            Some(bias) => apply(geometry, [x, weight, bias.val().into_dispatch()], shape),
            None => apply(geometry, [x, weight], shape),
        }
    }

    /// Sizes of a layer with a square kernel on images of these dimensions; `None` for other layers.
    pub(super) fn geometry(layer: &Conv2d, dims: [usize; 4]) -> Option<Geometry> {
        let [batch, channels_in, rows, columns] = dims;
        let [channels_out, kernel_channels, kernel, kernel_columns] = layer.weight.dims();
        let border = match layer.padding {
            PaddingConfig2d::Valid => [0; 4],
            PaddingConfig2d::Explicit(top, left, bottom, right) => [top, left, bottom, right],
            PaddingConfig2d::Same => return None,
        };
        let plain = kernel == kernel_columns
            && kernel_channels == channels_in
            && layer.stride[0] == layer.stride[1]
            && layer.dilation == [1, 1]
            && border.iter().all(|&zeros| zeros < kernel)
            && rows + border[0] + border[2] >= kernel
            && columns + border[1] + border[3] >= kernel
            && batch > 0;
        plain.then_some(Geometry {
            batch,
            channels: [channels_in, channels_out],
            size: [rows, columns],
            kernel,
            stride: layer.stride[0],
            border,
        })
    }

    impl Operation<2> for Geometry {
        type Saved = ();

        fn forward(&self, [x, weight]: [&[f32]; 2]) -> (Vec<f32>, ()) {
            (conv::convolve(x, weight, None, self), ())
        }

        fn gradients(
            &self,
            [x, weight]: [&[f32]; 2],
            (): &(),
            dy: &[f32],
            wanted: [bool; 2],
        ) -> [Vec<f32>; 2] {
            let if_wanted = |i: usize, gradient: &dyn Fn() -> Vec<f32>| {
                if wanted[i] { gradient() } else { Vec::new() }
            };
            [
                if_wanted(0, &|| conv::image_gradient(dy, weight, self)),
                if_wanted(1, &|| conv::weight_gradient(x, dy, self)),
            ]
        }
    }

    impl Operation<3> for Geometry {
        type Saved = ();

        fn forward(&self, [x, weight, bias]: [&[f32]; 3]) -> (Vec<f32>, ()) {
            (conv::convolve(x, weight, Some(bias), self), ())
        }

        fn gradients(
            &self,
            [x, weight, _]: [&[f32]; 3],
            (): &(),
            dy: &[f32],
            wanted: [bool; 3],
        ) -> [Vec<f32>; 3] {
            let [dx, dweight] =
                Operation::<2>::gradients(self, [x, weight], &(), dy, [wanted[0], wanted[1]]);
            [dx, dweight, conv::bias_gradient(dy, self)]
        }
    }
}

#[cfg(all(test, feature = "flex"))]
mod tests {
    use super::*;

    /// Other layers are left to burn.
    #[test]
    fn kernels_compute_square_layers_of_one_stride_and_one_group() {
        let device = Device::flex();
        let computes =
            |layer: Conv2dConfig| native::geometry(&layer.init(&device), [2, 4, 5, 7]).is_some();
        let plain = || {
            Conv2dConfig::new([4, 6], [3, 3]).with_padding(PaddingConfig2d::Explicit(1, 1, 1, 1))
        };
        assert!(computes(plain()));
        assert!(computes(plain().with_stride([2, 2])));
        for other in [
            Conv2dConfig::new([4, 6], [3, 1]),
            plain().with_stride([1, 2]),
            plain().with_dilation([2, 2]),
            plain().with_groups(2),
            plain().with_padding(PaddingConfig2d::Same),
        ] {
            assert!(!computes(other.clone()), "{other}");
        }
    }
}
