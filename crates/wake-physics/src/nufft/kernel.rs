//! The kernel that carries a wave of any wavenumber onto the lattice of an FFT.

use crate::quadrature::GaussLegendre;
use std::f64::consts::PI;

/// Widest kernel.
pub(crate) const WIDEST: usize = 16;

/// The kernel "exponential of semicircle" on a lattice that is finer than needed.
///
/// ```text
/// φ(z) = exp(β(√(1 − z²) − 1)),   |z| ≤ 1,   z = 2·distance/width,    β = 0.97 π width (1 − 1/(2σ))
/// ```
///
/// # References
///
/// Barnett, Magland and af Klinteberg (2019), SIAM J. Sci. Comput. 41(5), C479.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kernel {
    /// Lattice points the kernel covers along an axis.
    pub width: usize,
    /// Oversampling σ: lattice points along an axis over pixels.
    pub oversampling: f64,
    /// Largest error along an axis, relative to the sum of all |strength|.
    pub error: f64,
    /// How much larger the factor that undoes the kernel is at the raster's edge than in its middle.
    pub amplification: f64,
    beta: f64,
}

impl Kernel {
    /// The narrowest kernel whose aliases stay below `error`, or the widest there is.
    pub(crate) fn new(error: f64, oversampling: f64) -> Self {
        // One less than the known rule of thumb: the aliases are then computed, not trusted.
        let decay = PI * (1.0 - 1.0 / oversampling).sqrt();
        let guess = ((0.25 / error).ln() / decay)
            .floor()
            .clamp(2.0, WIDEST as f64) as usize;
        let mut kernel = Self::of_width(guess, oversampling);
        while kernel.error > error && kernel.width < WIDEST {
            kernel = Self::of_width(kernel.width + 1, oversampling);
        }
        kernel
    }

    fn of_width(width: usize, oversampling: f64) -> Self {
        let mut kernel = Self {
            width,
            oversampling,
            error: 0.0,
            amplification: 1.0,
            beta: 0.97 * PI * width as f64 * (1.0 - 0.5 / oversampling),
        };
        let rule = GaussLegendre::new(24 + 2 * width);
        let weights = kernel.weights(&rule);
        // Half a raster from the middle. The aliases are largest near there; they pass through zero once in
        // 1/width, so the largest of some points over that distance is their envelope.
        let edge = 0.5 / oversampling;
        let wanted = kernel.transform(&weights, edge);
        let aliases = (0..8).map(|i| {
            let part = edge - f64::from(i) / (8.0 * width as f64);
            let tiles = [part - 1.0, part + 1.0, part - 2.0];
            let sum: f64 = tiles
                .iter()
                .map(|&t| kernel.transform(&weights, t).abs())
                .sum();
            sum / kernel.transform(&weights, part)
        });
        kernel.error = aliases.fold(0.0, f64::max);
        kernel.amplification = kernel.transform(&weights, 0.0) / wanted;
        kernel
    }

    /// φ at a distance in lattice points; 0 beyond half the width.
    pub(crate) fn value(&self, distance: f64) -> f64 {
        let z = 2.0 * distance / self.width as f64;
        let inside = 1.0 - z * z;
        if inside < 0.0 {
            return 0.0;
        }
        (self.beta * (inside.sqrt() - 1.0)).exp()
    }

    /// Nodes z and weights of ∫ φ(z) … dz over [0, 1], times the width.
    fn weights(&self, rule: &GaussLegendre) -> Vec<(f64, f64)> {
        let width = self.width as f64;
        rule.on(0.0, 1.0)
            .map(|(z, w)| (z, width * w * self.value(0.5 * width * z)))
            .collect()
    }

    /// Fourier transform of φ at a pixel, `part` of the lattice's period from the middle.
    ///
    /// ```text
    /// ∫ φ cos(2π part·distance) d(distance) = width ∫₀¹ φ(z) cos(π width part z) dz
    /// ```
    fn transform(&self, weights: &[(f64, f64)], part: f64) -> f64 {
        let turn = PI * self.width as f64 * part;
        weights.iter().map(|(z, w)| w * (turn * z).cos()).sum()
    }

    /// Factors that undo the kernel, one per pixel of a side of `pixels` on a lattice of `lattice` points.
    pub(crate) fn correction(&self, pixels: usize, lattice: usize) -> Vec<f64> {
        let weights = self.weights(&GaussLegendre::new(16 + 2 * self.width));
        let half = pixels / 2;
        let side: Vec<f64> = (0..=half)
            .map(|p| self.transform(&weights, p as f64 / lattice as f64).recip())
            .collect();
        (0..pixels).map(|i| side[i.abs_diff(half)]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sum over the lattice of the spread wave, corrected, is the wave to the error the kernel states.
    #[test]
    fn spread_wave_comes_back() {
        for (error, pixels, lattice) in [
            (1e-3, 40, 60),
            (1e-6, 41, 64),
            (1e-9, 30, 60),
            (1e-4, 48, 60),
        ] {
            let kernel = Kernel::new(error, lattice as f64 / pixels as f64);
            assert!(kernel.error <= error && kernel.width <= WIDEST);
            let correction = kernel.correction(pixels, lattice);
            let mut worst = 0.0f64;
            for g in [0.0, 0.37, 5.5, -11.81] {
                for i in 0..pixels {
                    let p = i as f64 - (pixels / 2) as f64;
                    let wave = |x: f64| (std::f64::consts::TAU * p * x / lattice as f64).cos();
                    let sum: f64 = (-40..40)
                        .map(|l| {
                            let l = f64::from(l);
                            kernel.value(l - g) * wave(l - g)
                        })
                        .sum();
                    worst = worst.max((sum * correction[i] - 1.0).abs());
                }
            }
            // Never above the stated error, and the statement says something: within a factor 30 of it.
            assert!(worst <= 1.01 * kernel.error + 1e-14, "{worst:e} {kernel:?}");
            assert!(worst >= kernel.error / 30.0, "{worst:e} {kernel:?}");
        }
    }
}
