//! Dispersion of gravity–capillary waves over water of any depth.

use crate::constants::{GRAVITY, KINEMATIC_SURFACE_TENSION};

/// Angular frequency of a wave.
///
/// ```text
/// ω² = (g k + (τ/ρ) k³) tanh(k h)
/// ```
///
/// - `wavenumber` k [rad/m], at least 0
/// - `depth` h \[m\], above 0, may be infinite
/// - returns ω [rad/s]; 0 at k = 0
///
/// # References
///
/// Lamb, *Hydrodynamics* (1932), §267.
#[must_use]
pub fn angular_frequency(wavenumber: f64, depth: f64) -> f64 {
    let k = wavenumber;
    let deep = GRAVITY * k + KINEMATIC_SURFACE_TENSION * k.powi(3);
    (deep * depth_factor(k, depth)).sqrt()
}

/// The factor tanh(k h) by which depth slows a wave; 1 in deep water, 0 at k = 0.
#[must_use]
pub fn depth_factor(wavenumber: f64, depth: f64) -> f64 {
    if wavenumber <= 0.0 {
        return 0.0;
    }
    (wavenumber * depth).tanh()
}

/// Phase speed c = ω/k [m/s] at wavenumber k > 0.
#[must_use]
pub fn phase_speed(wavenumber: f64, depth: f64) -> f64 {
    angular_frequency(wavenumber, depth) / wavenumber
}

/// Group speed dω/dk [m/s] at wavenumber k > 0.
///
/// ```text
/// c_g = [(g + 3(τ/ρ)k²) tanh(kh) + (g k + (τ/ρ)k³) h / cosh²(kh)] / (2ω)
/// ```
#[must_use]
pub fn group_speed(wavenumber: f64, depth: f64) -> f64 {
    let k = wavenumber;
    let tanh = depth_factor(k, depth);
    let deep = GRAVITY * k + KINEMATIC_SURFACE_TENSION * k.powi(3);
    // 1/cosh² as 1 − tanh²: no overflow for large k h, and h·0 only where h is finite.
    let sech2 = 1.0 - tanh * tanh;
    let shallow = if sech2 > 0.0 {
        deep * depth * sech2
    } else {
        0.0
    };
    let slope = (GRAVITY + 3.0 * KINEMATIC_SURFACE_TENSION * k * k) * tanh + shallow;
    slope / (2.0 * angular_frequency(k, depth))
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "values that must be the same bits")]
mod tests {
    use super::*;

    #[test]
    fn slowest_wave_is_known() {
        // c_min = (4 g τ/ρ)^¼ = 0.23 m/s at k = √(ρg/τ), wavelength 1.7 cm.
        let k = (GRAVITY / KINEMATIC_SURFACE_TENSION).sqrt();
        let c = phase_speed(k, f64::INFINITY);
        assert!((c - (4.0 * GRAVITY * KINEMATIC_SURFACE_TENSION).powf(0.25)).abs() < 1e-12);
        assert!((c - 0.2305).abs() < 2e-3);
        assert!((group_speed(k, f64::INFINITY) / c - 1.0).abs() < 1e-12);
    }

    #[test]
    fn limits_of_depth() {
        let (k, h) = (1e-3, 2.0);
        assert!((phase_speed(k, h) / (GRAVITY * h).sqrt() - 1.0).abs() < 1e-5);
        assert!((group_speed(k, h) / phase_speed(k, h) - 1.0).abs() < 1e-5);
        // Deep gravity waves have half the phase speed as group speed; large k h neither overflows nor yields NaN.
        for depth in [1e6, f64::INFINITY] {
            assert!((group_speed(0.1, depth) / phase_speed(0.1, depth) - 0.5).abs() < 1e-3);
            assert_eq!(angular_frequency(0.0, depth), 0.0);
        }
    }

    #[test]
    fn group_speed_is_the_derivative() {
        for k in [0.01, 0.3, 5.0, 400.0] {
            for h in [0.5, 10.0, f64::INFINITY] {
                let d = 1e-5 * k;
                let slope = (angular_frequency(k + d, h) - angular_frequency(k - d, h)) / (2.0 * d);
                // Central difference: relative error of order 1e-10 plus rounding 1e-16/1e-5.
                assert!(
                    (group_speed(k, h) / slope - 1.0).abs() < 1e-8,
                    "k {k} h {h}"
                );
            }
        }
    }
}
