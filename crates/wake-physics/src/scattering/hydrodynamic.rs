//! Hydrodynamic modulation: long waves gather and thin out the short waves that the radar sees.
//!
//! The modulation m is a field linear in the long waves, [`Quantity::Hydrodynamic`](crate::waves::Quantity).
//! Here are the rate at which the short waves recover, and the factor by which m changes the Bragg return.
//! Tilt is no part of it: that is in the facet's slope.

use crate::dispersion::angular_frequency;

/// Slowest and fastest relaxation admitted [1/s], the range of a scene's `radar.relaxation_rate`.
pub(crate) const RELAXATION_RANGE: [f64; 2] = [0.01, 100.0];

/// Rate at which the Bragg waves return to equilibrium with the wind, taken as their rate of growth.
///
/// ```text
/// μ = 0.04 (u*/c_B)² ω_B,  clamped to 0.01…100 1/s
/// ```
///
/// - `friction_velocity` u* [m/s], `bragg_wavenumber` `k_B` [rad/m], above 0
/// - returns μ [1/s]; about 1 at X band, 32° and 5 m/s wind
///
/// # Validity
///
/// Growth was measured for u*/c from 0.1 to 3, along the wind; the angle between wind and wave is left out, and
/// so is the loss to viscosity, which exceeds the growth at the lowest winds: hence the lower clamp.
///
/// # References
///
/// Plant (1982), J. Geophys. Res. 87(C3), 1961, Eq. 3.
#[must_use]
pub(crate) fn relaxation_rate(friction_velocity: f64, bragg_wavenumber: f64) -> f64 {
    let omega = angular_frequency(bragg_wavenumber, f64::INFINITY);
    let speed = omega / bragg_wavenumber;
    let growth = 0.04 * (friction_velocity / speed).powi(2) * omega;
    growth.clamp(RELAXATION_RANGE[0], RELAXATION_RANGE[1])
}

/// Factor on the Bragg return, max(0, 1 + m) \[1\].
///
/// The theory is linear in m, so 1 + m may fall below 0 where the current changes fast. There are no fewer
/// short waves than none: the factor is 0 then.
#[must_use]
pub(crate) fn bragg_factor(modulation: f32) -> f32 {
    (1.0 + modulation).max(0.0)
}

#[cfg(test)]
#[allow(
    clippy::float_cmp,
    reason = "exact zeros and values that nothing may change"
)]
mod tests {
    use super::*;

    /// By hand at k = 213.24 rad/m: ω = √(9.80665·213.24 + 7.2e-5·213.24³) = 52.8139 rad/s,
    /// c = 0.247673 m/s; u* = 0.2 m/s gives 0.04·0.652084·52.8139 = 1.37756 1/s.
    #[test]
    fn growth_by_hand() {
        assert!((relaxation_rate(0.2, 213.24) - 1.37756).abs() < 1e-5);
    }

    #[test]
    fn rate_rises_with_wind_and_wavenumber_and_stays_in_range() {
        assert!(relaxation_rate(0.3, 200.0) > relaxation_rate(0.2, 200.0));
        assert!(relaxation_rate(0.2, 400.0) > relaxation_rate(0.2, 50.0));
        assert_eq!(relaxation_rate(0.0, 200.0), 0.01);
        assert_eq!(relaxation_rate(50.0, 200.0), 100.0);
    }

    #[test]
    fn short_waves_cannot_be_fewer_than_none() {
        assert_eq!(bragg_factor(-1.5), 0.0);
        assert_eq!(bragg_factor(0.25), 1.25);
    }
}
