//! Even spreading of Elfouhaily et al. (1997).

use super::cos2s::Spread;
use crate::spectrum::Elfouhaily;

/// Even spreading: more waves along the wind than across it, and as many against it as with it.
///
/// ```text
/// D(k, δ) = (1 + Δ(k) cos 2δ)/(2π)
/// ```
///
/// # Validity
///
/// Valid for the instantaneous surface that a radar images. As a spreading of travelling waves it makes half of them run
/// against the wind; use [`Cos2s`](super::Cos2s) instead.
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

    /// D(δ) at a deep-water wavenumber [rad/m].
    pub(super) fn at(&self, wavenumber: f64) -> Spread {
        Spread::Even {
            anisotropy: self.anisotropy(wavenumber),
        }
    }

    /// ∫D cos 2δ dδ = Δ/2.
    #[must_use]
    pub fn second_harmonic(&self, wavenumber: f64) -> f64 {
        0.5 * self.anisotropy(wavenumber)
    }
}
