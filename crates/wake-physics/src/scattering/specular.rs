//! Quasi-specular return of facets that reflect the radar beam back like mirrors.

use crate::scattering::slopes::{SlopeCovariance, SlopeDensity};
use num_complex::Complex64;
use std::f64::consts::{FRAC_PI_2, PI};

/// Kirchhoff scattering in the limit of geometric optics.
///
/// ```text
/// σ(s) = π |R(0)|² sec⁴θ p(tan θ − s_x, −s_y),   R(0) = (√ε − 1)/(√ε + 1)
/// ```
///
/// p is the density of the unresolved slopes: a facet of total slope (tan θ, 0), which rises away from the radar at the
/// incidence angle, is a mirror to the radar. With no resolved slope and an isotropic variance mss/2 this is
/// |R|² sec⁴θ exp(−tan²θ/mss)/mss.
///
/// # Without unresolved slopes
///
/// p would be a delta function. But a plane mirror of pixel size L reflects into a lobe, which acts like slopes of variance
/// (π/2)/(`k_e` L)². With it, a flat pixel at its specular slope has the cross-section
/// |R|² 4π L²/λ² of a mirror, and every σ is finite. See [`mirror_lobe`](Self::mirror_lobe).
///
/// # References
///
/// Valenzuela (1978), Boundary-Layer Meteorology 13, 61, Eq. 3.9; Barrick (1968), IEEE Trans. Antennas Propag.
/// 16, 449.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Specular {
    tan_incidence: f64,
    /// π |R|² sec⁴θ.
    strength: f64,
    covariance: SlopeCovariance,
    density: SlopeDensity,
}

impl Specular {
    /// No specular return.
    pub const NONE: Self = Self {
        tan_incidence: 0.0,
        strength: 0.0,
        covariance: SlopeCovariance::NONE,
        density: SlopeDensity::NONE,
    };

    /// The return of water with a permittivity at an incidence θ \[rad\], given the unresolved slopes and the slope
    /// variance [`mirror_lobe`](Self::mirror_lobe) of the pixel's lobe.
    #[must_use]
    pub fn new(
        permittivity: Complex64,
        incidence: f64,
        unresolved: &SlopeCovariance,
        lobe: f64,
    ) -> Self {
        let root = permittivity.sqrt();
        let reflectivity = ((root - 1.0) / (root + 1.0)).norm_sqr();
        let covariance = unresolved.plus(&SlopeCovariance::isotropic(lobe));
        Self {
            tan_incidence: incidence.tan(),
            strength: PI * reflectivity * incidence.cos().powi(-4),
            density: covariance.density(),
            covariance,
        }
    }

    /// Slope variance that represents the lobe of a square mirror, (π/2)/(`k_e` L)² \[1\].
    ///
    /// The lobe sinc²(`k_e` L s) has the peak 1 and the area π/(`k_e` L); the Gaussian with the same peak and area has this
    /// variance.
    ///
    /// - `radar_wavenumber` `k_e` [rad/m], `size` L \[m\]
    #[must_use]
    pub fn mirror_lobe(radar_wavenumber: f64, size: f64) -> f64 {
        FRAC_PI_2 / (radar_wavenumber * size).powi(2)
    }

    /// Cross-section of a facet of resolved slope (`s_x`, `s_y`), per unit area of the horizontal plane.
    #[must_use]
    #[inline(always)]
    pub fn sigma0(&self, slope: [f64; 2]) -> f64 {
        self.strength * self.density.at(self.missing(slope))
    }

    /// Mean return with `more` unresolved slopes.
    #[must_use]
    pub(crate) fn over(&self, more: &SlopeCovariance) -> Self {
        let covariance = self.covariance.plus(more);
        Self {
            density: covariance.density(),
            covariance,
            ..*self
        }
    }

    /// Mean over resolved slopes: the covariances of the two bands add up.
    #[must_use]
    pub fn mean_over(&self, resolved: &SlopeCovariance) -> f64 {
        self.over(resolved).sigma0([0.0; 2])
    }

    /// Root mean square over resolved slopes.
    ///
    /// ```text
    /// p_C² = p_{C/2}/(4π √det C)   ⇒   E[σ²] = strength² p_{C/2 + R}(tan θ, 0)/(4π √det C)
    /// ```
    pub(crate) fn rms_over(&self, resolved: &SlopeCovariance) -> f64 {
        let narrow = self.covariance.times(0.5).plus(resolved).density();
        // 1/(4π √det C) is half the peak of p_C.
        let square = narrow.at(self.missing([0.0; 2])) * 0.5 * self.density.peak;
        self.strength * square.sqrt()
    }

    /// Slope still needed to turn a facet of resolved slope s into a mirror.
    #[inline(always)]
    fn missing(&self, [sx, sy]: [f64; 2]) -> [f64; 2] {
        [self.tan_incidence - sx, -sy]
    }
}

#[cfg(test)]
#[allow(
    clippy::float_cmp,
    reason = "exact zeros and values that nothing may change"
)]
mod tests {
    use super::*;
    use crate::scattering::slopes::gaussian_nodes;

    const WATER: Complex64 = Complex64::new(56.063, 37.275);

    #[test]
    fn isotropic_slopes_give_the_textbook_formula() {
        let (theta, mss) = (0.3f64, 0.03);
        let reflectivity = ((WATER.sqrt() - 1.0) / (WATER.sqrt() + 1.0)).norm_sqr();
        let expected =
            reflectivity * theta.cos().powi(-4) * (-theta.tan().powi(2) / mss).exp() / mss;
        let specular = Specular::new(WATER, theta, &SlopeCovariance::isotropic(mss / 2.0), 0.0);
        assert!((specular.sigma0([0.0; 2]) / expected - 1.0).abs() < 1e-13);
    }

    /// A facet inclined toward the radar by the incidence angle is the brightest.
    #[test]
    fn brightest_slope_faces_the_radar() {
        let specular = Specular::new(WATER, 0.35, &SlopeCovariance::isotropic(0.01), 0.0);
        let best = specular.sigma0([0.35f64.tan(), 0.0]);
        assert!(best > specular.sigma0([0.0; 2]));
        assert!(specular.sigma0([0.1, 0.0]) > specular.sigma0([-0.1, 0.0]));
        assert!(best > specular.sigma0([0.35f64.tan(), 0.05]));
    }

    /// A flat pixel viewed from above is a mirror: |R|² 4π L²/λ².
    #[test]
    fn flat_pixel_is_a_mirror() {
        let (k, size) = (201.2, 2.5);
        let lobe = Specular::mirror_lobe(k, size);
        let specular = Specular::new(WATER, 0.0, &SlopeCovariance::NONE, lobe);
        let reflectivity = ((WATER.sqrt() - 1.0) / (WATER.sqrt() + 1.0)).norm_sqr();
        let wavelength = 2.0 * PI / k;
        let mirror = reflectivity * 4.0 * PI * (size / wavelength).powi(2);
        assert!((specular.sigma0([0.0; 2]) / mirror - 1.0).abs() < 1e-12);
    }

    /// Means over resolved slopes: closed form against quadrature.
    #[test]
    fn moments_over_resolved_slopes() {
        let resolved = SlopeCovariance::along_wind([0.006, 0.003], [0.6, 0.8]);
        let unresolved = SlopeCovariance::along_wind([0.012, 0.008], [0.8, -0.6]);
        let specular = Specular::new(WATER, 0.28, &unresolved, 1e-4);
        let axes = resolved.principal_axes();
        let [along, across] = axes.variance.map(|v| gaussian_nodes(v.sqrt(), 0.02));
        let (mut mean, mut square) = (0.0, 0.0);
        for [u, wu] in &along {
            for [v, wv] in &across {
                let s = specular.sigma0(axes.slope([*u, *v]));
                mean += wu * wv * s;
                square += wu * wv * s * s;
            }
        }
        // The quadrature omits tails of 2e-9, which count up to a hundred times as much here.
        assert!((specular.mean_over(&resolved) / mean - 1.0).abs() < 2e-7);
        assert!((specular.rms_over(&resolved) / square.sqrt() - 1.0).abs() < 2e-7);
    }

    /// Values are finite without slopes, without a lobe and at extreme angles.
    #[test]
    fn limits_are_finite() {
        for degrees in [5.0f64, 75.0] {
            for lobe in [0.0, 1e-12, 1e-6] {
                let specular =
                    Specular::new(WATER, degrees.to_radians(), &SlopeCovariance::NONE, lobe);
                for slope in [[0.0, 0.0], [degrees.to_radians().tan(), 0.0], [1e6, -1e6]] {
                    assert!(specular.sigma0(slope).is_finite());
                }
                assert!(
                    specular
                        .rms_over(&SlopeCovariance::isotropic(0.01))
                        .is_finite()
                );
            }
        }
        assert_eq!(Specular::NONE.sigma0([0.0; 2]), 0.0);
    }
}
