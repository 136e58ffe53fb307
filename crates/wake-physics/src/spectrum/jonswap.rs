//! JONSWAP spectrum of a growing sea (Hasselmann et al. 1973, 1976), with a transition to the developed sea.

use super::pierson_moskowitz::{LEVEL, PiersonMoskowitz};
use crate::constants::GRAVITY;
use std::f64::consts::TAU;

/// Dimensionless fetch at which the transition to full development begins \[1\]; chosen, see [`Jonswap`].
const MATURING_FETCH: f64 = 1.1e4;

/// Mean peak enhancement γ of the growing sea \[1\].
const ENHANCEMENT: f64 = 3.3;

/// Spectrum of a sea that grows with the fetch.
///
/// ```text
/// S(ω) = α g² ω⁻⁵ exp[−(5/4)(ω_p/ω)⁴] γ^r      r = exp[−(ω − ω_p)²/(2σ²ω_p²)],  σ = 0.07 (ω ≤ ω_p), 0.09
/// B(k) = (α/2) exp[−(5/4)(k_p/k)²] γ^r         with ω/ω_p = √(k/k_p)
/// α = 0.076 ξ^−0.22    ω_p = 2π·3.5 (g/U₁₀) ξ^−0.33    γ = 3.3    ξ = gF/U₁₀²
/// ```
///
/// # Validity
///
/// The growth laws hold for growing seas. Beyond the fetch `ξ_d` ≈ 1.88·10⁴, where their peak reaches that of Pierson and
/// Moskowitz, the Pierson–Moskowitz spectrum is used. From ξ₁ = 1.1·10⁴ to `ξ_d`, `ω_p` follows its law while α and γ tend
/// to those of the developed sea (0.0081 and 1):
///
/// ```text
/// ln α = (1 − m) ln α(ξ₁) + m ln 0.0081     ln γ = (1 − m^1.25) ln 3.3     m = ln(ξ/ξ₁)/ln(ξ_d/ξ₁)
/// ```
///
/// The spectrum is thus continuous in the fetch, and the wave height never decreases with it. ξ₁ and the exponent are
/// chosen: with a later start the height would decrease, with an earlier one growing seas would lose their peak.
///
/// # References
///
/// Hasselmann, Ross, Müller and Sell (1976), J. Phys. Oceanogr. 6, 200.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jonswap {
    level: f64,
    peak_frequency: f64,
    ln_enhancement: f64,
}

impl Jonswap {
    /// Sea raised by a wind U₁₀ [m/s] over a fetch F \[m\], limited to the developed sea.
    #[must_use]
    pub fn new(wind_speed: f64, fetch: f64) -> Self {
        let developed = PiersonMoskowitz::new(wind_speed).peak_frequency();
        let growth = TAU * 3.5 * GRAVITY / wind_speed;
        let developed_fetch = (growth / developed).powf(1.0 / 0.33);
        let xi = GRAVITY * fetch / wind_speed.powi(2);
        if wind_speed <= 0.0 || xi >= developed_fetch {
            return Self::with(LEVEL, developed, 1.0);
        }
        let law = |xi: f64| 0.076 * xi.powf(-0.22);
        let maturity = (xi / MATURING_FETCH).ln() / (developed_fetch / MATURING_FETCH).ln();
        let m = maturity.max(0.0);
        let level = law(xi.min(MATURING_FETCH)).powf(1.0 - m) * LEVEL.powf(m);
        Self::with(
            level,
            growth * xi.powf(-0.33),
            ENHANCEMENT.powf(1.0 - m.powf(1.25)),
        )
    }

    /// Spectrum with given level α \[1\], peak frequency `ω_p` [rad/s] and peak enhancement γ \[1\].
    #[must_use]
    pub fn with(level: f64, peak_frequency: f64, enhancement: f64) -> Self {
        Self {
            level,
            peak_frequency,
            ln_enhancement: enhancement.ln(),
        }
    }

    /// Frequency spectrum S(ω) [m² s] at ω > 0 [rad/s].
    #[must_use]
    pub fn frequency_spectrum(&self, omega: f64) -> f64 {
        self.level * GRAVITY.powi(2) * omega.powi(-5) * self.shape(omega / self.peak_frequency)
    }

    /// Curvature spectrum B(k) = k³ S(k) \[1\]; 0 at k ≤ 0 and without wind.
    #[must_use]
    pub fn curvature(&self, wavenumber: f64) -> f64 {
        if wavenumber <= 0.0 || !self.peak_frequency.is_finite() {
            return 0.0;
        }
        0.5 * self.level * self.shape((wavenumber / self.peak_wavenumber()).sqrt())
    }

    /// Wavenumber of the peak frequency, `ω_p²/g` [rad/m]; infinite without wind.
    #[must_use]
    pub fn peak_wavenumber(&self) -> f64 {
        self.peak_frequency.powi(2) / GRAVITY
    }

    /// exp[−(5/4)x⁻⁴] γ^r at `x = ω/ω_p`.
    fn shape(&self, x: f64) -> f64 {
        let width = if x <= 1.0 { 0.07 } else { 0.09 };
        let r = (-0.5 * ((x - 1.0) / width).powi(2)).exp();
        (self.ln_enhancement * r - 1.25 * x.powi(-4)).exp()
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "nothing is exactly 0")]
mod tests {
    use super::*;

    /// ∫S dω by the midpoint rule in ln ω, with 1000 steps per e-fold.
    fn variance(model: &Jonswap) -> f64 {
        let step = 1e-3;
        (-1600..7000)
            .map(|i| {
                let omega = model.peak_frequency * ((f64::from(i) + 0.5) * step).exp();
                omega * model.frequency_spectrum(omega) * step
            })
            .sum()
    }

    /// `m₀ω_p⁴/(αg²)` is 0.2 for γ = 1 (exactly) and 0.305 for γ = 3.3.
    #[test]
    fn two_numbers() {
        for (gamma, expected, digits) in [(1.0, 0.2, 1e-6), (3.3, 0.305, 5e-4)] {
            let model = Jonswap::with(0.01, 0.8, gamma);
            let number = variance(&model) * 0.8f64.powi(4) / (0.01 * GRAVITY.powi(2));
            assert!((number - expected).abs() < digits, "{gamma} {number}");
        }
    }

    /// Height, peak period and level of growing seas against the independent implementation
    /// `tests/reference/sea_and_scattering.py`: one unit of the last digit.
    #[test]
    fn growing_seas_meet_the_reference() {
        for (wind, fetch, height, period, level) in [
            (3.0, 1e4, 0.192, 1.88, 0.00983),
            (5.0, 1e4, 0.304, 2.23, 0.01231),
            (7.0, 1e4, 0.412, 2.51, 0.01427),
            (7.0, 4e4, 0.882, 3.96, 0.01052),
        ] {
            let model = Jonswap::new(wind, fetch);
            assert!((4.0 * variance(&model).sqrt() - height).abs() < 1e-3);
            assert!((TAU / model.peak_frequency - period).abs() < 1e-2);
            assert!((model.level - level).abs() < 1e-5);
        }
        // The laws without the transition, for older seas (5 m/s over 40 km, 7 m/s over 70 km): same script.
        for (level, period, height) in [(0.00907, 3.53, 0.652), (0.00930, 4.76, 1.200)] {
            let hs = 4.0 * variance(&Jonswap::with(level, TAU / period, 3.3)).sqrt();
            // The period has three digits and enters squared.
            assert!((hs / height - 1.0).abs() < 4e-3, "{hs}");
        }
    }

    /// Beyond full development the spectrum is that of Pierson and Moskowitz, reached continuously, with a wave height that
    /// never decreases with the fetch.
    #[test]
    fn growth_ends_in_the_developed_sea() {
        let wind = 5.0;
        let developed = PiersonMoskowitz::new(wind);
        for omega in [1.0, 1.7, 4.0] {
            let s = Jonswap::new(wind, 1e6).frequency_spectrum(omega);
            assert!((s / developed.frequency_spectrum(omega) - 1.0).abs() < 1e-12);
        }
        let heights: Vec<f64> = (0..400)
            .map(|i| {
                let xi = 5e3 * (f64::from(i) * 0.004).exp();
                variance(&Jonswap::new(wind, xi * wind * wind / GRAVITY)).sqrt()
            })
            .collect();
        for pair in heights.windows(2) {
            // Growth below full development is about √ξ^1.1, 0.2 % per step, without jumps or decreases.
            assert!(pair[1] > pair[0] * (1.0 - 1e-9) && pair[1] < pair[0] * 1.003);
        }
    }

    #[test]
    fn both_forms_are_one_spectrum() {
        let model = Jonswap::new(7.0, 2e4);
        for x in [0.5, 0.95, 1.0, 1.1, 3.0] {
            let omega = x * model.peak_frequency;
            let k = omega * omega / GRAVITY;
            // B = k³ S(ω) dω/dk with dω/dk = g/(2ω).
            let b = k.powi(3) * model.frequency_spectrum(omega) * GRAVITY / (2.0 * omega);
            assert!((b / model.curvature(k) - 1.0).abs() < 1e-12);
        }
        assert_eq!(Jonswap::new(0.0, 1e4).curvature(1.0), 0.0);
    }
}
