//! Elementary functions without branches, so that loops over them become vector instructions.
//!
//! Each is a series short enough for f32; the tests hold them against the standard library.

use crate::fft::Real;
use std::f32::consts::{LN_2, LOG2_E, SQRT_2, TAU};

/// The arithmetic of one precision beyond what an FFT needs.
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
        tanh(self)
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

/// Natural logarithm of a normal number above 0.
///
/// x = 2ⁿ m with m from 1/√2 to √2; ln m = 2 artanh q with q = (m − 1)/(m + 1), |q| < 0.172.
#[inline(always)]
pub(crate) fn ln(x: f32) -> f32 {
    const LOWEST: u32 = (0.5 * SQRT_2).to_bits();
    let shifted = x.to_bits().wrapping_sub(LOWEST);
    let n = (shifted as i32) >> 23;
    let m = f32::from_bits((shifted & 0x007f_ffff).wrapping_add(LOWEST));
    let q = (m - 1.0) / (m + 1.0);
    let q2 = q * q;
    let series = 2.0 + q2 * (2.0 / 3.0 + q2 * (2.0 / 5.0 + q2 * (2.0 / 7.0 + q2 * (2.0 / 9.0))));
    n as f32 * LN_2 + q * series
}

/// Exponential of a number of at most 0; below −87 the smallest normal number.
///
/// eˣ = 2ⁿ eʳ with |r| ≤ ln2/2 and the Taylor series of eʳ to r⁷.
#[inline(always)]
pub(super) fn exp(x: f32) -> f32 {
    /// Adding it rounds to an integer, which then stands in the low bits.
    const ROUND: f32 = 12_582_912.0;
    /// ln 2 in two parts: the first has few bits, so that n times it is exact.
    const HIGH: f32 = 0.693_359_4;
    const LOW: f32 = -2.121_944_4e-4;
    let x = if x > -87.0 { x } else { -87.0 };
    let shifted = x * LOG2_E + ROUND;
    let n = shifted - ROUND;
    let r = x - n * HIGH - n * LOW;
    let high = 1.0 / 24.0 + r * (1.0 / 120.0 + r * (1.0 / 720.0 + r * (1.0 / 5040.0)));
    let series = 1.0 + r * (1.0 + r * (0.5 + r * (1.0 / 6.0 + r * high)));
    let power = shifted
        .to_bits()
        .wrapping_sub(ROUND.to_bits())
        .wrapping_add(127)
        << 23;
    series * f32::from_bits(power)
}

/// Cosine and sine of an angle in units of 2⁻³² turns.
///
/// The nearest quarter turn is split off exactly; the rest, up to π/4, goes into the Taylor series.
#[inline(always)]
pub(crate) fn cos_sin(turns: u32) -> [f32; 2] {
    let quarter = turns.wrapping_add(1 << 29) >> 30;
    let rest = turns.wrapping_sub(quarter << 30) as i32;
    let x = rest as f32 * (TAU * f32::from_bits((127 - 32) << 23));
    let x2 = x * x;
    let sin =
        x * (1.0 + x2 * (-1.0 / 6.0 + x2 * (1.0 / 120.0 + x2 * (-1.0 / 5040.0 + x2 / 362_880.0))));
    let cos = 1.0 + x2 * (-0.5 + x2 * (1.0 / 24.0 + x2 * (-1.0 / 720.0 + x2 / 40_320.0)));
    let swap = quarter & 1 == 1;
    let (c, s) = if swap { (sin, cos) } else { (cos, sin) };
    // The cosine is negative in quarters 1 and 2, the sine in 2 and 3: move that bit to the sign.
    let cos_sign = (quarter.wrapping_add(1) & 2) << 30;
    let sin_sign = (quarter & 2) << 30;
    [
        f32::from_bits(c.to_bits() ^ cos_sign),
        f32::from_bits(s.to_bits() ^ sin_sign),
    ]
}

/// tanh of a number of at least 0: a series below 0.3, from the exponential above.
#[inline(always)]
fn tanh(x: f32) -> f32 {
    let x2 = x * x;
    let series = 1.0
        + x2 * (-1.0 / 3.0
            + x2 * (2.0 / 15.0
                + x2 * (-17.0 / 315.0 + x2 * (62.0 / 2835.0 - x2 * 1382.0 / 155_925.0))));
    let e = exp(-2.0 * x);
    if x < 0.3 {
        x * series
    } else {
        (1.0 - e) / (1.0 + e)
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "the ends of the ranges are exact")]
mod tests {
    use super::*;

    /// Largest relative difference over points spaced evenly in x or in ln x.
    fn worst(
        points: impl Iterator<Item = f32>,
        fast: fn(f32) -> f32,
        exact: fn(f64) -> f64,
    ) -> f64 {
        points
            .map(|x| (f64::from(fast(x)) / exact(f64::from(x)) - 1.0).abs())
            .fold(0.0, f64::max)
    }

    #[test]
    fn exponential_and_tanh_are_right_to_a_few_roundings() {
        let even = (0..200_000).map(|n| n as f32 * -4.3e-4);
        // The rounding of x itself is part of it for large −x: x·6e-8.
        assert!(worst(even, exp, f64::exp) < 5e-7);
        let spread = (0..200_000).map(|n| (n as f32 * 1.2e-4 - 20.0).exp());
        assert!(worst(spread, tanh, f64::tanh) < 5e-7);
        assert!(exp(-1e30) < 1e-37 && exp(f32::NEG_INFINITY) < 1e-37);
        assert_eq!(tanh(f32::INFINITY), 1.0);
    }

    #[test]
    fn logarithm_is_right_to_a_few_roundings() {
        for n in 0..200_000 {
            let x = (n as f32 * 8e-4 - 80.0).exp();
            let error = (f64::from(ln(x)) - f64::from(x).ln()).abs();
            // Absolute near ln 1 = 0 and relative beyond, where n ln 2 is rounded.
            assert!(error < 3e-7 * f64::from(x).ln().abs().max(1.0), "{x}");
        }
    }

    #[test]
    fn circle_is_right_in_every_quarter() {
        for n in 0..100_000u32 {
            let turns = n.wrapping_mul(42_949).wrapping_add(n);
            let angle = f64::from(turns) * std::f64::consts::TAU / 4_294_967_296.0;
            let [c, s] = cos_sin(turns);
            assert!((f64::from(c) - angle.cos()).abs() < 2e-7);
            assert!((f64::from(s) - angle.sin()).abs() < 2e-7);
        }
        assert_eq!(cos_sin(0), [1.0, 0.0]);
        assert_eq!(cos_sin(1 << 30), [0.0, 1.0]);
    }
}
