//! The even spreading of Elfouhaily et al. (1997).

use crate::spectrum::Elfouhaily;
use std::f64::consts::PI;

/// Waves along the wind more than across it, as many against it as with it.
///
/// ```text
/// D(k, δ) = (1 + Δ(k) cos 2δ)/(2π)
/// ```
///
/// # Validity
///
/// Right for what a radar sees at one instant. As a spread of travelling waves it lets half of them run
/// against the wind; prefer [`Cos2s`](super::Cos2s) there.
///
/// # References
///
/// Elfouhaily, Chapron, Katsaros and Vandemark (1997), J. Geophys. Res. 102(C7), 15781, Eqs. 49 and 57.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EvenSpreading {
    sea: Elfouhaily,
}

impl EvenSpreading {
    /// The spreading of a sea.
    #[must_use]
    pub fn new(sea: Elfouhaily) -> Self {
        Self { sea }
    }

    /// Δ(k) \[1\] at k [rad/m].
    #[must_use]
    pub fn anisotropy(&self, wavenumber: f64) -> f64 {
        self.sea.anisotropy(wavenumber)
    }

    /// D(k, δ) [1/rad] from k [rad/m] and cos δ.
    #[must_use]
    pub fn density(&self, wavenumber: f64, cos_angle: f64) -> f64 {
        let cos_twice = 2.0 * cos_angle * cos_angle - 1.0;
        (1.0 + self.anisotropy(wavenumber) * cos_twice) / (2.0 * PI)
    }

    /// ∫D cos 2δ dδ = Δ/2.
    #[must_use]
    pub fn second_harmonic(&self, wavenumber: f64) -> f64 {
        0.5 * self.anisotropy(wavenumber)
    }
}
