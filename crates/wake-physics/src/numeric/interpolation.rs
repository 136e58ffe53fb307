//! Interpolation between equidistant points.

/// Weights of four points at a position `t` (0 to 1) between the middle two, by the cubic of Catmull and Rom (1974).
pub(crate) fn catmull_rom(t: f64) -> [f64; 4] {
    [
        ((2.0 - t) * t - 1.0) * t,
        (3.0 * t - 5.0) * t * t + 2.0,
        ((4.0 - 3.0 * t) * t + 1.0) * t,
        (t - 1.0) * t * t,
    ]
    .map(|weight| 0.5 * weight)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Polynomials of second degree are interpolated exactly.
    #[test]
    fn parabolas_are_exact() {
        let parabola = |x: f64| 2.0 - 0.7 * x + 1.3 * x * x;
        for t in [0.0, 0.2, 0.5, 0.9] {
            let weights = catmull_rom(t);
            let points = [-1.0, 0.0, 1.0, 2.0].map(parabola);
            let found: f64 = weights.iter().zip(points).map(|(w, p)| w * p).sum();
            assert!((found - parabola(t)).abs() < 1e-12, "{t}");
        }
    }
}
