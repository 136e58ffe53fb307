//! Floating-point types in which weights are held or stored.

use burn::tensor::{DType, Device};

use crate::error::{Error, Result};

/// A floating-point type.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Precision {
    /// 32 bits; the default.
    #[default]
    F32,
    /// 16 bits, 10 of them for the fraction; the largest number is 65,504.
    F16,
    /// 16 bits, 7 of them for the fraction; the range of f32.
    BF16,
}

impl Precision {
    /// burn's data type for this precision.
    pub fn dtype(self) -> DType {
        match self {
            Self::F32 => DType::F32,
            Self::F16 => DType::F16,
            Self::BF16 => DType::BF16,
        }
    }

    /// Name of this precision in a safetensors header.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::F32 => "F32",
            Self::F16 => "F16",
            Self::BF16 => "BF16",
        }
    }

    /// Returns an error unless all devices support this precision.
    pub(super) fn check(self, devices: &[Device]) -> Result<()> {
        match devices
            .iter()
            .find(|device| !device.supports_dtype(self.dtype()))
        {
            None => Ok(()),
            Some(device) => Err(Error::UnsupportedPrecision {
                device: crate::device_label(device),
                precision: self.name(),
            }),
        }
    }
}
