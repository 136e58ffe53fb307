//! Kernel that spreads a wave of any wavenumber onto the lattice of an FFT.

use std::f64::consts::PI;

/// Width of the widest kernel, in lattice points.
pub(crate) const WIDEST: usize = 16;

/// Kaiser–Bessel kernel on an oversampled lattice.
///
/// ```text
/// φ(z) = I₀(β√(1 − z²)) e^{−β},   |z| ≤ 1,   z = 2·distance/width
/// β = π √(width² (1 − 1/(2σ))² − 0.8)
/// ```
///
/// # References
///
/// Beatty, Nishimura and Pauly (2005), IEEE Trans. Med. Imaging 24(6), 799, Eq. 5 (for β); Fessler and Sutton
/// (2003), IEEE Trans. Signal Process. 51(2), 560 (for the transform).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Kernel {
    /// Lattice points that the kernel covers along an axis.
    pub(crate) width: usize,
    /// Oversampling σ: lattice points per pixel along an axis.
    pub(crate) oversampling: f64,
    /// Bound on the error along an axis, relative to the sum of all |strength|.
    pub(crate) error: f64,
    /// Ratio of the correction factor at the raster's edge to that in its middle.
    pub(crate) amplification: f64,
    beta: f64,
}

impl Kernel {
    /// The narrowest kernel whose aliases stay below `error`, or the widest available.
    pub(crate) fn new(error: f64, oversampling: f64) -> Self {
        (2..WIDEST)
            .map(|width| Self::of_width(width, oversampling))
            .find(|kernel| kernel.error <= error)
            .unwrap_or_else(|| Self::of_width(WIDEST, oversampling))
    }

    fn of_width(width: usize, oversampling: f64) -> Self {
        let span = width as f64 * (1.0 - 0.5 / oversampling);
        let mut kernel = Self {
            width,
            oversampling,
            error: 0.0,
            amplification: 1.0,
            beta: PI * (span * span - 0.8).max(0.01).sqrt(),
        };
        // Aliases are largest at the edge, half a raster from the middle.
        let edge = 0.5 / oversampling;
        let wanted = kernel.transform(edge);
        let tiles = [1.0 - edge, 1.0 + edge, 2.0 - edge, 2.0 + edge];
        let aliases: f64 = tiles.iter().map(|&part| kernel.envelope(part)).sum();
        kernel.error = aliases / wanted;
        kernel.amplification = kernel.transform(0.0) / wanted;
        kernel
    }

    /// Fourier transform of φ at a pixel inside the raster, at the fraction `part` of the lattice's period from the middle.
    ///
    /// ```text
    /// ∫ φ cos(2π part·distance) d(distance) = width sinh(r)/r · e^{−β},   r² = β² − (π width part)²
    /// ```
    fn transform(&self, part: f64) -> f64 {
        let turn = PI * self.width as f64 * part;
        let r = (self.beta * self.beta - turn * turn).max(1e-12).sqrt();
        let sinh = 0.5 * ((r - self.beta).exp() - (-r - self.beta).exp());
        self.width as f64 * sinh / r
    }

    /// Bound on the magnitude of the transform in other tiles, where it oscillates: width·|sin r|/|r|·e^{−β}.
    fn envelope(&self, part: f64) -> f64 {
        let turn = PI * self.width as f64 * part;
        let r = (turn * turn - self.beta * self.beta).max(1.0).sqrt();
        self.width as f64 / r * (-self.beta).exp()
    }

    /// φ at `out.len()` ≤ [`WIDEST`] consecutive lattice points, the first at `distance`.
    ///
    /// All terms of the power series of I₀ are positive; term k is (β²(1 − z²)/4)^k/(k!)².
    #[inline(always)]
    pub(crate) fn values(&self, distance: f64, out: &mut [f64]) {
        match out.len() {
            ..=4 => self.side_by_side::<4>(distance, out),
            5..=8 => self.side_by_side::<8>(distance, out),
            9..=12 => self.side_by_side::<12>(distance, out),
            _ => self.side_by_side::<WIDEST>(distance, out),
        }
    }

    /// [`Self::values`] of at most `N` points, computed in vector lanes.
    #[inline(always)]
    fn side_by_side<const N: usize>(&self, distance: f64, out: &mut [f64]) {
        let mut powers = [0.0; N];
        let mut terms = [(-self.beta).exp(); N];
        let mut sums = terms;
        for (i, power) in powers.iter_mut().enumerate().take(out.len()) {
            let z = 2.0 * (distance + i as f64) / self.width as f64;
            *power = 0.25 * self.beta * self.beta * (1.0 - z * z).max(0.0);
        }
        let count = (1.4 * self.beta) as usize + 12;
        for k in 1..count {
            let square = 1.0 / (k * k) as f64;
            for i in 0..N {
                terms[i] *= powers[i] * square;
                sums[i] += terms[i];
            }
        }
        out.copy_from_slice(&sums[..out.len()]);
    }

    /// Correction factors that undo the kernel, one per pixel along a side of `pixels` on a lattice of `lattice` points.
    pub(crate) fn correction(&self, pixels: usize, lattice: usize) -> Vec<f64> {
        let half = pixels / 2;
        let factor = |i: usize| {
            self.transform(i.abs_diff(half) as f64 / lattice as f64)
                .recip()
        };
        (0..pixels).map(factor).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::GaussLegendre;

    /// The corrected lattice sum of a spread wave equals the wave within the kernel's stated error.
    #[test]
    fn spread_wave_comes_back() {
        for (error, pixels, lattice) in [
            (1e-1, 40, 60),
            (1e-3, 40, 60),
            (1e-6, 41, 64),
            (1e-9, 30, 60),
            (1e-4, 48, 60),
            (1e-7, 40, 50),
        ] {
            let kernel = Kernel::new(error, lattice as f64 / pixels as f64);
            assert!(kernel.error <= error && kernel.width < WIDEST);
            let correction = kernel.correction(pixels, lattice);
            let mut worst = 0.0f64;
            for g in [0.0, 0.37, 0.5, 0.81] {
                let first = (g - 0.5 * kernel.width as f64).ceil();
                let mut values = vec![0.0; kernel.width];
                kernel.values(first - g, &mut values);
                for (i, factor) in correction.iter().enumerate() {
                    let p = i as f64 - (pixels / 2) as f64;
                    let turn = std::f64::consts::TAU * p / lattice as f64;
                    let wave = |l: usize| turn * (first - g + l as f64);
                    let re: f64 = values
                        .iter()
                        .enumerate()
                        .map(|(l, v)| v * wave(l).cos())
                        .sum();
                    let im: f64 = values
                        .iter()
                        .enumerate()
                        .map(|(l, v)| v * wave(l).sin())
                        .sum();
                    worst = worst.max((re * factor - 1.0).hypot(im * factor));
                }
            }
            // The error never exceeds the stated one, which is tight: within a factor of 10.
            assert!(worst <= kernel.error, "{worst:e} {kernel:?}");
            assert!(worst >= 0.1 * kernel.error, "{worst:e} {kernel:?}");
        }
    }

    /// Closed form of the transform against Gauss quadrature of the series.
    #[test]
    fn transform_is_the_integral() {
        let kernel = Kernel::of_width(9, 1.5);
        let rule = GaussLegendre::new(60);
        for part in [0.0, 0.1, 0.3] {
            let value = |x: f64| {
                let mut v = [0.0];
                kernel.values(x, &mut v);
                2.0 * v[0] * (std::f64::consts::TAU * part * x).cos()
            };
            let integral = rule.integrate([0.0, 4.5], value);
            assert!((integral / kernel.transform(part) - 1.0).abs() < 1e-12);
        }
    }
}
