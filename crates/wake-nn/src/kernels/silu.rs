//! SiLU and its derivative, written so that compilers turn them into vector instructions.

/// `1 / (1 + e^(−z))`, to within 3 units in the last place.
#[inline(always)]
pub(super) fn sigmoid(z: f32) -> f32 {
    1.0 / (1.0 + exp(-z))
}

/// e^x for −87 ≤ x ≤ 87; 0 below, and its value at 87 above.
///
/// ```text
/// e^x = 2^n e^r,   n = round(x / ln 2),   |r| ≤ ½ ln 2
/// ```
///
/// The polynomial is the Taylor series of e^r to r⁷, whose remainder is (½ ln 2)⁸ / 8! = 5e-9.
#[inline(always)]
pub(super) fn exp(x: f32) -> f32 {
    // Adding 1.5 · 2²³ leaves round(x / ln 2) in the lowest bits.
    const ROUND: f32 = 12_582_912.0;
    // ln 2 in two parts, the first with so few digits that n times it is exact.
    const LN2: [f32; 2] = [0.693_359_4, -2.121_944_4e-4];
    let small = x < -87.0;
    let x = x.clamp(-87.0, 87.0);
    let shifted = x.mul_add(std::f32::consts::LOG2_E, ROUND);
    let n = shifted - ROUND;
    let r = n.mul_add(-LN2[1], n.mul_add(-LN2[0], x));
    let taylor = [
        1.0 / 720.0,
        1.0 / 120.0,
        1.0 / 24.0,
        1.0 / 6.0,
        0.5,
        1.0,
        1.0,
    ];
    let series = taylor
        .iter()
        .fold(1.0 / 5040.0, |sum: f32, &c| sum.mul_add(r, c));
    let scale = shifted.to_bits().wrapping_add(127) << 23;
    let value = series * f32::from_bits(scale);
    if small { 0.0 } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sigmoid_is_right_to_three_units_in_the_last_place() {
        for i in -86_999..=86_999 {
            let z = i as f32 * 1e-3;
            let exact = 1.0 / (1.0 + (-f64::from(z)).exp());
            let error = (f64::from(sigmoid(z)) / exact - 1.0).abs();
            assert!(error < 3.0 * f64::from(f32::EPSILON), "{z}: {error:e}");
        }
    }

    #[test]
    fn far_values_saturate() {
        for (z, expected) in [(-1e30, 0.0), (f32::NEG_INFINITY, 0.0), (1e30, 1.0)] {
            assert!((sigmoid(z) - expected).abs() < 1e-37);
        }
        assert!(sigmoid(f32::NAN).is_nan());
        assert!(exp(-88.0).abs() < f32::MIN_POSITIVE);
    }
}
