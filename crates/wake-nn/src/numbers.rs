//! Number types: casts, and checks that numbers are finite.

use burn::tensor::{DType, FloatDType, Tensor};

use crate::error::{Error, Result};

/// Whether a type has 16 bits, in which sums of squares can overflow or lose their digits.
pub fn is_half(dtype: DType) -> bool {
    matches!(dtype, DType::F16 | DType::BF16)
}

/// Casts a tensor to another number type; a tensor that already has it is returned unchanged.
pub fn cast_to<const D: usize>(tensor: Tensor<D>, dtype: DType) -> Tensor<D> {
    if tensor.dtype() == dtype {
        return tensor;
    }
    let dtype: FloatDType = dtype.into();
    tensor.cast(dtype)
}

/// Checks that the numbers of a tensor have a finite sum; waits until they are computed.
///
/// # Errors
///
/// [`Error::NotFinite`] when the sum is infinite or NaN.
pub fn check_finite<const D: usize>(what: &str, tensor: &Tensor<D>) -> Result<()> {
    let sum = cast_to(tensor.clone(), DType::F32)
        .sum()
        .into_scalar::<f32>();
    if sum.is_finite() {
        return Ok(());
    }
    Err(Error::NotFinite {
        what: what.to_owned(),
    })
}
