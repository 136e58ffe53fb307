//! Gaussian slopes: covariance, principal axes and density.

use crate::numeric::vector::exp;
use std::f64::consts::PI;

/// Covariance of the slopes ∂ζ/∂x, ∂ζ/∂y of a band of waves \[1\].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SlopeCovariance {
    /// Variance of ∂ζ/∂x.
    pub xx: f64,
    /// Covariance of ∂ζ/∂x and ∂ζ/∂y.
    pub xy: f64,
    /// Variance of ∂ζ/∂y.
    pub yy: f64,
}

/// The axes along which Gaussian slopes are independent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PrincipalAxes {
    /// Unit vector of the first axis; the second is a quarter turn anticlockwise from it.
    pub axis: [f64; 2],
    /// Variances along the first and the second axis; the first is not smaller.
    pub variance: [f64; 2],
}

impl SlopeCovariance {
    /// Zero covariance: no waves.
    pub const NONE: Self = Self {
        xx: 0.0,
        xy: 0.0,
        yy: 0.0,
    };

    /// Covariance from variances along and across the wind, rotated to x and y.
    ///
    /// - `variance` along and across \[1\]; `wind` unit vector of the wind direction (toward)
    #[must_use]
    pub fn along_wind(variance: [f64; 2], wind: [f64; 2]) -> Self {
        let [up, cross] = variance;
        let [wx, wy] = wind;
        Self {
            xx: up * wx * wx + cross * wy * wy,
            xy: (up - cross) * wx * wy,
            yy: up * wy * wy + cross * wx * wx,
        }
    }

    /// Covariance with the same variance in every direction.
    #[must_use]
    pub fn isotropic(variance: f64) -> Self {
        Self {
            xx: variance,
            xy: 0.0,
            yy: variance,
        }
    }

    /// Covariance of the sum of two independent bands.
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        Self {
            xx: self.xx + other.xx,
            xy: self.xy + other.xy,
            yy: self.yy + other.yy,
        }
    }

    /// `factor` times this covariance.
    #[must_use]
    pub fn times(&self, factor: f64) -> Self {
        Self {
            xx: factor * self.xx,
            xy: factor * self.xy,
            yy: factor * self.yy,
        }
    }

    /// This covariance in coordinates along given axes.
    #[inline(always)]
    pub(crate) fn turned(&self, axes: &PrincipalAxes) -> Self {
        let [a, b] = axes.axis;
        let mixed = 2.0 * a * b * self.xy;
        Self {
            xx: a * a * self.xx + mixed + b * b * self.yy,
            xy: (a * a - b * b) * self.xy + a * b * (self.yy - self.xx),
            yy: a * a * self.yy - mixed + b * b * self.xx,
        }
    }

    /// Determinant xx·yy − xy² \[1\].
    #[must_use]
    pub fn determinant(&self) -> f64 {
        self.xx * self.yy - self.xy * self.xy
    }

    /// The probability density of slopes with this covariance.
    pub(crate) fn density(&self) -> SlopeDensity {
        let determinant = self.determinant();
        if determinant <= 0.0 {
            return SlopeDensity::NONE;
        }
        SlopeDensity {
            peak: 1.0 / (2.0 * PI * determinant.sqrt()),
            form: [self.yy, -2.0 * self.xy, self.xx].map(|c| 0.5 * c / determinant),
        }
    }

    /// Axes and variances of the independent components.
    pub(crate) fn principal_axes(&self) -> PrincipalAxes {
        let mean = 0.5 * (self.xx + self.yy);
        let half = 0.5 * (self.xx - self.yy);
        let radius = (half * half + self.xy * self.xy).sqrt();
        // Half the angle with cosine half/radius and sine xy/radius; the larger of the two is computed as a root.
        let larger = (0.5 + 0.5 * half.abs() / radius).sqrt();
        let smaller = 0.5 * self.xy / (radius * larger);
        let [cos, sin] = if radius <= 0.0 {
            [1.0, 0.0]
        } else if half >= 0.0 {
            [larger, smaller]
        } else {
            [smaller.abs(), larger.copysign(self.xy)]
        };
        PrincipalAxes {
            axis: [cos, sin],
            variance: [mean + radius, (mean - radius).max(0.0)],
        }
    }
}

/// Probability density of Gaussian slopes; 0 everywhere for a singular covariance.
///
/// ```text
/// p(s) = exp(−½ sᵀC⁻¹s) / (2π √det C)
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SlopeDensity {
    /// Density at zero slope \[1\].
    pub(crate) peak: f64,
    /// Coefficients of x², xy and y² in the exponent.
    form: [f64; 3],
}

/// Exponent beyond which a density is 0: 2e-35 of the peak, which saves the exponential.
const FARTHEST: f64 = 80.0;

impl SlopeDensity {
    /// Zero density everywhere.
    pub(crate) const NONE: Self = Self {
        peak: 0.0,
        form: [0.0; 3],
    };

    /// Density at a slope \[1\].
    #[inline(always)]
    pub(crate) fn at(&self, [x, y]: [f64; 2]) -> f64 {
        let exponent = self.form[0] * x * x + self.form[1] * x * y + self.form[2] * y * y;
        let density = self.peak * exp(-exponent.min(FARTHEST));
        if exponent > FARTHEST { 0.0 } else { density }
    }
}

impl PrincipalAxes {
    /// Slope (x, y) at coordinates (u, v) along the axes.
    #[inline(always)]
    pub(crate) fn slope(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let [a, b] = self.axis;
        [a * u - b * v, b * u + a * v]
    }

    /// Coordinates (u, v) along the axes of a slope (x, y).
    pub(crate) fn coordinates(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [a, b] = self.axis;
        [a * x + b * y, a * y - b * x]
    }
}

/// Nodes and weights of the mean over a Gaussian of standard deviation `std`:
///
/// ```text
/// E[f] ≈ Σ wₙ f(uₙ),   uₙ = n h,   h at most `step` and std/2
/// ```
///
/// The trapezoidal rule is exact to e^{−2π²w²/h²} for functions no sharper than a Gaussian of width w. The tails beyond 6
/// standard deviations (2e-9 of the mass) are omitted. Without spread there is a single node.
pub(crate) fn gaussian_nodes(std: f64, step: f64) -> Vec<[f64; 2]> {
    if std <= 0.0 {
        return vec![[0.0, 1.0]];
    }
    let z = (step / std).min(0.5);
    let count = (6.0 / z).ceil() as i64;
    (-count..=count)
        .map(|n| {
            let z_n = n as f64 * z;
            let weight = z / (2.0 * PI).sqrt() * (-0.5 * z_n * z_n).exp();
            [z_n * std, weight]
        })
        .collect()
}

#[cfg(test)]
#[allow(
    clippy::float_cmp,
    reason = "exact zeros and values that nothing may change"
)]
mod tests {
    use super::*;

    #[test]
    fn principal_axes_rebuild_the_covariance() {
        for c in [
            SlopeCovariance::along_wind([0.02, 0.01], [0.6, 0.8]),
            SlopeCovariance::along_wind([0.02, 0.01], [-0.8, 0.6]),
            SlopeCovariance::along_wind([0.01, 0.02], [1.0, 0.0]),
            SlopeCovariance::isotropic(0.013),
            SlopeCovariance::NONE,
        ] {
            let axes = c.principal_axes();
            let back = SlopeCovariance::along_wind(axes.variance, axes.axis);
            let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-16, "{a} {b}");
            close(back.xx, c.xx);
            close(back.xy, c.xy);
            close(back.yy, c.yy);
            let own = c.turned(&axes);
            close(own.xx, axes.variance[0]);
            close(own.yy, axes.variance[1]);
            close(own.xy, 0.0);
            let there = axes.slope(axes.coordinates([0.3, -0.2]));
            close(there[0], 0.3);
            close(there[1], -0.2);
        }
    }

    /// The density integrates to 1 and has the covariance as its second moments.
    #[test]
    fn density_has_its_moments() {
        let c = SlopeCovariance {
            xx: 0.02,
            xy: -0.006,
            yy: 0.01,
        };
        // Trapezoidal rule out to 8 standard deviations in steps of an eighth: exact up to rounding.
        let step = 0.0125;
        let density = c.density();
        let mut sum = [0.0; 4];
        for i in -110..=110 {
            for j in -110..=110 {
                let s = [f64::from(i) * step, f64::from(j) * step];
                let p = density.at(s) * step * step;
                for (m, f) in sum
                    .iter_mut()
                    .zip([1.0, s[0] * s[0], s[0] * s[1], s[1] * s[1]])
                {
                    *m += f * p;
                }
            }
        }
        for (moment, expected) in sum.iter().zip([1.0, c.xx, c.xy, c.yy]) {
            assert!((moment - expected).abs() < 1e-12, "{moment} {expected}");
        }
        assert_eq!(SlopeCovariance::NONE.density().at([0.0, 0.0]), 0.0);
    }

    /// Moments 0, 2 and 4 of a Gaussian: 1, σ², 3σ⁴, up to the omitted tails.
    #[test]
    fn gaussian_nodes_have_gaussian_moments() {
        for (std, step) in [(0.1, 0.02), (0.1, 1.0), (0.001, 0.02), (0.0, 0.1)] {
            let nodes = gaussian_nodes(std, step);
            for (power, expected) in [(0, 1.0), (1, 0.0), (2, 1.0), (4, 3.0)] {
                let moment: f64 = nodes.iter().map(|[u, w]| w * u.powi(power)).sum();
                let expected = expected * std.powi(power);
                assert!((moment - expected).abs() < 1e-6 * std.powi(power).max(1e-30));
            }
        }
    }
}
