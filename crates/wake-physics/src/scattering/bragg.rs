//! Bragg scattering: the return of the short wave that resonates with the radar's wavelength.

use num_complex::Complex64;
use std::f64::consts::PI;

/// First-order scattering coefficients of a slightly rough dielectric plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coefficients {
    /// `g_VV`, vertical polarization both ways \[1\].
    pub vv: Complex64,
    /// `g_HH`, horizontal polarization both ways \[1\].
    pub hh: Complex64,
}

/// Exact Bragg coefficients.
///
/// ```text
/// g_HH = (ε − 1)/(cos θ + √(ε − sin²θ))²
/// g_VV = (ε − 1)[ε(1 + sin²θ) − sin²θ]/(ε cos θ + √(ε − sin²θ))²
/// ```
///
/// - `permittivity` ε \[1\], `cos_incidence` cos θ, 0 to 1
///
/// # References
///
/// Valenzuela (1978), Boundary-Layer Meteorology 13, 61, Eqs. 4.3–4.4 (with ε for sea water, no approximation
/// for large |ε|).
#[must_use]
#[inline(always)]
pub fn coefficients(permittivity: Complex64, cos_incidence: f64) -> Coefficients {
    let (e, cos) = (permittivity, cos_incidence);
    let sin2 = 1.0 - cos * cos;
    let root = square_root(e - sin2);
    let contrast = e - 1.0;
    let (h, v) = (root + cos, e * cos + root);
    Coefficients {
        vv: contrast * (e * (1.0 + sin2) - sin2) / (v * v),
        hh: contrast / (h * h),
    }
}

/// Principal square root of a number with positive imaginary part, without the trigonometry of the general one.
#[inline(always)]
fn square_root(z: Complex64) -> Complex64 {
    let re = (0.5 * (z.norm_sqr().sqrt() + z.re)).sqrt();
    Complex64::new(re, 0.5 * z.im / re)
}

/// Wavenumber of the Bragg wave, `k_B` = 2 `k_e` sin θ [rad/m].
///
/// - `radar_wavenumber` `k_e` = 2π/λ [rad/m], `incidence` θ \[rad\]
#[must_use]
pub fn wavenumber(radar_wavenumber: f64, incidence: f64) -> f64 {
    2.0 * radar_wavenumber * incidence.sin()
}

/// Cross-section of an untilted rough plane.
///
/// ```text
/// σ⁰ = 16π k_e⁴ cos⁴θ |g|² Ψ_e(k_B),   Ψ_e = ½[Ψ(k_B) + Ψ(−k_B)],   ∬Ψ = ⟨ζ²⟩
/// ```
///
/// - `radar_wavenumber` `k_e` [rad/m], `cos_incidence` cos θ
/// - `gain` |g|² \[1\], `density` `Ψ_e` \[m⁴\] at the Bragg wavenumber
/// - returns σ⁰ \[1\], per unit area of that plane
///
/// # References
///
/// Valenzuela (1978), Eq. 4.2; Romeiser et al. (1997), J. Geophys. Res. 102, 25237, Eq. 1, in another notation.
#[must_use]
#[inline(always)]
pub fn cross_section(radar_wavenumber: f64, cos_incidence: f64, gain: f64, density: f64) -> f64 {
    16.0 * PI * (radar_wavenumber * cos_incidence).powi(4) * gain * density
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constants::SPEED_OF_LIGHT;
    use crate::permittivity::sea_water;

    /// |g|² and `k_B` from the independent implementation `tests/reference/sea_and_scattering.py`, at 9.6 GHz, 20 °C, 35 psu.
    #[test]
    fn coefficients_meet_the_reference() {
        let table = [
            (16.0, 110.92, 0.8334, 0.6375),
            (20.0, 137.63, 0.9729, 0.6440),
            (23.0, 157.23, 1.1142, 0.6498),
            (26.0, 176.40, 1.2962, 0.6564),
            (29.0, 195.09, 1.5307, 0.6639),
            (32.0, 213.24, 1.8339, 0.6722),
        ];
        let radar = 2.0 * PI * 9.6e9 / SPEED_OF_LIGHT;
        assert!((radar - 201.2011).abs() < 1e-4);
        for (degrees, k, vv, hh) in table {
            let theta = f64::to_radians(degrees);
            let g = coefficients(sea_water(9.6e9, 20.0, 35.0), theta.cos());
            assert!((wavenumber(radar, theta) - k).abs() < 0.006);
            assert!((g.vv.norm_sqr() - vv).abs() < 6e-5, "{degrees}");
            assert!((g.hh.norm_sqr() - hh).abs() < 6e-5, "{degrees}");
        }
    }

    /// At nadir both equal the reflection coefficient (√ε − 1)/(√ε + 1); for a metal |`g_HH`| = 1 and
    /// |`g_VV`| = (1 + sin²θ)/cos²θ.
    #[test]
    fn limits_of_the_coefficients() {
        let e = Complex64::new(56.063, 37.275);
        let reflection = (e.sqrt() - 1.0) / (e.sqrt() + 1.0);
        let nadir = coefficients(e, 1.0);
        assert!((nadir.vv - reflection).norm() < 1e-14);
        assert!((nadir.hh - reflection).norm() < 1e-14);
        let theta = 0.7f64;
        let metal = coefficients(Complex64::new(1.0, 1e16), theta.cos());
        let ratio = (1.0 + theta.sin().powi(2)) / theta.cos().powi(2);
        // The skin depth leaves a term of order ε^(−½) = 1e-8.
        assert!((metal.hh.norm() - 1.0).abs() < 1e-7);
        assert!((metal.vv.norm() / ratio - 1.0).abs() < 1e-7);
    }

    #[test]
    fn square_root_squares_back() {
        for z in [
            Complex64::new(55.0, 37.0),
            Complex64::new(0.1, 1e-3),
            Complex64::new(1.0, 1e16),
        ] {
            let root = square_root(z);
            assert!((root * root - z).norm() < 1e-14 * z.norm());
        }
    }
}
