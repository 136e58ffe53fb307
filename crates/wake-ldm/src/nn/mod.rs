//! Blocks that autoencoder, U-Net and text transformer share.

pub mod activation;
pub mod attention;
pub mod feed_forward;
pub mod norm;
pub mod resample;
pub mod resnet;
pub mod timestep;
pub mod transformer;

use burn::nn::PaddingConfig2d;
use burn::nn::conv::{Conv2d, Conv2dConfig};
use burn::tensor::{DType, Device, FloatDType, Tensor};

/// A convolution that keeps the size of its image: 3 × 3 with a border of one zero.
pub(crate) fn conv3x3(channels_in: usize, channels_out: usize, device: &Device) -> Conv2d {
    Conv2dConfig::new([channels_in, channels_out], [3, 3])
        .with_padding(PaddingConfig2d::Explicit(1, 1, 1, 1))
        .init(device)
}

/// A linear map of the channels of every pixel: a 1 × 1 convolution.
pub(crate) fn conv1x1(channels_in: usize, channels_out: usize, device: &Device) -> Conv2d {
    Conv2dConfig::new([channels_in, channels_out], [1, 1]).init(device)
}

/// Whether sums of squares can overflow or lose their digits in this kind of number.
pub(crate) fn is_half(dtype: DType) -> bool {
    matches!(dtype, DType::F16 | DType::BF16)
}

/// The same tensor in another kind of number; nothing is done where it already is.
pub(crate) fn cast_to<const D: usize>(tensor: Tensor<D>, dtype: DType) -> Tensor<D> {
    if tensor.dtype() == dtype {
        return tensor;
    }
    let dtype: FloatDType = dtype.into();
    tensor.cast(dtype)
}
