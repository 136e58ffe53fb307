//! Hydrodynamic modulation: long waves concentrate and thin out the short waves that scatter.
//!
//! The modulation m is a field linear in the long waves, [`Quantity::Hydrodynamic`](crate::waves::Quantity).
//! This module has the relaxation rate of the short waves, the strength of their response, and the factor by which m
//! changes the Bragg return. Tilt is not included: it is part of the facet's slope.

use crate::dispersion::angular_frequency;
use crate::raster::Field;
use crate::spectrum::Elfouhaily;
use rayon::prelude::*;

/// Step in ln k of the finite difference for the action slope \[1\].
const STEP: f64 = 1e-3;

/// Lowest and highest relaxation rate allowed [1/s], the range of a scene's `radar.relaxation_rate`.
pub(crate) const RELAXATION_RANGE: [f64; 2] = [0.01, 100.0];

/// Rate at which the Bragg waves relax to equilibrium with the wind, taken as their growth rate.
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
/// Growth was measured for u*/c from 0.1 to 3, along the wind. The angle between wind and wave is neglected, as is viscous
/// dissipation, which exceeds the growth at the lowest winds: hence the lower clamp.
///
/// # References
///
/// Plant (1982), J. Geophys. Res. 87(C3), 1961, Eq. 3.
#[must_use]
pub fn relaxation_rate(friction_velocity: f64, bragg_wavenumber: f64) -> f64 {
    let omega = angular_frequency(bragg_wavenumber, f64::INFINITY);
    let speed = omega / bragg_wavenumber;
    let growth = 0.04 * (friction_velocity / speed).powi(2) * omega;
    growth.clamp(RELAXATION_RANGE[0], RELAXATION_RANGE[1])
}

/// Slope of the action spectrum of the Bragg waves, which determines their response to a strain of the current.
///
/// ```text
/// m_B = −∂ln N/∂ln k  at k_B,     N = ω Ψ/k
/// ```
///
/// - `spectrum` of the short waves; `bragg_wavenumber` `k_B` [rad/m], above 0
/// - `wind` unit vector (x, y) of the wind direction (toward); the Bragg waves travel along x
/// - returns `m_B` \[1\], 3.8 to 5.3 from L to X band at 3 to 10 m/s; 0 where there are no short waves
///
/// For gravity waves, a spectrum Ψ ∝ k⁻⁴ has 4.5.
///
/// # References
///
/// Alpers and Hasselmann (1978), Boundary-Layer Meteorology 13 (the action balance); the spectrum is Elfouhaily's.
#[must_use]
pub fn action_slope(spectrum: &Elfouhaily, bragg_wavenumber: f64, wind: [f64; 2]) -> f64 {
    let ln_action = |k: f64| {
        let density = spectrum.density([k, 0.0], wind);
        (angular_frequency(k, f64::INFINITY) * density / k).ln()
    };
    let [below, above] = [-0.5, 0.5].map(|s| ln_action(bragg_wavenumber * (s * STEP).exp()));
    let slope = (below - above) / STEP;
    if slope.is_finite() { slope } else { 0.0 }
}

/// Converts modulations m into factors on the Bragg return \[1\], in place.
///
/// ```text
/// exp(m − ½ var m)
/// ```
///
/// The theory is linear in m. The exponential agrees with 1 + m to first order, is never negative, and has the mean 1 for
/// Gaussian m.
///
/// - `variance` of m over the sea
pub(crate) fn to_bragg_factors(modulation: &mut Field, variance: f64) {
    let half = (0.5 * variance) as f32;
    let values = modulation.values.par_iter_mut().with_min_len(1 << 14);
    values.for_each(|m| *m = (*m - half).exp());
}

#[cfg(test)]
#[allow(
    clippy::float_cmp,
    reason = "exact zeros and values that nothing may change"
)]
mod tests {
    use super::*;
    use crate::spectrum::elfouhaily::{DragLaw, FULLY_DEVELOPED};

    /// Worked out by hand at k = 213.24 rad/m: ω = √(9.80665·213.24 + 7.2e-5·213.24³) = 52.8139 rad/s, c = 0.247673 m/s; u*
    /// = 0.2 m/s gives 0.04·0.652084·52.8139 = 1.37756 1/s.
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

    /// Averages over a normal density: the mean factor is 1 for any variance, all factors are positive, and for small
    /// modulations the factor is 1 + m.
    #[test]
    fn factors_have_the_mean_one() {
        let count = 1 << 16;
        for deviation in [0.05f64, 0.3, 0.8] {
            // The midpoint rule over the density is accurate here, and faster than samples.
            let raster = crate::Raster::image(1, count, 1.0);
            let at = |j: usize| 8.0 * ((j as f64 + 0.5) / count as f64 * 2.0 - 1.0);
            let mut field = Field::from_fn(&raster, |_, j| (deviation * at(j)) as f32);
            to_bragg_factors(&mut field, deviation * deviation);
            let (mut mean, mut norm) = (0.0, 0.0);
            for (j, &factor) in field.values.iter().enumerate() {
                let weight = (-0.5 * at(j) * at(j)).exp();
                mean += weight * f64::from(factor);
                norm += weight;
                assert!(factor > 0.0);
            }
            // Rounding of f32 numbers; the density is cut at 8 standard deviations.
            assert!(
                (mean / norm - 1.0).abs() < 1e-6,
                "{deviation}: {}",
                mean / norm
            );
        }
        let mut small = Field::constant(&crate::Raster::image(1, 1, 1.0), 1e-3);
        to_bragg_factors(&mut small, 0.0);
        assert!((small.values[0] - 1.001).abs() < 1e-6);
    }

    /// The reference table at 35° for winds of 3, 5, 7, 10 m/s over a fully developed sea, upwind, to two decimals:
    /// computed by another program from the same spectrum.
    #[test]
    fn the_action_slope_is_that_of_the_table() {
        for (frequency, expected) in [
            (1.27e9, [4.83, 4.93, 4.64, 4.12]),
            (3.2e9, [5.17, 4.52, 4.03, 3.87]),
            (5.405e9, [5.30, 4.11, 3.86, 3.80]),
            (9.65e9, [5.09, 3.90, 3.84, 3.82]),
        ] {
            let k_e = std::f64::consts::TAU * frequency / crate::constants::SPEED_OF_LIGHT;
            let bragg = crate::scattering::bragg::wavenumber(k_e, 35f64.to_radians());
            for (wind_speed, value) in [3.0, 5.0, 7.0, 10.0].into_iter().zip(expected) {
                let spectrum = Elfouhaily::of_age(wind_speed, FULLY_DEVELOPED, DragLaw::Wu);
                let found = action_slope(&spectrum, bragg, [1.0, 0.0]);
                // Half a unit of the last digit.
                assert!(
                    (found - value).abs() <= 0.005,
                    "{frequency:.2e} Hz, {wind_speed} m/s: {found} {value}"
                );
            }
        }
    }

    /// Without wind there are no short waves to modulate.
    #[test]
    fn no_short_waves_have_no_action_slope() {
        assert_eq!(
            action_slope(&Elfouhaily::new(0.0, 4e4), 200.0, [1.0, 0.0]),
            0.0
        );
    }
}
