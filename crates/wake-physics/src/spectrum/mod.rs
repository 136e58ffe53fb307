//! Wavenumber spectra of the wind sea.
//!
//! ```text
//! ⟨ζ²⟩ = ∫S(k) dk = ∬Ψ(kx, ky) dkx dky      Ψ = S(k) D(k, φ)/k, ∫D dφ = 1      B(k) = k³ S(k)
//! ```
//!
//! There is one file per published model, each for deep water.
//!
//! # Finite depth
//!
//! Over water of depth h, all models keep their curvature spectrum B at equal frequency (Kitaigorodskii, Krasitskii and
//! Zaslavskii 1975; the TMA spectrum of Bouws et al. 1985 is JONSWAP treated in this way):
//!
//! ```text
//! B_h(k) = B_∞(k_∞),   k_∞ = k tanh(kh)
//! ```
//!
//! which equals the factor Φ of those papers on S(ω), see [`kitaigorodskii_factor`].

pub mod elfouhaily;
mod jonswap;
mod pierson_moskowitz;

pub use elfouhaily::Elfouhaily;
pub use jonswap::Jonswap;
pub use pierson_moskowitz::PiersonMoskowitz;

use crate::constants::GRAVITY;
use crate::dispersion::{angular_frequency, depth_factor, group_speed};
use crate::scene::SpectrumModel;

/// Deep-water spectrum of one sea, by one of the models.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Spectrum {
    /// Elfouhaily et al. (1997).
    Elfouhaily(Elfouhaily),
    /// JONSWAP, capped at full development.
    Jonswap(Jonswap),
    /// Pierson and Moskowitz (1964).
    PiersonMoskowitz(PiersonMoskowitz),
}

impl Spectrum {
    /// Sea raised by a wind U₁₀ [m/s] over a fetch \[m\].
    #[must_use]
    pub fn new(model: SpectrumModel, wind_speed: f64, fetch: f64) -> Self {
        match model {
            SpectrumModel::Elfouhaily => Self::Elfouhaily(Elfouhaily::new(wind_speed, fetch)),
            SpectrumModel::Jonswap => Self::Jonswap(Jonswap::new(wind_speed, fetch)),
            SpectrumModel::PiersonMoskowitz => {
                Self::PiersonMoskowitz(PiersonMoskowitz::new(wind_speed))
            }
        }
    }

    /// Curvature spectrum B(k) = k³ S(k) \[1\] at k [rad/m].
    #[must_use]
    pub fn curvature(&self, wavenumber: f64) -> f64 {
        match self {
            Self::Elfouhaily(model) => model.curvature(wavenumber),
            Self::Jonswap(model) => model.curvature(wavenumber),
            Self::PiersonMoskowitz(model) => model.curvature(wavenumber),
        }
    }

    /// Wavenumber of the peak of S(ω) [rad/m]; infinite without wind.
    #[must_use]
    pub fn peak_wavenumber(&self) -> f64 {
        match self {
            Self::Elfouhaily(model) => model.peak_wavenumber(),
            Self::Jonswap(model) => model.peak_wavenumber(),
            Self::PiersonMoskowitz(model) => model.peak_wavenumber(),
        }
    }
}

/// Wavenumber spectrum S(k) = S(ω) dω/dk \[m³\] from a frequency spectrum S(ω) [m² s] at the ω of k.
#[must_use]
pub fn to_wavenumber(frequency_spectrum: f64, wavenumber: f64, depth: f64) -> f64 {
    frequency_spectrum * group_speed(wavenumber, depth)
}

/// Frequency spectrum S(ω) = S(k)/(dω/dk) [m² s] from a wavenumber spectrum S(k) \[m³\] at the k of ω.
#[must_use]
pub fn to_frequency(wavenumber_spectrum: f64, wavenumber: f64, depth: f64) -> f64 {
    wavenumber_spectrum / group_speed(wavenumber, depth)
}

/// Wavenumber of the deep-water gravity wave of the same frequency, k_∞ = k tanh(kh) [rad/m].
///
/// Where surface tension matters (k above 50 rad/m), water of 1 m is already deep, so no extra term is needed.
#[must_use]
pub fn deep_equivalent(wavenumber: f64, depth: f64) -> f64 {
    wavenumber * depth_factor(wavenumber, depth)
}

/// The wavenumber k [rad/m] over depth h \[m\] whose deep-water equivalent k tanh(kh) is given.
///
/// Newton's method on a function that is convex up to kh of about 1.2 and linear beyond; starting above the root, it
/// decreases monotonically.
#[must_use]
pub fn from_deep_equivalent(deep: f64, depth: f64) -> f64 {
    if !deep.is_finite() || !depth.is_finite() || deep <= 0.0 {
        return deep;
    }
    // Both asymptotes, kh large and kh small, lie below the root; their sum lies above it.
    let mut k = deep + (deep / depth).sqrt();
    for _ in 0..60 {
        let tanh = depth_factor(k, depth);
        let step = (k * tanh - deep) / (tanh + k * depth * (1.0 - tanh * tanh));
        k -= step;
        if step.abs() <= 1e-15 * k {
            break;
        }
    }
    k
}

/// Kitaigorodskii's depth factor Φ on a frequency spectrum: `S_h(ω) = Φ S_∞(ω)` \[1\].
///
/// ```text
/// Φ = [k⁻³ ∂k/∂ω]_h / [k⁻³ ∂k/∂ω]_∞ = (k_∞/k)³ · (g/2ω)/c_g,   gravity waves
/// ```
///
/// - `wavenumber` k [rad/m] over `depth` h \[m\]
/// - returns Φ from 0 to 1: 1 in deep water, ½ ω²h/g in very shallow water
///
/// # References
///
/// Kitaigorodskii, Krasitskii and Zaslavskii (1975), J. Phys. Oceanogr. 5, 410.
#[must_use]
pub fn kitaigorodskii_factor(wavenumber: f64, depth: f64) -> f64 {
    let deep = deep_equivalent(wavenumber, depth);
    let omega = angular_frequency(wavenumber, depth);
    (deep / wavenumber).powi(3) * 0.5 * GRAVITY / (omega * group_speed(wavenumber, depth))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deep_equivalents_invert() {
        for depth in [0.5, 3.0, 1000.0, f64::INFINITY] {
            for k in [1e-4, 0.02, 0.7, 30.0, 2e3] {
                let back = from_deep_equivalent(deep_equivalent(k, depth), depth);
                assert!((back / k - 1.0).abs() < 1e-12, "{k} {depth} {back}");
            }
        }
    }

    /// The published limits of Φ: 1 in deep water, ½ ω²h/g in shallow water.
    #[test]
    fn kitaigorodskii_limits() {
        assert!((kitaigorodskii_factor(0.5, 100.0) - 1.0).abs() < 1e-4);
        let (k, h) = (1e-3, 2.0);
        let limit = 0.5 * angular_frequency(k, h).powi(2) * h / GRAVITY;
        assert!((kitaigorodskii_factor(k, h) / limit - 1.0).abs() < 1e-4);
    }

    /// Keeping B(k) at equal frequency equals the factor Φ on S(ω), for any spectrum of long waves.
    #[test]
    fn curvature_at_equal_frequency_is_the_factor() {
        let model = PiersonMoskowitz::new(12.0);
        for (k, h) in [(0.05, 5.0), (0.1, 12.0), (0.3, 2.0)] {
            let deep = deep_equivalent(k, h);
            let mapped = to_frequency(model.curvature(deep) / k.powi(3), k, h);
            let omega = (GRAVITY * deep).sqrt();
            let factored = kitaigorodskii_factor(k, h) * model.frequency_spectrum(omega);
            // Surface tension is in ω and c_g but not in the model: relative (τ/ρ)k²/g < 1e-6.
            assert!((mapped / factored - 1.0).abs() < 2e-6, "{k} {h}");
        }
    }

    #[test]
    fn jacobians_are_inverse() {
        let s = to_frequency(to_wavenumber(3.0, 0.2, 7.0), 0.2, 7.0);
        assert!((s - 3.0).abs() < 1e-14);
    }
}
