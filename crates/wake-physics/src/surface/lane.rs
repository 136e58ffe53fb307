//! Arithmetic in one precision: single by series, double by the standard library.

use crate::fft::Real;
use crate::numeric::vector::tanh_f32;

/// Arithmetic operations beyond what an FFT needs.
pub(super) trait Lane: Real + PartialOrd {
    /// Rounds a constant.
    fn constant(value: f64) -> Self;
    /// Widens an `f32`.
    fn widen(value: f32) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// tanh of a value of at least 0.
    fn tanh(self) -> Self;
}

impl Lane for f32 {
    fn constant(value: f64) -> Self {
        value as Self
    }
    fn widen(value: f32) -> Self {
        value
    }
    fn sqrt(self) -> Self {
        Self::sqrt(self)
    }
    fn tanh(self) -> Self {
        tanh_f32(self)
    }
}

impl Lane for f64 {
    fn constant(value: f64) -> Self {
        value
    }
    fn widen(value: f32) -> Self {
        Self::from(value)
    }
    fn sqrt(self) -> Self {
        Self::sqrt(self)
    }
    fn tanh(self) -> Self {
        Self::tanh(self)
    }
}
