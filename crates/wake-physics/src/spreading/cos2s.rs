//! Longuet-Higgins' cos-2s spreading, with the exponents of Hasselmann and of Mitsuyasu.

use crate::constants::GRAVITY;
use std::f64::consts::PI;

/// Cos-2s spreading: most waves travel with the wind.
///
/// ```text
/// D(δ) = Γ(s+1)/(2√π Γ(s+½)) · cos^{2s}(δ/2),   cos²(δ/2) = (1 + cos δ)/2
/// Hasselmann  s = min[6.97 x^4.06, 9.77 x^μ],   μ = −2.33 − 1.45(U/c_p − 1.17)
/// Mitsuyasu   s = s_max · min[x⁵, x^−2.5],      s_max = 11.5 (U/c_p)^−2.5
/// ```
///
/// with `x = f/f_p = √(k/k_p)` and `c_p = √(g/k_p)`. Hasselmann et al. switch branches at 1.05 `f_p`; the branches cross
/// between `f_p` and 1.06 `f_p`, and taking the smaller one makes s continuous.
///
/// # Validity
///
/// `U/c_p` from about 1 to 2 and frequencies up to a few `f_p`; far above, s tends to 0 and the waves are spread evenly
/// over the circle.
///
/// # References
///
/// Hasselmann, Dunckel and Ewing (1980), J. Phys. Oceanogr. 10, 1264;
/// Mitsuyasu et al. (1975), J. Phys. Oceanogr. 5, 750.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cos2s {
    peak_wavenumber: f64,
    /// Level and exponent of x below the peak.
    below: [f64; 2],
    /// Level and exponent of x above the peak.
    above: [f64; 2],
}

impl Cos2s {
    /// Exponents of Hasselmann et al. for a wind U₁₀ [m/s] and a deep-water peak `k_p` [rad/m].
    #[must_use]
    pub fn hasselmann(wind_speed: f64, peak_wavenumber: f64) -> Self {
        let age = inverse_wave_age(wind_speed, peak_wavenumber);
        Self {
            peak_wavenumber,
            below: [6.97, 4.06],
            above: [9.77, -2.33 - 1.45 * (age - 1.17)],
        }
    }

    /// Exponents of Mitsuyasu et al. for a wind U₁₀ [m/s] and a deep-water peak `k_p` [rad/m].
    #[must_use]
    pub fn mitsuyasu(wind_speed: f64, peak_wavenumber: f64) -> Self {
        let top = 11.5 * inverse_wave_age(wind_speed, peak_wavenumber).powf(-2.5);
        Self {
            peak_wavenumber,
            below: [top, 5.0],
            above: [top, -2.5],
        }
    }

    /// Exponent s \[1\] at deep-water wavenumber k [rad/m].
    #[must_use]
    pub fn exponent(&self, wavenumber: f64) -> f64 {
        let ln_x = 0.5 * (wavenumber / self.peak_wavenumber).ln();
        let branch = |[level, power]: [f64; 2]| level * (power * ln_x).exp();
        branch(self.below).min(branch(self.above))
    }

    /// Factor Γ(s+1)/(2√π Γ(s+½)) [1/rad], which makes ∫D = 1.
    #[must_use]
    pub fn normalization(exponent: f64) -> f64 {
        gamma_ratio(exponent) / (2.0 * PI.sqrt())
    }

    /// D(δ) at a deep-water wavenumber [rad/m].
    pub(super) fn at(&self, wavenumber: f64) -> Spread {
        let exponent = self.exponent(wavenumber);
        Spread::Cos2s {
            level: Self::normalization(exponent),
            exponent,
        }
    }

    /// ∫D cos 2δ dδ = s(s − 1)/((s + 1)(s + 2)).
    #[must_use]
    pub fn second_harmonic(&self, wavenumber: f64) -> f64 {
        let s = self.exponent(wavenumber);
        s * (s - 1.0) / ((s + 1.0) * (s + 2.0))
    }
}

/// Inverse wave age `U/c_p = U √(k_p/g)` \[1\].
fn inverse_wave_age(wind_speed: f64, peak_wavenumber: f64) -> f64 {
    wind_speed * (peak_wavenumber / GRAVITY).sqrt()
}

/// Γ(s+1)/Γ(s+½) for s ≥ 0.
fn gamma_ratio(s: f64) -> f64 {
    (libm::lgamma(s + 1.0) - libm::lgamma(s + 0.5)).exp()
}

/// Spreading of the waves of one wavenumber.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Spread {
    /// D(δ) = level · cos^{2s}(δ/2).
    Cos2s { level: f64, exponent: f64 },
    /// D(δ) = (1 + Δ cos 2δ)/(2π).
    Even { anisotropy: f64 },
}

impl Spread {
    /// D(δ) [1/rad] from cos δ, δ the angle to the wind.
    pub(crate) fn density(self, cos_angle: f64) -> f64 {
        match self {
            Self::Cos2s { level, exponent } => {
                level * (0.5 * (1.0 + cos_angle)).max(0.0).powf(exponent)
            }
            Self::Even { anisotropy } => {
                (1.0 + anisotropy * (2.0 * cos_angle * cos_angle - 1.0)) / (2.0 * PI)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Γ(1)/Γ(½) = 1/√π, Γ(3/2)/Γ(1) = √π/2, Γ(2)/Γ(3/2) = 2/√π, and Γ(11)/Γ(21/2).
    #[test]
    fn gamma_ratios_are_known() {
        let root = PI.sqrt();
        let eleven = 3_628_800.0 / (654_729_075.0 / 1024.0 * root);
        for (s, expected) in [
            (0.0, 1.0 / root),
            (0.5, root / 2.0),
            (1.0, 2.0 / root),
            (10.0, eleven),
        ] {
            // ln Γ, below 16 here, errs by a few units of 2e-16 relative, twice; then the exponential.
            assert!((gamma_ratio(s) / expected - 1.0).abs() < 2e-14, "{s}");
        }
    }

    /// The published exponents, and OCEANSAR's version of them in k.
    #[test]
    fn exponents_are_the_published_ones() {
        let (wind, age) = (5.0f64, 1.17);
        let peak = GRAVITY * (age / wind).powi(2);
        let hasselmann = Cos2s::hasselmann(wind, peak);
        for (x, s) in [
            (0.8, 6.97 * 0.8f64.powf(4.06)),
            (1.05, 6.97 * 1.05f64.powf(4.06)),
            (2.0, 9.77 * 2f64.powf(-2.33)),
        ] {
            assert!((hasselmann.exponent(x * x * peak) / s - 1.0).abs() < 1e-9);
        }
        let power = -(0.32 + 0.725 * age);
        // 0.32 is −½(−2.33 + 1.45·1.17) = 0.3168 rounded.
        let in_k = 9.77 * 3f64.powf(power);
        assert!((hasselmann.exponent(3.0 * peak) / in_k - 1.0).abs() < 4e-3);
        let mitsuyasu = Cos2s::mitsuyasu(wind, peak);
        assert!((mitsuyasu.exponent(peak) / (11.5 * age.powf(-2.5)) - 1.0).abs() < 1e-12);
    }

    /// Most waves travel with the wind, and the exponent is continuous.
    #[test]
    fn the_spread_is_continuous_and_points_downwind() {
        let spreading = Cos2s::hasselmann(10.0, 0.2);
        let mut old = spreading.exponent(0.1);
        for n in 1..2000 {
            let k = 0.1 + 0.0002 * f64::from(n);
            let s = spreading.exponent(k);
            assert!((s / old - 1.0).abs() < 0.01);
            assert!(spreading.at(k).density(0.9) > spreading.at(k).density(-0.9));
            old = s;
        }
    }
}
