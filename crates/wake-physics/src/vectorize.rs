//! Loops compiled for the vector instructions of the machine they run on.

/// Runs a loop compiled once for every level of vector instructions, in the version this machine has.
///
/// What the loop calls must be inlined into it (`#[inline(always)]`) to gain. Nothing is reordered or fused, so the
/// numbers are the same on every machine.
#[inline(always)]
pub(crate) fn vectorized<R>(task: impl FnOnce() -> R) -> R {
    pulp::Arch::new().dispatch(task)
}

/// eˣ for x up to 700, relative error below 4·10⁻¹⁶·(1 + |x|), and 0 below −700; plain arithmetic, so that it vectorises.
///
/// x = n ln 2 + r with |r| ≤ ½ ln 2, and the Taylor series of eʳ to r¹³.
#[inline(always)]
pub(crate) fn exp(x: f64) -> f64 {
    /// Adding it rounds to an integer, which then stands in the low bits.
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

#[cfg(test)]
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
}
