//! Blocks that autoencoder, U-Net and text transformer share.

pub mod activation;
pub mod attention;
pub(crate) mod conv;
pub mod feed_forward;
#[cfg(feature = "flex")]
mod kernels;
pub mod norm;
#[cfg(feature = "flex")]
mod operation;
pub mod patch;
pub mod resample;
pub mod resnet;
pub mod timestep;
pub mod transformer;

use burn::tensor::{DType, FloatDType, Tensor};

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
