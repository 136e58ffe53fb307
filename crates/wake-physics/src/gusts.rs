//! Gusts: a Gaussian field of wind speed over the scene, and its effect on σ⁰.
//!
//! ```text
//! g = ln(U₁₀/⟨U₁₀⟩),   Φ(κ) = s² κ₀^{2/3}/(3π) · a (κ_x'² a² + κ_y'² + κ₀²)^{−4/3},   ∬Φ = s²
//! σ⁰ → σ⁰ exp(n g − ½ n² s²)
//! ```
//!
//! with κ₀ = 2π/L₀ and gusts a times as long along the wind (x') as across. One-dimensional spectra fall off as κ^{−5/3}
//! (Kolmogorov). Scale, elongation and strength are chosen. The factor multiplies the whole σ⁰; the waves do not change.
//!
//! Eddies of the surface layer mottle the sea in patches of tens of metres. They are a second field of the same kind,
//! isotropic, with one-dimensional spectra that fall off as κ^{−2} and the correlation e^{−κ₀r}:
//!
//! ```text
//! Φ(κ) = s² κ₀/(2π) · (κ² + κ₀²)^{−3/2}
//! ```
//!
//! The wind 10 m above the sea varies most at wavelengths of 10 m/0.045 = 220 m, with a standard deviation of 2.5 u*, that
//! is 0.08 to 0.1 of the mean (Kaimal et al. 1972, Q. J. R. Meteorol. Soc. 98; Panofsky and Dutton 1984, quoted from
//! memory, not verified). The slope of −2 instead of −5/3 was measured in images of the sea and is chosen.

use crate::fft::{fast_length, lattice_sum, signed_index};
use crate::random::{Stream, generator};
use crate::raster::{Field, Raster};
use num_complex::Complex32;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// Ratio of the length of gusts along the wind to that across: chosen from 1 to 2.
const ELONGATION: f64 = 1.5;

/// Ratio of the length of surface-layer eddies along the wind to that across: chosen.
const MOTTLE_ELONGATION: f64 = 1.0;

/// Period of the field relative to the raster: large enough that opposite edges are uncorrelated.
const PERIOD: f64 = 1.25;

/// Exponent n of σ⁰ ∝ `U₁₀`ⁿ.
///
/// - `frequency` \[Hz\]
/// - returns 0.8 below 2 GHz (chosen: the short-wave spectrum of Elfouhaily et al. (1997) has the wrong sign there), 1.5
///   up to 8 GHz (CMOD5.N has 1.4 to 1.8 at 35° between 3 and 10 m/s), 1.6 above
#[must_use]
pub fn wind_exponent(frequency: f64) -> f64 {
    match frequency {
        f if f < 2e9 => 0.8,
        f if f < 8e9 => 1.5,
        _ => 1.6,
    }
}

/// Kind of wind field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum GustKind {
    /// Gusts of the boundary layer.
    Gusts,
    /// Eddies of the surface layer.
    Mottle,
}

impl GustKind {
    /// Exponent p of the two-dimensional spectrum (κ² + κ₀²)^{−p}.
    fn power(self) -> f64 {
        match self {
            Self::Gusts => 4.0 / 3.0,
            Self::Mottle => 1.5,
        }
    }

    fn elongation(self) -> f64 {
        match self {
            Self::Gusts => ELONGATION,
            Self::Mottle => MOTTLE_ELONGATION,
        }
    }

    fn stream(self) -> Stream {
        match self {
            Self::Gusts => Stream::Gusts,
            Self::Mottle => Stream::Mottle,
        }
    }

    /// Grid points per outer scale. A finer grid would resolve another twentieth of the variance of gusts and a fiftieth of
    /// that of eddies.
    fn places(self) -> f64 {
        match self {
            Self::Gusts => 200.0,
            Self::Mottle => 100.0,
        }
    }
}

/// Wind field of a scene: gusts or eddies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gusts {
    /// Gusts or eddies.
    pub kind: GustKind,
    /// Standard deviation s of ln `U₁₀` \[1\].
    pub strength: f64,
    /// Outer scale `L₀` \[m\].
    pub scale: f64,
    /// Wind direction (toward) \[rad\], clockwise from azimuth.
    pub wind_toward: f64,
}

impl Gusts {
    /// Spectral density Φ of g \[m²\] at a wavenumber [rad/m].
    #[must_use]
    pub fn density(&self, [kx, ky]: [f64; 2]) -> f64 {
        let (sin, cos) = self.wind_toward.sin_cos();
        let (along, across) = (kx * sin + ky * cos, kx * cos - ky * sin);
        let (power, elongation) = (self.kind.power(), self.kind.elongation());
        let outer = TAU / self.scale;
        let norm =
            self.strength * self.strength * outer.powf(2.0 * (power - 1.0)) * (power - 1.0) / PI;
        let square = (elongation * along).powi(2) + across * across + outer * outer;
        norm * elongation * square.powf(-power)
    }

    /// g at every pixel \[1\]. Gusts shorter than a pixel are left out; gusts longer than the scene shift it as a whole.
    ///
    /// - `seed`: gives the same field for any number of threads
    #[must_use]
    pub fn field(&self, raster: &Raster, seed: u64) -> Field {
        let [rows, columns] =
            [raster.rows, raster.columns].map(|n| fast_length((PERIOD * n as f64).ceil() as usize));
        let step = [rows, columns].map(|n| TAU / (n as f64 * raster.spacing));
        let cell = step[0] * step[1];
        let mut spectrum = vec![Complex32::ZERO; rows * columns];
        spectrum
            .par_chunks_mut(rows)
            .enumerate()
            .for_each(|(b, line)| {
                let mut random = generator(seed, self.kind.stream(), b as u64);
                let kx = signed_index(b, columns) as f64 * step[1];
                for (a, value) in line.iter_mut().enumerate() {
                    let ky = signed_index(a, rows) as f64 * step[0];
                    // The cell at wavenumber 0 holds all gusts longer than the scene.
                    let variance = if a == 0 && b == 0 {
                        self.in_cell(step)
                    } else {
                        self.density([kx, ky]) * cell
                    };
                    let mut normal = || -> f32 { StandardNormal.sample(&mut random) };
                    let (re, im) = (normal(), normal());
                    // The real part of the sum then has this variance.
                    *value = Complex32::new(re, im) * variance.sqrt() as f32;
                }
            });
        let size = [raster.rows, raster.columns];
        let [values, _] = lattice_sum(&mut spectrum, [rows, columns], size);
        Field {
            rows: raster.rows,
            columns: raster.columns,
            values,
        }
    }

    /// g at every few pixels of a raster, and the step: 1/200 of the outer scale for gusts, 1/100 for eddies.
    pub(crate) fn coarse_field(&self, raster: &Raster, seed: u64) -> (Field, usize) {
        let step = self.step(raster.spacing);
        let [rows, columns] = raster.every(step);
        let coarse = Raster::image(rows, columns, step as f64 * raster.spacing);
        (self.field(&coarse, seed), step)
    }

    /// Step in pixels between the points at which g is drawn.
    pub(crate) fn step(&self, spacing: f64) -> usize {
        ((self.scale / (self.kind.places() * spacing)) as usize).max(1)
    }

    /// Multiplies σ⁰ by exp(n g − ½n²s²), with g interpolated linearly; the strip begins with row `first`.
    ///
    /// - `exponent` n, see [`wind_exponent`]
    pub(crate) fn modulate_strip(
        &self,
        sigma0: &mut Field,
        first: usize,
        (gusts, step): &(Field, usize),
        exponent: f64,
    ) {
        let bias = (0.5 * (exponent * self.strength).powi(2)) as f32;
        let exponent = exponent as f32;
        sigma0.change_with(gusts, *step, first, |value, g| {
            *value *= (exponent * g - bias).exp();
        });
    }

    /// ∬Φ over the cell around wavenumber 0.
    fn in_cell(&self, step: [f64; 2]) -> f64 {
        let rule = crate::numeric::GaussLegendre::new(24);
        let [down, right] = step.map(|s| 0.5 * s);
        rule.integrate([-right, right], |kx| {
            rule.integrate([-down, down], |ky| self.density([kx, ky]))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gusts() -> Gusts {
        Gusts {
            kind: GustKind::Gusts,
            strength: 0.06,
            scale: 2000.0,
            wind_toward: 0.6,
        }
    }

    /// ∬Φ = s², by quadrature in polar coordinates, with the tail in closed form.
    #[test]
    fn the_density_integrates_to_the_variance() {
        let gusts = gusts();
        let rule = crate::numeric::GaussLegendre::new(40);
        let mut sum = 0.0;
        for ring in 0..40 {
            let k = |n: i32| 1e-5 * 1.5f64.powi(n);
            let ends = [if ring == 0 { 0.0 } else { k(ring) }, k(ring + 1)];
            sum += rule.integrate(ends, |k| {
                let steps = 200;
                let mean: f64 = (0..steps)
                    .map(|n| TAU * f64::from(n) / f64::from(steps))
                    .map(|a| gusts.density([k * a.sin(), k * a.cos()]))
                    .sum::<f64>()
                    / f64::from(steps);
                TAU * k * mean
            });
        }
        // Beyond k, the share (κ₀/k)^{2/3} is left, times the mean of the stretch: below 1e-3 at 160 rad/m.
        assert!((sum / 0.0036 - 1.0).abs() < 2e-3, "{}", sum / 0.0036);
    }

    /// The variance over many seeds equals that of the grid; correlation lengths follow the wind.
    #[test]
    fn fields_have_the_variance_and_the_direction() {
        let gusts = Gusts {
            wind_toward: 0.0,
            ..gusts()
        };
        let raster = Raster::image(120, 120, 50.0);
        let count = 60;
        let (mut variance, mut along, mut across) = (0.0, 0.0, 0.0);
        for seed in 0..count {
            let field = gusts.field(&raster, seed);
            for i in 0..100 {
                for j in 0..100 {
                    let v = f64::from(field.at(i, j));
                    variance += v * v / 1e4;
                    along += (v - f64::from(field.at(i + 8, j))).powi(2) / 1e4;
                    across += (v - f64::from(field.at(i, j + 8))).powi(2) / 1e4;
                }
            }
        }
        let n = f64::from(count as u32);
        // Variance on the lattice: the sum of the density.
        let period = fast_length(150);
        let step = TAU / (period as f64 * 50.0);
        let mut held = gusts.in_cell([step, step]);
        for a in 0..period {
            for b in 0..period {
                if a + b > 0 {
                    let k = [b, a].map(|n| signed_index(n, period) as f64 * step);
                    held += gusts.density(k) * step * step;
                }
            }
        }
        assert!(held < 0.0036 && held > 0.0031, "{held}");
        // Gusts of 2 km in 6 km: some ten independent values per field, six hundred in all; four standard errors of
        // √(2/600).
        assert!(
            (variance / n / held - 1.0).abs() < 0.23,
            "{}",
            variance / n / held
        );
        // Structure functions D ∝ r^{2/3}: along the wind, r/a counts.
        let ratio = along / across;
        let expected = ELONGATION.powf(-2.0 / 3.0);
        assert!((ratio / expected - 1.0).abs() < 0.12, "{ratio} {expected}");
    }

    /// On grid points the factor is that of the field, between them that of the mean of the neighbours; for normal g its
    /// mean is 1.
    #[test]
    fn gusts_leave_the_mean_and_have_the_exponent() {
        let gusts = gusts();
        // A spacing of 2.5 m draws g at every fourth pixel.
        let raster = Raster::image(41, 30, 2.5);
        let mut sigma0 = Field::constant(&raster, 0.02);
        let coarse = gusts.coarse_field(&raster, 1);
        gusts.modulate_strip(&mut sigma0, 0, &coarse, 1.5);
        let coarse = Raster::image(12, 9, 10.0);
        let field = gusts.field(&coarse, 1);
        let factor = |g: f64| 0.02 * (1.5 * g - 0.5 * (1.5f64 * 0.06).powi(2)).exp();
        for i in 0..10 {
            for j in 0..7 {
                let g = f64::from(field.at(i, j));
                assert!((f64::from(sigma0.at(4 * i, 4 * j)) / factor(g) - 1.0).abs() < 1e-6);
                let half = 0.5 * (g + f64::from(field.at(i + 1, j)));
                assert!((f64::from(sigma0.at(4 * i + 2, 4 * j)) / factor(half) - 1.0).abs() < 1e-6);
                let half = 0.5 * (g + f64::from(field.at(i, j + 1)));
                assert!((f64::from(sigma0.at(4 * i, 4 * j + 2)) / factor(half) - 1.0).abs() < 1e-6);
            }
        }
        let rule = crate::numeric::GaussLegendre::new(60);
        let mean = rule.integrate([-9.0, 9.0], |z| {
            factor(0.06 * z) / 0.02 * (-0.5 * z * z).exp() / TAU.sqrt()
        });
        assert!((mean - 1.0).abs() < 1e-12);
    }

    /// Eddies have the correlation e^{−κ₀r}, here sums of the density times cosines. The lattice is so fine and wide that
    /// the missing variance beyond κ, κ₀/κ, is 1 %.
    #[test]
    fn eddies_have_an_exponential_correlation() {
        let eddies = Gusts {
            kind: GustKind::Mottle,
            strength: 0.08,
            scale: 250.0,
            wind_toward: 0.3,
        };
        let outer = TAU / eddies.scale;
        let (step, count) = (outer / 10.0, 1000);
        for distance in [0.0, 20.0, 60.0, 120.0] {
            let row = |a: i32| -> f64 {
                let kx = f64::from(a) * step;
                let all = (-count..=count).map(|b| eddies.density([kx, f64::from(b) * step]));
                all.sum::<f64>() * (kx * distance).cos()
            };
            let sum: f64 = (-count..=count).map(row).sum::<f64>() * step * step;
            let expected = 0.0064 * (-outer * distance).exp();
            assert!(
                (sum - expected).abs() < 0.013 * 0.0064,
                "{distance}: {sum} {expected}"
            );
        }
        let raster = Raster::image(60, 60, 10.0);
        let other = Gusts {
            kind: GustKind::Gusts,
            ..eddies
        };
        assert_ne!(eddies.field(&raster, 1), other.field(&raster, 1));
    }

    #[test]
    fn exponents_by_band() {
        assert!((wind_exponent(1.26e9) - 0.8).abs() < 1e-12);
        assert!((1.4..=1.8).contains(&wind_exponent(5.4e9)));
        assert!((wind_exponent(9.65e9) - 1.6).abs() < 1e-12);
    }

    #[test]
    fn seed_decides_and_threads_do_not() {
        let raster = Raster::image(40, 30, 100.0);
        let run = |threads: usize, seed: u64| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            pool.build()
                .unwrap()
                .install(|| gusts().field(&raster, seed))
        };
        assert_eq!(run(1, 3), run(3, 3));
        assert_ne!(run(1, 3), run(1, 4));
    }
}
