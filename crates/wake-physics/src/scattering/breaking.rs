//! Return of breaking waves, added to the Bragg return and equal in both polarizations.
//!
//! ```text
//! σ_b(θ) = q [sec⁴θ/s² exp(−tan²θ/s²) + ε/s²],     s² = 0.19, ε = 0.005
//! q      = 0.006 (U₁₀/5)^1.3
//! ```
//!
//! Form and s², ε: Kudryavtsev, Hauser, Caudal and Chapron (2003), J. Geophys. Res. 108, as implemented by others. The law
//! of q is fitted to the excess of CMOD5.N over two-scale Bragg scattering at 35° upwind; its exponent is chosen.

use crate::constants::{GRAVITY, VON_KARMAN};
use crate::dispersion::angular_frequency;
use crate::spectrum::elfouhaily::{DragLaw, friction_velocity};

/// Mean square slope of breakers s² \[1\].
const SLOPE: f64 = 0.19;

/// Isotropic part of the breakers' return, ε \[1\].
const ALL_ANGLES: f64 = 0.005;

/// Density of air over that of water: 1.25 over 1025 kg/m³.
const AIR_OVER_WATER: f64 = 1.25 / 1025.0;

/// Kinematic viscosity of air [m²/s], at 15 °C.
const VISCOSITY_OF_AIR: f64 = 1.47e-5;

/// Exponent n of breaking in the wave energy: a relative change of steepness changes breaking n + 1 = 6 times as much.
const BREAKING_POWER: f64 = 5.0;

/// Steepness of the action spectrum of the breaking waves, as implemented by others: 9/2, for a spectrum k⁻⁴.
const STEEPNESS: f64 = 4.5;

/// Share of σ⁰ due to breaking waves in VV and HH at the edges of a wake: chosen.
pub(crate) const SHARE: [f64; 2] = [0.2, 0.4];

/// σ⁰ of breaking waves over the share q of the sea that they cover \[1\].
///
/// - `incidence` θ \[rad\]
#[must_use]
pub fn of_coverage(incidence: f64) -> f64 {
    let tan2 = incidence.tan().powi(2);
    let sec4 = (1.0 + tan2).powi(2);
    (sec4 * (-tan2 / SLOPE).exp() + ALL_ANGLES) / SLOPE
}

/// Share q of the sea covered by breaking waves \[1\].
///
/// - `wind_speed` [m/s] at 10 m
///
/// # Validity
///
/// 5 to 10 m/s, where it was fitted.
#[must_use]
pub fn coverage(wind_speed: f64) -> f64 {
    0.006 * (wind_speed / 5.0).powf(1.3)
}

/// σ⁰ of breaking waves \[1\], see the module page.
///
/// - `incidence` θ \[rad\]; `wind_speed` [m/s]
#[must_use]
pub fn backscatter(incidence: f64, wind_speed: f64) -> f64 {
    coverage(wind_speed) * of_coverage(incidence)
}

/// Response time `T_b` \[s\] of the return of breaking waves to a divergence.
///
/// ```text
/// T_b = (n + 1) · 4.5 · ½/μ(k_b),     n = 5, k_b = min(k_e/10, 2π/0.3 m)
/// ```
///
/// - `radar_wavenumber` `k_e` [rad/m]; `wind_speed` [m/s]; infinite without wind
#[must_use]
pub fn response_time(radar_wavenumber: f64, wind_speed: f64) -> f64 {
    if wind_speed <= 0.0 {
        return f64::INFINITY;
    }
    let k = (0.1 * radar_wavenumber).min(std::f64::consts::TAU / 0.3);
    let rate = growth_rate(k, friction_velocity(wind_speed, DragLaw::default()));
    0.5 * (BREAKING_POWER + 1.0) * STEEPNESS / rate
}

/// Rate at which breaking waves gain energy from the wind, μ [1/s].
///
/// ```text
/// μ = 2 C (u*/c)² ω,     C = 1.5 (ρ_a/ρ_w) [ln(π/(k z₀))/κ − c/u*],  at least 0
/// ```
///
/// - `wavenumber` k [rad/m]; `friction_velocity` u* [m/s]
///
/// # Difference from the relaxation rate of the Bragg waves
///
/// That rate, 0.04 (u*/c)² ω, was measured where u*/c is 0.1 to 3. The breaking waves are at least 0.3 m long and travel
/// almost as fast as the wind above them: at L band u*/c is 0.05 to 0.09 in winds of 3 to 5 m/s. Their own speed reduces
/// the energy they gain, by the term −c/u*, which the other law lacks: that law gives 0.7 times this rate at 5 to 10 m/s
/// and 1.8 times at 3 m/s (L band). The friction velocity is the same.
///
/// # References
///
/// Kudryavtsev et al. (2005), J. Geophys. Res. 110, as implemented by others.
#[must_use]
pub fn growth_rate(wavenumber: f64, friction_velocity: f64) -> f64 {
    let omega = angular_frequency(wavenumber, f64::INFINITY);
    let speed = omega / wavenumber;
    let roughness = roughness(friction_velocity);
    let profile = (std::f64::consts::PI / (wavenumber * roughness)).ln() / VON_KARMAN
        - speed / friction_velocity;
    let coefficient = 1.5 * AIR_OVER_WATER * profile.max(0.0);
    2.0 * coefficient * (friction_velocity / speed).powi(2) * omega
}

/// Roughness length `z₀` = 0.018 u*²/g + 0.1 ν/u* \[m\].
fn roughness(friction_velocity: f64) -> f64 {
    0.018 * friction_velocity.powi(2) / GRAVITY + 0.1 * VISCOSITY_OF_AIR / friction_velocity
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn wavenumber(frequency: f64) -> f64 {
        TAU * frequency / crate::constants::SPEED_OF_LIGHT
    }

    /// Values of the bracket computed by another program, to the printed digits.
    #[test]
    fn return_over_coverage() {
        for (degrees, expected, rounding) in
            [(25.0, 2.51, 6e-3), (35.0, 0.912, 6e-4), (45.0, 0.135, 6e-4)]
        {
            let value = of_coverage(f64::to_radians(degrees));
            assert!((value - expected).abs() < rounding, "{degrees}: {value}");
        }
        // At nadir: 1/s² + ε/s².
        assert!((of_coverage(0.0) - 1.005 / 0.19).abs() < 1e-12);
    }

    /// Fitted to 0.0057 at 5 m/s and 0.0136 at 10 m/s.
    #[test]
    fn coverage_is_that_of_its_fit() {
        assert!((coverage(5.0) / 0.0057 - 1.0).abs() < 0.1);
        assert!((coverage(10.0) / 0.0136 - 1.0).abs() < 0.1);
        assert!(coverage(0.0).abs() < f64::MIN_POSITIVE);
    }

    /// At 35°, −17.1 dB of VV becomes −16.1 and −21.0 dB of HH becomes −18.7 (5 m/s).
    #[test]
    fn horizontal_polarization_gains_more() {
        let added = backscatter(35f64.to_radians(), 5.0);
        let with = |db: f64| 10.0 * (10f64.powf(0.1 * db) + added).log10();
        assert!((with(-17.1) + 16.1).abs() < 0.1, "{}", with(-17.1));
        assert!((with(-21.0) + 18.7).abs() < 0.1, "{}", with(-21.0));
    }

    /// μ of the Bragg waves at 35° and `T_b`, computed by another program from the same formulas, whose air density and
    /// roughness are not stated: within 4 % and half a unit of the last digit.
    #[test]
    fn rates_and_responses_as_tabulated() {
        for (k, rates) in [
            (30.5, [0.024, 0.082, 0.173, 0.373]),
            (76.9, [0.095, 0.300, 0.611, 1.27]),
            (129.9, [0.193, 0.596, 1.19, 2.43]),
            (232.0, [0.385, 1.16, 2.29, 4.55]),
        ] {
            for (wind, rate) in [3.0, 5.0, 7.0, 10.0].into_iter().zip(rates) {
                let found = growth_rate(k, friction_velocity(wind, DragLaw::default()));
                assert!(
                    (found - rate).abs() < 0.04 * rate + 5e-4,
                    "{k} {wind}: {found}"
                );
            }
        }
        for (frequency, times) in [
            (5.405e9, [1236.0, 711.0, 323.0, 144.0]),
            (9.65e9, [506.0, 299.0, 140.0, 64.0]),
        ] {
            for (wind, time) in [4.0, 5.0, 7.0, 10.0].into_iter().zip(times) {
                let found = response_time(wavenumber(frequency), wind);
                assert!(
                    (found / time - 1.0).abs() < 0.04,
                    "{frequency} {wind}: {found}"
                );
            }
        }
        assert!(response_time(wavenumber(5.4e9), 0.0).is_infinite());
    }

    /// The wind of the logarithmic profile over this roughness, u*/κ ln(10 m/z₀), is the one whose drag law gave u*: one
    /// friction velocity serves both, within 1 % where the coverage was fitted.
    #[test]
    fn the_friction_velocity_has_the_profile_of_the_roughness() {
        for wind in [5.0, 7.0, 10.0] {
            let u = friction_velocity(wind, DragLaw::default());
            let profile = u / VON_KARMAN * (10.0 / roughness(u)).ln();
            assert!((profile / wind - 1.0).abs() < 0.01, "{wind}: {profile}");
        }
    }
}
