//! Spectrum of a fully developed sea by Pierson and Moskowitz (1964).

use crate::constants::GRAVITY;

/// Level α of the tail \[1\].
pub(super) const LEVEL: f64 = 0.0081;

/// Strength β of the low-frequency cut \[1\].
const CUT: f64 = 0.74;

/// U₁₉.₅/U₁₀ \[1\]: the logarithmic profile over the sea at moderate wind. A 1/7 power law would give 1.10.
const MAST_WIND: f64 = 1.026;

/// Spectrum of a fully developed sea.
///
/// ```text
/// S(ω) = α g² ω⁻⁵ exp[−β (g/(U ω))⁴]      B(k) = (α/2) exp[−β (g/(U² k))²]
/// α = 0.0081, β = 0.74, U = U₁₉.₅ = 1.026 U₁₀;   Hs = 2 √(α/β) U²/g,   ω_p⁴ = (4/5) β (g/U)⁴
/// ```
///
/// # Validity
///
/// Gravity waves up to a few times the peak frequency. The tail does not depend on the wind: do not use it for the waves
/// that scatter.
///
/// # References
///
/// Pierson and Moskowitz (1964), J. Geophys. Res. 69, 5181.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PiersonMoskowitz {
    /// Wind speed at 19.5 m, U₁₉.₅ [m/s].
    wind: f64,
}

impl PiersonMoskowitz {
    /// The developed sea for a wind U₁₀ [m/s].
    #[must_use]
    pub fn new(wind_speed: f64) -> Self {
        Self {
            wind: MAST_WIND * wind_speed,
        }
    }

    /// Frequency spectrum S(ω) [m² s] at ω > 0 [rad/s].
    #[must_use]
    pub fn frequency_spectrum(&self, omega: f64) -> f64 {
        let cut = CUT * (GRAVITY / (self.wind * omega)).powi(4);
        LEVEL * GRAVITY.powi(2) * omega.powi(-5) * (-cut).exp()
    }

    /// Curvature spectrum B(k) = k³ S(k) \[1\]; 0 at k ≤ 0 and without wind.
    #[must_use]
    pub fn curvature(&self, wavenumber: f64) -> f64 {
        if wavenumber <= 0.0 || self.wind <= 0.0 {
            return 0.0;
        }
        let ratio = GRAVITY / (self.wind * self.wind * wavenumber);
        0.5 * LEVEL * (-CUT * ratio * ratio).exp()
    }

    /// Peak frequency `ω_p` [rad/s].
    #[must_use]
    pub fn peak_frequency(&self) -> f64 {
        (0.8 * CUT).powf(0.25) * GRAVITY / self.wind
    }

    /// Wavenumber of the peak frequency, `ω_p²/g` [rad/m]; infinite without wind.
    #[must_use]
    pub fn peak_wavenumber(&self) -> f64 {
        self.peak_frequency().powi(2) / GRAVITY
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "nothing is exactly 0")]
mod tests {
    use super::*;
    use crate::spectrum::to_wavenumber;

    /// ∫ωⁿ S dω by the trapezoidal rule in ln ω, with 200 steps per e-fold.
    fn moment(model: &PiersonMoskowitz, n: i32, upper: f64) -> f64 {
        let (low, step) = ((0.2 * model.peak_frequency()).ln(), 0.005);
        let count = ((upper.ln() - low) / step) as i32;
        (0..count)
            .map(|i| {
                let omega = (low + (f64::from(i) + 0.5) * step).exp();
                omega.powi(n + 1) * model.frequency_spectrum(omega) * step
            })
            .sum()
    }

    /// Hs = 0.02133 U², `σ_v` = 0.0646 U (closed forms, three digits), and the heights of the table.
    #[test]
    fn moments_are_the_closed_forms() {
        for (wind, height) in [(3.0, 0.202), (5.0, 0.561), (7.0, 1.100)] {
            let model = PiersonMoskowitz::new(wind);
            let hs = 4.0 * moment(&model, 0, 1e3).sqrt();
            assert!((hs - height).abs() < 1e-3, "{wind} {hs}");
            let closed = 2.0 * (LEVEL / CUT).sqrt() * model.wind.powi(2) / GRAVITY;
            assert!((hs / closed - 1.0).abs() < 1e-6);
            // ∫ω²S converges as ω⁻²: cut at 1e4 rad/s it misses less than 1e-7.
            let speed = moment(&model, 2, 1e4).sqrt();
            assert!((speed / model.wind - 0.0646).abs() < 5e-5);
        }
    }

    #[test]
    fn both_forms_are_one_spectrum() {
        let model = PiersonMoskowitz::new(8.0);
        for k in [0.01, 0.05, 0.4] {
            let omega = (GRAVITY * k).sqrt();
            let s = to_wavenumber(model.frequency_spectrum(omega), k, f64::INFINITY);
            // The group speed includes surface tension: relative 3(τ/ρ)k²/g below 4e-6.
            assert!((s * k.powi(3) / model.curvature(k) - 1.0).abs() < 4e-6);
        }
    }

    #[test]
    fn peak_is_the_largest_value() {
        let model = PiersonMoskowitz::new(8.0);
        let peak = model.peak_frequency();
        let top = model.frequency_spectrum(peak);
        assert!(top > model.frequency_spectrum(0.999 * peak));
        assert!(top > model.frequency_spectrum(1.001 * peak));
        assert_eq!(PiersonMoskowitz::new(0.0).curvature(1.0), 0.0);
    }
}
