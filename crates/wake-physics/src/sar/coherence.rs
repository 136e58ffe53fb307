//! Azimuth resolution of a moving sea.
//!
//! A resolution ρ denotes the point response in power
//!
//! ```text
//! exp(−(π/ρ)² y²)        standard deviation ρ/(√2 π)
//! ```
//!
//! which is the response of an aperture with the Gaussian weight exp(−2t²/T²) in amplitude and T = λR/(2Vρ).

use std::f64::consts::{FRAC_PI_2, PI, SQRT_2};

/// Time over which the radar integrates one look of full resolution.
///
/// ```text
/// T = λ (R/V) / (2 ρ_a)
/// ```
///
/// - `wavelength` λ \[m\], of the radar; `range_to_velocity` R/V \[s\]; `resolution` `ρ_a` \[m\], above 0
/// - returns T \[s\]; 0 at R/V = 0
#[must_use]
pub fn integration_time(wavelength: f64, range_to_velocity: f64, resolution: f64) -> f64 {
    wavelength * range_to_velocity / (2.0 * resolution)
}

/// Time in which the field correlation of the echo falls to 1/e because of unresolved moving waves.
///
/// ```text
/// C(t) = ⟨exp(2 i k_e u t)⟩ = exp(−2 k_e² σ_u² t²) = exp(−(t/τ_c)²)
/// τ_c  = 1/(√2 k_e σ_u) = λ/(2√2 π σ_u)
/// ```
///
/// - `wavelength` λ = 2π/`k_e` \[m\], of the radar
/// - `velocity_deviation` `σ_u` [m/s], standard deviation of the line-of-sight velocity of the waves too short for the
///   pixels, at least 0
/// - returns `τ_c` \[s\]; infinite at `σ_u` = 0
///
/// With this definition the lost resolution equals the smear by velocity bunching of the unresolved waves: `λR/(2Vτ_c)` has
/// the standard deviation (R/V)`σ_u`.
///
/// # Validity
///
/// Waves with periods longer than `τ_c` and Gaussian velocities. Other definitions of `τ_c` differ in the prefactor: for
/// Pierson–Moskowitz waves this one is 1.74 λ/U/√erf(2.69 ρ/U²); a prefactor near 3 is also in use.
#[must_use]
pub fn coherence_time(wavelength: f64, velocity_deviation: f64) -> f64 {
    wavelength / (2.0 * SQRT_2 * PI * velocity_deviation)
}

/// Azimuth wavelength below which random motion erases waves from the image.
///
/// ```text
/// λ_c = 2π (R/V) σ_u
/// ```
///
/// - `range_to_velocity` R/V \[s\]; `velocity_deviation` `σ_u` [m/s] of the line-of-sight velocity
/// - returns `λ_c` \[m\]: the power of waves with `k_y` = 2π/`λ_c` is reduced to 1/e, see [`cutoff_transfer`]
///
/// # References
///
/// Hasselmann and Hasselmann (1991), J. Geophys. Res. 96: the quasi-linear transform.
#[must_use]
pub fn azimuth_cutoff(range_to_velocity: f64, velocity_deviation: f64) -> f64 {
    2.0 * PI * range_to_velocity * velocity_deviation
}

/// Share of an azimuth wave's power that remains in the image under random motion.
///
/// ```text
/// exp(−k_y² (R/V)² σ_u²)
/// ```
///
/// - `wavenumber` `k_y` [rad/m]; `range_to_velocity` R/V \[s\]; `velocity_deviation` `σ_u` [m/s]
/// - returns a factor on the power, 0 to 1; its square root applies to the amplitude
#[must_use]
pub fn cutoff_transfer(wavenumber: f64, range_to_velocity: f64, velocity_deviation: f64) -> f64 {
    (-(wavenumber * range_to_velocity * velocity_deviation).powi(2)).exp()
}

/// Azimuth resolution of N looks of a moving sea, as the sum of squares of three parts.
///
/// ```text
/// ρ'² = (N ρ_a)² + (λR/(2Vτ_c))² + (π/2 · T (R/V) a_r)²,      T = λR/(2Vρ_a)
/// ```
///
/// The first two are `N ρ_a √(1 + T²/(N² τ_c²))`, written without a division by N `τ_c`. The looks share the aperture: each
/// of N looks lasts T/N and has the resolution N `ρ_a`. Acceleration `a_r` displaces the looks relative to each other by as
/// much as it defocuses one long look, so this part depends on the whole T and not on N.
///
/// # References
///
/// Alpers and Rufenach (1979) for one look; Alpers and Brüning (1986), IEEE Trans. Geosci. Remote Sens. 24, for N.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AzimuthResolution {
    /// Resolution of a sea at rest, N `ρ_a` \[m\].
    pub nominal: f64,
    /// Part lost to unresolved waves, `λR/(2Vτ_c)` \[m\].
    pub coherence: f64,
    /// Part lost to acceleration, per acceleration: π/2 · T (R/V) \[s²\].
    pub defocus: f64,
}

impl AzimuthResolution {
    /// Resolution of a sea at rest: N looks of single-look resolution `ρ_a` \[m\].
    #[must_use]
    pub fn at_rest(resolution: f64, looks: u32) -> Self {
        Self {
            nominal: resolution * f64::from(looks),
            coherence: 0.0,
            defocus: 0.0,
        }
    }

    /// Resolution of a moving sea.
    ///
    /// - `wavelength` λ \[m\], of the radar; `range_to_velocity` R/V \[s\]
    /// - `resolution` `ρ_a` \[m\], single look, above 0; `looks` N
    /// - `velocity_deviation` `σ_u` [m/s] of unresolved waves, see [`coherence_time`]
    #[must_use]
    pub fn of_moving_sea(
        wavelength: f64,
        range_to_velocity: f64,
        resolution: f64,
        looks: u32,
        velocity_deviation: f64,
    ) -> Self {
        let time = integration_time(wavelength, range_to_velocity, resolution);
        Self {
            coherence: SQRT_2 * PI * range_to_velocity * velocity_deviation,
            defocus: FRAC_PI_2 * time * range_to_velocity,
            ..Self::at_rest(resolution, looks)
        }
    }

    /// Resolution ρ' \[m\] where the acceleration toward the radar is `a_r` [m/s²].
    #[must_use]
    pub fn at(&self, radial_acceleration: f64) -> f64 {
        let defocus = self.defocus * radial_acceleration;
        self.nominal.hypot(self.coherence).hypot(defocus)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constants::GRAVITY;

    const WAVELENGTH: f64 = 0.0312;

    /// Integral by the midpoint rule; the integrands below are smooth.
    fn integral(from: f64, to: f64, f: impl Fn(f64) -> f64) -> f64 {
        let n = 20_000;
        let h = (to - from) / f64::from(n);
        (0..n).map(|i| h * f(from + (f64::from(i) + 0.5) * h)).sum()
    }

    /// The closed form of the literature, with the prefactor of this definition, against a numerical integral over the
    /// Pierson–Moskowitz spectrum of the waves with k > π/ρ.
    #[test]
    fn pierson_moskowitz_closed_form() {
        let (alpha, beta) = (8.1e-3, 0.74);
        for (wind, cell) in [(5.0, 3.0), (10.0, 3.0), (7.0, 12.0)] {
            // ∫ω²S dω from ω_c, in s = ω⁻²: α g²/2 ∫ exp(−β (g/U)⁴ s²) ds from 0 to 1/ω_c².
            let end = cell / (GRAVITY * PI);
            let b: f64 = beta * (GRAVITY / wind).powi(4);
            let variance =
                0.5 * alpha * GRAVITY.powi(2) * integral(0.0, end, |s| (-b * s * s).exp());
            let time = coherence_time(WAVELENGTH, variance.sqrt());
            let erf =
                2.0 / PI.sqrt() * integral(0.0, 2.69 * cell / (wind * wind), |t| (-t * t).exp());
            let closed = 1.742 * WAVELENGTH / wind / erf.sqrt();
            // The constants 1.742 and 2.69 are rounded to three digits.
            assert!((time / closed - 1.0).abs() < 2e-3, "{time} {closed}");
        }
    }

    /// The response in power of a Gaussian aperture, exp(−2t²/T²) in amplitude, to a field of correlation exp(−(t/τ)²) and
    /// acceleration a: a numerical Fourier integral against the closed forms.
    #[test]
    fn resolution_is_that_of_the_focused_aperture() {
        let (ratio, single, acceleration, deviation) = (78.0, 3.0, 0.12, 0.01);
        let resolution = AzimuthResolution::of_moving_sea(WAVELENGTH, ratio, single, 1, deviation);
        let span = integration_time(WAVELENGTH, ratio, single);
        let tau = coherence_time(WAVELENGTH, deviation);
        for (a, tau, expected) in [
            (0.0, f64::INFINITY, single),
            (acceleration, f64::INFINITY, {
                single.hypot(resolution.defocus * acceleration)
            }),
            (0.0, tau, resolution.at(0.0)),
            (acceleration, tau, resolution.at(acceleration)),
        ] {
            // Ambiguity function at the lag d: the phase due to acceleration, 2πa/λ·2·t·d, integrated over t.
            let chirp = 2.0 * PI * a / WAVELENGTH;
            let lag = |d: f64| {
                let aperture = (-(d / span).powi(2)).exp();
                let phase = (-(chirp * d * span).powi(2) / 4.0).exp();
                aperture * phase * (-(d / tau).powi(2)).exp()
            };
            // The Doppler frequency of an azimuth y is 2y/(λR/V); the response must be exp(−(π y/ρ')²).
            let power = |y: f64| {
                let doppler = 4.0 * PI * y / (WAVELENGTH * ratio);
                integral(-4.0 * span, 4.0 * span, |d| lag(d) * (doppler * d).cos())
            };
            let at = 0.3 * expected;
            let ratio = power(at) / power(0.0);
            let closed = (-(PI * at / expected).powi(2)).exp();
            assert!((ratio / closed - 1.0).abs() < 1e-6, "{ratio} {closed}");
        }
    }

    #[test]
    fn looks_are_the_form_of_the_literature() {
        let (ratio, single, deviation) = (78.0, 3.0, 0.15);
        let time = integration_time(WAVELENGTH, ratio, single);
        let tau = coherence_time(WAVELENGTH, deviation);
        for looks in [1, 4, 16] {
            let n = f64::from(looks);
            let ours =
                AzimuthResolution::of_moving_sea(WAVELENGTH, ratio, single, looks, deviation);
            let theirs = n * single * (1.0 + (time / (n * tau)).powi(2)).sqrt();
            assert!((ours.at(0.0) / theirs - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    #[allow(clippy::float_cmp, reason = "terms that are exactly zero")]
    fn a_sea_at_rest_and_no_synthetic_aperture_keep_the_nominal_resolution() {
        let still = AzimuthResolution::of_moving_sea(WAVELENGTH, 78.0, 3.0, 2, 0.0);
        assert_eq!(still.at(0.0), 6.0);
        let none = AzimuthResolution::of_moving_sea(WAVELENGTH, 0.0, 3.0, 2, 0.3);
        assert_eq!(none.at(5.0), 6.0);
        assert_eq!(coherence_time(WAVELENGTH, 0.0), f64::INFINITY);
    }

    #[test]
    fn the_cutoff_damps_power_by_e() {
        let cutoff = azimuth_cutoff(78.0, 0.4);
        let left = cutoff_transfer(2.0 * PI / cutoff, 78.0, 0.4);
        assert!((left - (-1f64).exp()).abs() < 1e-14);
        // The smear by unresolved waves equals bunching by them: same standard deviation (R/V)σ_u.
        let coherence = AzimuthResolution::of_moving_sea(WAVELENGTH, 78.0, 3.0, 1, 0.4).coherence;
        assert!((coherence / (SQRT_2 * PI) - 78.0 * 0.4).abs() < 1e-12);
        let tau = coherence_time(WAVELENGTH, 0.4);
        assert!((coherence * 2.0 * tau / (WAVELENGTH * 78.0) - 1.0).abs() < 1e-12);
    }
}
