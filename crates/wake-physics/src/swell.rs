//! Swell: old waves of one length and direction, on top of the wind sea.
//!
//! ```text
//! Ψ(k, φ) = H²/16 · N(k; k_p, 0.1 k_p)/k · N(φ; φ_p, 12°),     ∬Ψ dkx dky = (H/4)²
//! ```
//!
//! with N the Gaussian density. The widths are chosen; a swell's are narrower the farther it has come.

use std::f64::consts::{PI, TAU};

/// Width of the peak in wavenumber over its wavenumber: chosen.
const RELATIVE_WIDTH: f64 = 0.1;

/// Width in direction \[rad\], 12°: chosen.
const SPREAD: f64 = 12.0 * PI / 180.0;

/// Standard deviations at which the peak is cut off.
const CUT: f64 = 5.0;

/// A swell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Swell {
    /// Significant height H \[m\].
    pub height: f64,
    /// Wavelength of the peak \[m\].
    pub wavelength: f64,
    /// Where it goes to \[rad\], clockwise from azimuth.
    pub toward: f64,
}

impl Swell {
    /// Variance spectrum Ψ \[m⁴\] at a wavenumber [rad/m]; 0 farther than five widths from the peak.
    #[must_use]
    pub fn density(&self, [kx, ky]: [f64; 2]) -> f64 {
        let k = kx.hypot(ky);
        let peak = TAU / self.wavelength;
        let width = RELATIVE_WIDTH * peak;
        let z = (k - peak) / width;
        // The direction clockwise from azimuth, and its distance from that of the swell the short way round.
        let turn = (kx.atan2(ky) - self.toward + PI).rem_euclid(TAU) - PI;
        let t = turn / SPREAD;
        if z.abs() > CUT || t.abs() > CUT {
            return 0.0;
        }
        let bell = (-0.5 * (z * z + t * t)).exp() / (TAU * width * SPREAD * k);
        self.height * self.height / 16.0 * bell
    }

    /// Least and largest wavenumber with any density [rad/m].
    #[must_use]
    pub fn band(&self) -> [f64; 2] {
        let peak = TAU / self.wavelength;
        [-1.0, 1.0].map(|side| peak * (1.0 + side * CUT * RELATIVE_WIDTH))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quadrature::GaussLegendre;

    /// ∬Ψ = H²/16 and the mean direction, in polar coordinates, around a swell across the cut of atan2 too.
    #[test]
    fn variance_and_direction() {
        for toward in [0.0, 1.0, PI, -2.5, 7.0] {
            let swell = Swell {
                height: 1.5,
                wavelength: 180.0,
                toward,
            };
            let rule = GaussLegendre::new(64);
            let (mut sum, mut sin, mut cos, mut mean) = (0.0, 0.0, 0.0, 0.0);
            for (k, wk) in rule.on(swell.band()[0], swell.band()[1]) {
                for (turn, wt) in rule.on(-CUT * SPREAD, CUT * SPREAD) {
                    let a = toward + turn;
                    let share = k * wk * wt * swell.density([k * a.sin(), k * a.cos()]);
                    sum += share;
                    mean += k * share;
                    sin += a.sin() * share;
                    cos += a.cos() * share;
                }
            }
            // Five standard deviations leave 6e-7 of each Gaussian outside.
            assert!((sum * 16.0 / 2.25 - 1.0).abs() < 2e-6, "{sum}");
            assert!((mean / sum * 180.0 / TAU - 1.0).abs() < 1e-6);
            let off = (sin.atan2(cos) - toward + PI).rem_euclid(TAU) - PI;
            assert!(off.abs() < 1e-9);
        }
    }

    #[test]
    fn nothing_goes_backwards() {
        let swell = Swell {
            height: 1.0,
            wavelength: 200.0,
            toward: 0.3,
        };
        let k = TAU / 200.0;
        let at = |a: f64| swell.density([k * a.sin(), k * a.cos()]);
        assert!(at(0.3) > 0.0 && at(0.3 + PI).abs() < f64::MIN_POSITIVE);
        assert!(swell.density([0.0, 0.0]).abs() < f64::MIN_POSITIVE);
        assert!(at(0.3) > at(0.5) && at(0.5) > at(0.7));
    }
}
