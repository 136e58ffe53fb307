//! Loops compiled for the vector instructions of the machine at run time, and branch-free elementary functions that
//! vectorise in loops.

use std::f32::consts::{LN_2, LOG2_E, SQRT_2, TAU};

/// Runs a loop compiled for each level of vector instructions, in the version for this machine.
///
/// Functions called by the loop must be inlined (`#[inline(always)]`) to benefit. Nothing is reordered or fused, so the
/// results are the same on every machine.
#[inline(always)]
pub(crate) fn vectorized<R>(task: impl FnOnce() -> R) -> R {
    pulp::Arch::new().dispatch(task)
}

/// eˣ for x up to 700, with relative error below 4·10⁻¹⁶·(1 + |x|), and 0 below −700; branch-free, so that it vectorises.
///
/// x = n ln 2 + r with |r| ≤ ½ ln 2, and the Taylor series of eʳ to r¹³.
#[inline(always)]
pub(crate) fn exp(x: f64) -> f64 {
    /// Adding it rounds to an integer, which ends up in the low bits.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    /// ln 2 in two parts: the first has 21 trailing zeros, so that n times it is exact.
    const HIGH: f64 = 0.693_147_180_369_123_8;
    const LOW: f64 = 1.908_214_929_270_587_7e-10;
    const FACTORIALS: [f64; 13] = [
        1.0,
        2.0,
        6.0,
        24.0,
        120.0,
        720.0,
        5040.0,
        40320.0,
        362880.0,
        3628800.0,
        39916800.0,
        479001600.0,
        6227020800.0,
    ];
    let shifted = x * std::f64::consts::LOG2_E + ROUND;
    let n = shifted - ROUND;
    let r = x - n * HIGH - n * LOW;
    let mut series = 1.0 / FACTORIALS[12];
    for factorial in FACTORIALS[..12].iter().rev() {
        series = series * r + 1.0 / factorial;
    }
    let power = f64::from_bits(shifted.to_bits().wrapping_add(1023) << 52);
    if x < -700.0 {
        0.0
    } else {
        power * (1.0 + r * series)
    }
}

/// Natural logarithm of a normal number above 0.
///
/// x = 2ⁿ m with m from 1/√2 to √2; ln m = 2 artanh q with q = (m − 1)/(m + 1), |q| < 0.172.
#[inline(always)]
pub(crate) fn ln_f32(x: f32) -> f32 {
    const LOWEST: u32 = (0.5 * SQRT_2).to_bits();
    let shifted = x.to_bits().wrapping_sub(LOWEST);
    let n = (shifted as i32) >> 23;
    let m = f32::from_bits((shifted & 0x007f_ffff).wrapping_add(LOWEST));
    let q = (m - 1.0) / (m + 1.0);
    let q2 = q * q;
    let series = 2.0 + q2 * (2.0 / 3.0 + q2 * (2.0 / 5.0 + q2 * (2.0 / 7.0 + q2 * (2.0 / 9.0))));
    n as f32 * LN_2 + q * series
}

/// Exponential of a number of at most 0; the smallest normal number below −87.
///
/// eˣ = 2ⁿ eʳ with |r| ≤ ln2/2 and the Taylor series of eʳ to r⁷.
#[inline(always)]
pub(crate) fn exp_f32(x: f32) -> f32 {
    /// Adding it rounds to an integer, which ends up in the low bits.
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

/// tanh of a number of at least 0, by a series below 0.3 and from the exponential beyond.
#[inline(always)]
pub(crate) fn tanh_f32(x: f32) -> f32 {
    let x2 = x * x;
    let series = 1.0
        + x2 * (-1.0 / 3.0
            + x2 * (2.0 / 15.0
                + x2 * (-17.0 / 315.0 + x2 * (62.0 / 2835.0 - x2 * 1382.0 / 155_925.0))));
    let e = exp_f32(-2.0 * x);
    if x < 0.3 {
        x * series
    } else {
        (1.0 - e) / (1.0 + e)
    }
}

/// 2ˣ for x ≤ 0, with relative error below 3e-7; 2⁻¹²⁶ below −126. Branch-free, so that it vectorises.
#[inline(always)]
pub(crate) fn exp2_f32(x: f32) -> f32 {
    // Adding 1.5·2²³ leaves the nearest integer in the low bits.
    const ROUND: f32 = 12_582_912.0;
    let x = if x > -126.0 { x } else { -126.0 };
    let rounded = x + ROUND;
    let power = f32::from_bits(rounded.to_bits().wrapping_add(127) << 23);
    let y = (x - (rounded - ROUND)) * LN_2;
    // Taylor series; |y| ≤ ln 2/2, and the first omitted term is 1.2e-7.
    let series = 1.0 / 120.0 + y * (1.0 / 720.0);
    let series = 1.0 / 6.0 + y * (1.0 / 24.0 + y * series);
    power * (1.0 + y * (1.0 + y * (0.5 + y * series)))
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "the ends of the ranges are exact")]
mod tests {
    use super::*;

    #[test]
    fn exp_is_the_exponential() {
        for i in -70_000..=70_000 {
            let x = 0.01 * f64::from(i);
            let error = (exp(x) / x.exp() - 1.0).abs();
            assert!(error < 4e-16 * (1.0 + x.abs()), "{x}: {error}");
        }
        for x in [-701.0, -1e300, f64::NEG_INFINITY] {
            assert!(exp(x) <= 0.0, "{x}");
        }
        assert!(exp(f64::NAN).is_nan());
    }

    #[test]
    fn vectorized_runs_the_task() {
        let mut values = [1.0f32, 2.0, 3.0];
        let sum: f32 = vectorized(|| {
            values.iter_mut().for_each(|v| *v *= 2.0);
            values.iter().sum()
        });
        assert_eq!(sum as i32, 12);
    }

    /// Largest relative difference over the given points.
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
        // Includes the rounding of x itself for large −x: x·6e-8.
        assert!(worst(even, exp_f32, f64::exp) < 5e-7);
        let spread = (0..200_000).map(|n| (n as f32 * 1.2e-4 - 20.0).exp());
        assert!(worst(spread, tanh_f32, f64::tanh) < 5e-7);
        assert!(exp_f32(-1e30) < 1e-37 && exp_f32(f32::NEG_INFINITY) < 1e-37);
        assert_eq!(tanh_f32(f32::INFINITY), 1.0);
    }

    #[test]
    fn logarithm_is_right_to_a_few_roundings() {
        for n in 0..200_000 {
            let x = (n as f32 * 8e-4 - 80.0).exp();
            let error = (f64::from(ln_f32(x)) - f64::from(x).ln()).abs();
            // Absolute near ln 1 = 0, relative elsewhere, where n ln 2 is rounded.
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

    #[test]
    fn powers_of_two() {
        for i in 0..=12_700 {
            let x = -0.01 * i as f32;
            let exact = f64::from(x).max(-126.0).exp2();
            assert!((f64::from(exp2_f32(x)) / exact - 1.0).abs() < 3e-7, "x {x}");
        }
    }
}
