//! The Airy function, which describes waves at the edge of the wedge.

use std::f64::consts::{FRAC_PI_4, PI};

/// Below this |x| the power series is used.
const SERIES: f64 = 6.0;

/// Ai(x), to 1e-4 of its size near x.
///
/// ```text
/// Ai(x)  = c₁ (1 + x³/(2·3) + x⁶/(2·3·5·6) + …) − c₂ (x + x⁴/(3·4) + x⁷/(3·4·6·7) + …)       |x| ≤ 6
/// Ai(−z) ≈ π^(−½) z^(−¼) [sin(ξ + π/4)(1 − 385/(10368 ξ²)) − cos(ξ + π/4) 5/(72 ξ)],  ξ = ⅔ z^(3/2)
/// Ai(z)  ≈ ½ π^(−½) z^(−¼) e^(−ξ) (1 − 5/(72 ξ))
/// ```
///
/// # References
///
/// NIST Digital Library of Mathematical Functions, 9.4.1, 9.7.5 and 9.7.9.
pub(super) fn airy(x: f64) -> f64 {
    if x.abs() <= SERIES {
        return series(x);
    }
    let z = x.abs();
    let xi = 2.0 / 3.0 * z.powf(1.5);
    let size = PI.powf(-0.5) * z.powf(-0.25);
    let first = 5.0 / (72.0 * xi);
    if x > 0.0 {
        return 0.5 * size * (-xi).exp() * (1.0 - first);
    }
    let (sin, cos) = (xi + FRAC_PI_4).sin_cos();
    size * (sin * (1.0 - 385.0 / (10368.0 * xi * xi)) - cos * first)
}

fn series(x: f64) -> f64 {
    const AT_ZERO: f64 = 0.355028053887817239;
    const SLOPE: f64 = 0.258819403792806798;
    let cube = x * x * x;
    let (mut even, mut odd) = (1.0, x);
    let (mut f, mut g) = (1.0, x);
    for k in 0..40 {
        let n = f64::from(3 * k);
        even *= cube / ((n + 2.0) * (n + 3.0));
        odd *= cube / ((n + 3.0) * (n + 4.0));
        (f, g) = (f + even, g + odd);
        if even.abs() + odd.abs() < 1e-16 {
            break;
        }
    }
    AT_ZERO * f - SLOPE * g
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of the NIST Digital Library's tables.
    #[test]
    fn values_are_the_published_ones() {
        for (x, expected) in [
            (0.0, 0.355028053887817),
            (1.0, 0.135292416312881),
            (-1.0, 0.535560883292352),
            (-2.338107410459767, 0.0),
            (5.0, 1.083444281360744e-4),
            (-5.0, 0.350761009024114),
        ] {
            assert!((airy(x) - expected).abs() < 1e-12, "{x}: {}", airy(x));
        }
        // Five digits, as the asymptotic series promises.
        assert!((airy(-10.0) - 0.0402412385).abs() < 1e-5);
    }

    #[test]
    fn the_branches_meet() {
        for x in [SERIES, -SERIES] {
            let (below, above) = (airy(x * (1.0 - 1e-9)), airy(x * (1.0 + 1e-9)));
            // The first term left out is of the order 0.04/ξ³ = 4e-5, 0.04/ξ² for the falling branch.
            assert!(
                (below - above).abs() < 5e-4 * series(x).abs().max(0.3 * f64::from(x < 0.0)),
                "{below} {above}"
            );
        }
    }
}
