//! Modulation transfer functions: modulation of the image by each wave, to first order in its height.
//!
//! The plan weighs terms by these functions, and they give the image spectrum of open sea; they never enter a scene's
//! image.

use crate::waves::{Quantity, Transfer};
use num_complex::Complex64;
use std::f64::consts::PI;

/// Modulation transfer function of a radar and a sea, linearised about the calm surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModulationTransfer {
    /// Transfer from amplitudes to orbital motion and modulation.
    pub transfer: Transfer,
    /// ∂ln σ⁰/∂slope along x and y.
    pub tilt: [f64; 2],
    /// Share of the Bragg return in σ⁰, 0 to 1.
    pub bragg_share: f64,
    /// R/V \[s\].
    pub range_to_velocity: f64,
}

/// Relative modulation of the intensity by a wave of unit height, effect by effect [1/m].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Modulation {
    /// Modulation by slopes, which tilt facets toward the radar.
    pub tilt: Complex64,
    /// Modulation of the Bragg waves by currents.
    pub hydrodynamic: Complex64,
    /// Compression by layover where the surface rises away from the radar.
    pub range_bunching: Complex64,
    /// Concentration and dilution of echoes in azimuth by velocities.
    pub bunching: Complex64,
}

impl Modulation {
    /// All effects together.
    #[must_use]
    pub fn total(&self) -> Complex64 {
        self.tilt + self.hydrodynamic + self.range_bunching + self.bunching
    }
}

impl ModulationTransfer {
    /// Linear modulation transfer functions of the four effects.
    ///
    /// ```text
    /// tilt i(kx ∂lnσ/∂sx + ky ∂lnσ/∂sy)   range i kx cot θ   bunching −i ky (R/V) T_v
    /// ```
    ///
    /// # References
    ///
    /// Alpers, Ross and Rufenach (1981), J. Geophys. Res. 86(C7), 6481.
    #[must_use]
    pub fn at(&self, k: [f64; 2], omega: f64) -> Modulation {
        let i = Complex64::i();
        let hydrodynamic = self.transfer.factor(Quantity::Hydrodynamic, k, omega);
        let radial = self.transfer.radial(k, omega);
        Modulation {
            tilt: i * (k[0] * self.tilt[0] + k[1] * self.tilt[1]),
            hydrodynamic: self.bragg_share * hydrodynamic,
            range_bunching: i * k[0] / self.transfer.incidence.tan(),
            bunching: -i * k[1] * self.range_to_velocity * radial,
        }
    }
}

/// Factor on a wave's amplitude by a Gaussian exp(−(πy/ρ)²) of azimuth resolution ρ: exp(−(kyρ/2π)²).
#[must_use]
pub fn smear(ky: f64, resolution: f64) -> f64 {
    (-(ky * resolution / (2.0 * PI)).powi(2)).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn transfer() -> ModulationTransfer {
        ModulationTransfer {
            transfer: Transfer {
                depth: f64::INFINITY,
                incidence: 0.6,
                relaxation_rate: 1.0,
                action_slope: 4.5,
            },
            tilt: [5.0, 0.0],
            bragg_share: 1.0,
            range_to_velocity: 50.0,
        }
    }

    /// The smear of a wave equals the Fourier integral of the normalised kernel.
    #[test]
    fn smear_is_the_transform_of_the_kernel() {
        let (ky, rho) = (0.12, 30.0);
        let kernel = |y: f64| (-(PI * y / rho).powi(2)).exp();
        let (mut sum, mut norm) = (0.0, 0.0);
        for n in -2000..=2000 {
            let y = 0.05 * f64::from(n);
            sum += kernel(y) * (ky * y).cos();
            norm += kernel(y);
        }
        assert!((sum / norm - smear(ky, rho)).abs() < 1e-9);
    }

    /// Waves along range are not bunched; waves along azimuth have neither tilt modulation (for an even σ⁰) nor layover.
    #[test]
    fn each_effect_has_its_direction() {
        let m = transfer().at([0.2, 0.0], 1.4);
        assert_eq!(m.bunching, Complex64::ZERO);
        let m = transfer().at([0.0, 0.2], 1.4);
        assert_eq!(m.tilt + m.range_bunching + m.hydrodynamic, Complex64::ZERO);
        // |T_v| = ω cos θ for a wave along azimuth: modulation (R/V) k ω cos θ.
        assert!((m.bunching.norm() - 50.0 * 0.2 * 1.4 * 0.6f64.cos()).abs() < 1e-12);
    }

    /// Range bunching against the compression of a sampled, shifted surface.
    #[test]
    fn range_bunching_is_a_compression() {
        let (k, a, cot): (f64, f64, f64) = (0.2, 1e-4, 1.0 / 0.6f64.tan());
        let shifted = |x: f64| x - a * (k * x).sin() * cot;
        let x = 3.0;
        let density = 2e-3 / (shifted(x + 1e-3) - shifted(x - 1e-3));
        let m = transfer().at([k, 0.0], 1.4).range_bunching;
        // ζ = a sin kx = Re(−i a e^{ikx})
        let linear = 1.0 + (m * Complex64::new(0.0, -a) * Complex64::cis(k * x)).re;
        assert!((density - linear).abs() < 1e-8);
    }
}
