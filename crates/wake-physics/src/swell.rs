//! Swell: old waves of one length and direction, added to the wind sea.
//!
//! ```text
//! Ψ(k, φ) = H²/16 · N(k; k_p, 0.1 k_p)/k · N(φ; φ_p, 12°),     ∬Ψ dkx dky = (H/4)²
//! ```
//!
//! with N the Gaussian density. The widths are chosen; a real swell is narrower the farther it has travelled.

use crate::dispersion::angular_frequency;
use crate::random::{Stream, generator};
use crate::waves::PlaneWaves;
use num_complex::Complex64;
use rand_distr::{Distribution, StandardNormal, StandardUniform};
use std::f64::consts::{PI, TAU};

/// Spectral width in wavenumber, relative to the peak wavenumber: chosen.
const RELATIVE_WIDTH: f64 = 0.1;

/// Spectral width in direction \[rad\], 12°: chosen.
const SPREAD: f64 = 12.0 * PI / 180.0;

/// Standard deviations at which the peak is cut off.
const CUT: f64 = 5.0;

/// Number of waves along wavenumber and along direction.
const WAVES: usize = 32;

/// A swell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Swell {
    /// Significant height H \[m\].
    pub height: f64,
    /// Wavelength of the peak \[m\].
    pub wavelength: f64,
    /// Direction of travel \[rad\], clockwise from azimuth.
    pub toward: f64,
}

impl Swell {
    /// Variance spectrum Ψ \[m⁴\] at a wavenumber [rad/m]; 0 beyond five widths from the peak.
    #[must_use]
    pub fn density(&self, [kx, ky]: [f64; 2]) -> f64 {
        let k = kx.hypot(ky);
        let peak = TAU / self.wavelength;
        let width = RELATIVE_WIDTH * peak;
        let z = (k - peak) / width;
        // The direction clockwise from azimuth, and its shortest angular distance from the swell's.
        let turn = (kx.atan2(ky) - self.toward + PI).rem_euclid(TAU) - PI;
        let t = turn / SPREAD;
        if z.abs() > CUT || t.abs() > CUT {
            return 0.0;
        }
        let bell = (-0.5 * (z * z + t * t)).exp() / (TAU * width * SPREAD * k);
        self.variance() * bell
    }

    /// Variance of the elevation (H/4)² \[m²\].
    pub(crate) fn variance(&self) -> f64 {
        self.height * self.height / 16.0
    }

    /// Waves that represent the swell, with their variance \[m²\]: one per cell of wavenumber and direction, at a position
    /// in the cell given by `jitter` in 0…1; none beyond `band` [rad/m], the largest wavenumber of the pixels.
    pub(crate) fn cells(&self, band: f64, mut jitter: impl FnMut() -> f64) -> Vec<([f64; 2], f64)> {
        let [low, high] = self.band();
        let step = [
            (high - low) / WAVES as f64,
            2.0 * CUT * SPREAD / WAVES as f64,
        ];
        let mut cells = Vec::with_capacity(WAVES * WAVES);
        for n in 0..WAVES {
            for m in 0..WAVES {
                let k = low + (n as f64 + jitter()) * step[0];
                let turn = self.toward + (m as f64 + jitter()) * step[1] - CUT * SPREAD;
                let wave = [k * turn.sin(), k * turn.cos()];
                let variance = self.density(wave) * k * step[0] * step[1];
                if k <= band && variance > 0.0 {
                    cells.push((wave, variance));
                }
            }
        }
        cells
    }

    /// Draws one realisation as plane waves.
    ///
    /// - `depth` \[m\] of the water, `time` \[s\], `band` [rad/m]: largest wavenumber of the pixels
    /// - `seed`: the same seed gives the same waves
    #[must_use]
    pub fn waves(&self, seed: u64, time: f64, depth: f64, band: f64) -> PlaneWaves {
        let mut random = generator(seed, Stream::Swell, 0);
        let cells = self.cells(band, || StandardUniform.sample(&mut random));
        let mut waves = PlaneWaves::default();
        for ([kx, ky], variance) in cells {
            let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
            let omega = angular_frequency(kx.hypot(ky), depth);
            // ⟨|a|²⟩ = 2 ⟨ζ²⟩.
            let amplitude = Complex64::new(normal(), normal()) * variance.sqrt();
            waves.kx.push(kx);
            waves.ky.push(ky);
            waves.omega.push(omega);
            waves
                .amplitude
                .push(amplitude * Complex64::from_polar(1.0, -omega * time));
        }
        waves
    }

    /// Smallest and largest wavenumber of non-zero density [rad/m].
    #[must_use]
    pub fn band(&self) -> [f64; 2] {
        let peak = TAU / self.wavelength;
        [-1.0, 1.0].map(|side| peak * (1.0 + side * CUT * RELATIVE_WIDTH))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::GaussLegendre;

    /// ∬Ψ = H²/16 and the mean direction, in polar coordinates, including a swell across the branch cut of atan2.
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

    /// Over many seeds the waves have the variance H²/16; half a band has half of it.
    #[test]
    fn waves_have_the_variance() {
        let swell = Swell {
            height: 2.0,
            wavelength: 150.0,
            toward: -1.0,
        };
        let peak = TAU / 150.0;
        for (band, share) in [(1.0, 1.0), (peak, 0.5)] {
            let variance = |seed| -> f64 {
                let waves = swell.waves(seed, 3.0, f64::INFINITY, band);
                waves.amplitude.iter().map(|a| 0.5 * a.norm_sqr()).sum()
            };
            let count = 200;
            let mean = (0..count).map(variance).sum::<f64>() / f64::from(count as u32);
            // About 60 of the waves carry most of the variance: 1/√60 per seed, 1 % of the mean of 200; four times that.
            assert!((mean / (share * 0.25) - 1.0).abs() < 0.04, "{mean}");
        }
        let [one, other] = [0.0, 7.0].map(|time| swell.waves(1, time, 20.0, 1.0));
        for n in 0..one.len() {
            let turned = one.amplitude[n] * Complex64::from_polar(1.0, -7.0 * one.omega[n]);
            assert!((turned - other.amplitude[n]).norm() < 1e-12);
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
