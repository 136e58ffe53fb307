//! Image of the open sea to first order: a Gaussian field with the spectrum of the image.

use crate::dispersion::angular_frequency;
use crate::error::Result;
use crate::fft::{fast_length, lattice_sum, signed_index};
use crate::memory;
use crate::prepared::Prepared;
use crate::raster::Field;
use crate::sar::ImpulseResponse;
use crate::sar::impulse::Axis;
use crate::scattering::modulation::smear;
use crate::scene::Scene;
use crate::surface::wave_variances;
use crate::swell::Swell;
use num_complex::Complex32;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Smallest number of pixels between opposite edges of an image, around the period of the field.
pub(crate) const GUARD: usize = 64;

/// Waves with less than this share of their variance left after the smear are dropped.
const LEAST_SHARE: f64 = 1e-6;

/// Relative intensity (I − E I)/E I of open sea, linear in the waves.
///
/// ```text
/// P(k) = (q |M(k)| T(kx) T(ky))² exp(−2 (ky ρ'/2π)²) Ψ(k)
/// M = tilt + hydrodynamic + range bunching + velocity bunching
/// ```
///
/// - Ψ: wind waves and swell
/// - ρ' and the derivative of ln σ⁰ are taken of the whole sea
/// - T: intensity transfer function of the impulse response, 1 without one
/// - q: share of the mean intensity that waves modulate; the rest is breaking waves and noise
///
/// This is the quasi-linear spectrum of the image, made even in k. The actual image is steeper and not Gaussian; gusts and
/// slicks are in [`expected_intensity`](super::expected_intensity).
///
/// # References
///
/// Hasselmann & Hasselmann (1991), J. Geophys. Res. 96(C6), 10713 (the quasi-linear transform).
#[derive(Debug, Clone)]
pub struct LinearSea {
    rows: usize,
    columns: usize,
    /// Pixels per period along both axes.
    period: usize,
    /// Root of the variance of each pair of waves ±k, indexed by the one with kx ≥ 0: `[columns / 2 + 1, rows]` of the
    /// period, in the order of [`crate::fft`].
    amplitudes: Vec<f32>,
}

impl LinearSea {
    /// The sea of a scene, ignoring ships; all zero if pixels resolve no waves.
    ///
    /// # Errors
    ///
    /// As [`simulate`](super::simulate).
    pub fn new(scene: &Scene) -> Result<Self> {
        scene.validate()?;
        let scene = Scene {
            ships: Vec::new(),
            ..scene.clone()
        };
        let [rows, columns] = [scene.grid.rows, scene.grid.columns];
        let period = fast_length(rows.max(columns) + GUARD);
        // Random numbers, waves and two fields.
        let needed = 24 * (period * period) as u64;
        let advice = "lower grid.rows or grid.columns";
        memory::check([rows, columns], [0, 0], needed, advice)?;
        let Prepared {
            models,
            effects,
            open,
            ..
        } = Prepared::new(&scene).over_all_seas();
        let modulated = open.modulated_share(&effects.added());
        let transfer = open.modulation_of(&models);
        let spacing = scene.grid.spacing;
        let step = TAU / (period as f64 * spacing);
        let resolution = models.resolution().at(0.0);
        let wavenumber = |index: usize| signed_index(index, period) as f64 * step;
        let left = |axis: fn(&ImpulseResponse) -> &Axis| -> Vec<f64> {
            let of = |n| {
                let response = models.response.as_ref();
                response.map_or(1.0, |r| axis(r).intensity_transfer(wavenumber(n)))
            };
            (0..period).map(of).collect()
        };
        let (range, azimuth) = (left(|r| &r.range), left(|r| &r.azimuth));
        let along: Vec<f64> = (0..period)
            .map(|row| azimuth[row] * smear(wavenumber(row), resolution))
            .collect();
        let mut variances = wave_variances(&models.sea, period, spacing);
        add_swell(models.swell.as_ref(), &mut variances, period, step);
        let line = |(column, line): (usize, &mut [f32])| {
            let kx = wavenumber(column);
            for (row, variance) in line.iter_mut().enumerate().filter(|(_, v)| **v > 0.0) {
                let share = (range[column] * along[row]).powi(2);
                if share < LEAST_SHARE {
                    *variance = 0.0;
                    continue;
                }
                let k = [kx, wavenumber(row)];
                let omega =
                    angular_frequency((k[0] * k[0] + k[1] * k[1]).sqrt(), models.sea.depth());
                let modulation = transfer.at(k, omega).total() * modulated;
                let left = f64::from(*variance) * share * modulation.norm_sqr();
                *variance = left as f32;
            }
        };
        variances.par_chunks_mut(period).enumerate().for_each(line);
        Ok(Self {
            rows,
            columns,
            period,
            amplitudes: pairs(&variances, period).map(f32::sqrt).collect(),
        })
    }

    /// Number of independent standard normal numbers that [`field`](Self::field) needs.
    #[must_use]
    pub fn normals(&self) -> usize {
        2 * self.amplitudes.len()
    }

    /// One random sea as relative intensity \[1\], `[rows, columns]` of the image; its opposite edges are independent.
    ///
    /// # Panics
    ///
    /// If there are fewer random numbers than [`normals`](Self::normals).
    #[must_use]
    pub fn field(&self, normals: &[f32]) -> Field {
        let pairs = normals[..self.normals()].as_chunks::<2>().0;
        let waves = self.amplitudes.iter().zip(pairs);
        let waves = waves.map(|(&a, &[re, im])| Complex32::new(a * re, a * im));
        self.sum(waves, [self.rows, self.columns])
    }

    /// Covariance \[1\] of two pixels by their distance in rows and columns, `[period, period]`, negative ones at the end.
    #[must_use]
    pub fn covariance(&self) -> Field {
        let waves = self.amplitudes.iter().map(|a| Complex32::new(a * a, 0.0));
        self.sum(waves, [self.period; 2])
    }

    /// Variance \[1\] of a pixel.
    #[must_use]
    pub(crate) fn variance(&self) -> f64 {
        let squares = self.amplitudes.iter().map(|&a| f64::from(a * a));
        squares.sum()
    }

    /// Real part of a sum of waves with kx ≥ 0.
    fn sum(&self, half: impl Iterator<Item = Complex32>, [rows, columns]: [usize; 2]) -> Field {
        let mut waves = Vec::with_capacity(self.period * self.period);
        waves.extend(half);
        // The FFT skips empty lines.
        waves.resize(self.period * self.period, Complex32::default());
        let [values, _] = lattice_sum(&mut waves, [self.period; 2], [rows, columns]);
        Field {
            rows,
            columns,
            values,
        }
    }
}

/// Variances of the waves of a square lattice, with k and −k combined where kx > 0, as their real parts are equivalent.
///
/// # Shapes
///
/// `[period, period]` to `[period / 2 + 1, period]`
fn pairs(variances: &[f32], period: usize) -> impl Iterator<Item = f32> {
    (0..(period / 2 + 1) * period).map(move |n| {
        let [line, row] = [n / period, n % period];
        // The first line, and the last line of an even period, contain both already.
        match 2 * line % period {
            0 => variances[n],
            _ => variances[n] + variances[(period - line) * period + (period - row) % period],
        }
    })
}

/// Adds the waves of a swell to the variances along +k. The swell's whole variance is added, even if few waves lie near its
/// peak.
///
/// - `period` waves along each axis, spaced by `step` [rad/m]
pub(crate) fn add_swell(swell: Option<&Swell>, variances: &mut [f32], period: usize, step: f64) {
    let Some(swell) = swell else {
        return;
    };
    let place = |n: usize| {
        let at = |index| signed_index(index, period) as f64 * step;
        [at(n / period), at(n % period)]
    };
    let waves: Vec<(usize, f64)> = (1..variances.len())
        .map(|n| (n, swell.density(place(n))))
        .filter(|(_, density)| *density > 0.0)
        .collect();
    let total: f64 = waves.iter().map(|(_, density)| density).sum();
    for (n, density) in waves {
        variances[n] += (swell.variance() * density / total) as f32;
    }
}
