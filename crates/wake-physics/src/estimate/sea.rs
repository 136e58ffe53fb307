//! Covariance of the imaged open sea by the nonlinear transform: velocity bunching in full, the rest of the modulation to
//! first order.
//!
//! Sources of relative strength 1 + R are displaced by s in azimuth. R and s are Gaussian, so in closed form
//!
//! ```text
//! P(k) = q² T²(k) Σ_r e^{−ik·r} [ e^{−ky²(σ² − ρ_ss(r))} {1 + ρ_RR(r) + i ky Δ(r) + ky² D(r) D(−r)} − e^{−ky²σ²} ]
//! Δ(r) = ρ_Rs(r) − ρ_Rs(−r),     D(r) = ρ_Rs(r) − ρ_Rs(0),     ρ_ab(r) = ⟨a(x + r) b(x)⟩,     σ² = ρ_ss(0)
//! ```
//!
//! T: azimuth smear of unresolved waves and impulse response; q: share of the intensity that waves modulate. The terms of first
//! order in ρ are the quasi-linear spectrum of [`LinearSea`](crate::simulate::LinearSea).
//!
//! # References
//!
//! Hasselmann and Hasselmann (1991), J. Geophys. Res. 96(C6), 10713; Krogstad (1992), J. Geophys. Res. 97(C2), 2421.

use super::torus::Torus;
use crate::dispersion::angular_frequency;
use crate::error::Result;
use crate::fft::{fast_length, lattice_sum, signed_index};
use crate::linear::OpenSea;
use crate::numeric::{vector::exp, vectorized};
use crate::prepared::Prepared;
use crate::raster::Field;
use crate::scattering::modulation::smear;
use crate::scene::Scene;
use crate::simulate::linear_sea::{GUARD, add_swell};
use crate::surface::wave_variances;
use num_complex::{Complex32, Complex64};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Pixels of a period of the covariance of a grid.
pub(super) fn period(scene: &Scene) -> usize {
    fast_length(scene.grid.rows.max(scene.grid.columns) + GUARD)
}

/// Covariances of modulation and displacement by distance, `[period, period]`.
struct Correlations {
    period: usize,
    modulation: Vec<f64>,
    /// In pixels².
    displacement: Vec<f64>,
    /// ⟨R(x + r) s(x)⟩ [pixels].
    both: Vec<f64>,
    /// The same at the opposite column, of the columns up to half the period.
    mirrored: Vec<f64>,
    /// Largest covariance of the displacement in each row [pixels²].
    largest: Vec<f64>,
}

/// Exponents below which a pair of pixels counts as independent.
const INDEPENDENT: f64 = -16.0;

impl Correlations {
    /// - `of`: modulation and displacement in pixels of each wave
    fn new(variances: &[f32], period: usize, of: impl Fn(usize) -> [Complex64; 2] + Sync) -> Self {
        let waves: Vec<[Complex32; 3]> = variances
            .par_iter()
            .enumerate()
            .map(|(n, &variance)| {
                if variance <= 0.0 {
                    return [Complex32::default(); 3];
                }
                let [r, s] = of(n);
                let products = [
                    Complex64::from(r.norm_sqr()),
                    s.norm_sqr().into(),
                    r * s.conj(),
                ];
                products.map(|p| {
                    let p = p * f64::from(variance);
                    Complex32::new(p.re as f32, p.im as f32)
                })
            })
            .collect();
        let sum = |n: usize| {
            let mut lines: Vec<Complex32> = waves.iter().map(|w| w[n]).collect();
            let [re, _] = lattice_sum(&mut lines, [period; 2], [period; 2]);
            re.into_iter().map(f64::from).collect()
        };
        let mut sums: Vec<Vec<f64>> = (0..3).into_par_iter().map(sum).collect();
        let both = sums.pop().unwrap_or_default();
        let displacement = sums.pop().unwrap_or_default();
        let mirrored = both
            .chunks_exact(period)
            .flat_map(|row: &[f64]| (0..period / 2 + 1).map(move |j| row[(period - j) % period]));
        let most = |row: &[f64]| row.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        Self {
            period,
            largest: displacement.chunks(period).map(most).collect(),
            modulation: sums.pop().unwrap_or_default(),
            displacement,
            mirrored: mirrored.collect(),
            both,
        }
    }

    /// Σ over rows of the brackets times e^{i ky i}, for each column of the half plane.
    ///
    /// - `ky` [rad/pixel]
    fn line(&self, ky: f64) -> [Vec<f64>; 2] {
        let (period, half) = (self.period, self.period / 2 + 1);
        let square = ky * ky;
        let variance = self.displacement[0];
        let (rest, off) = (exp(-square * variance), self.both[0]);
        let mut sums = [vec![0.0; half], vec![0.0; half]];
        vectorized(
            #[inline(always)]
            || {
                let [re, im] = &mut sums;
                let reaching = |i: &usize| square * (self.largest[*i] - variance) > INDEPENDENT;
                for i in (0..period).filter(reaching) {
                    let (sin, cos) = (ky * i as f64).sin_cos();
                    let row = i * period..i * period + half;
                    let mirror = (period - i) % period * half;
                    let back = &self.mirrored[mirror..mirror + half];
                    let displacement = &self.displacement[row.clone()];
                    let modulation = &self.modulation[row.clone()];
                    let here = &self.both[row];
                    let (re, im) = (&mut re[..half], &mut im[..half]);
                    for j in 0..half {
                        let weight = exp(square * (displacement[j] - variance));
                        let bent = square * (here[j] - off) * (back[j] - off);
                        let even = weight * (1.0 + modulation[j] + bent) - rest;
                        let odd = weight * ky * (here[j] - back[j]);
                        re[j] += even * cos - odd * sin;
                        im[j] += even * sin + odd * cos;
                    }
                }
            },
        );
        sums
    }
}

/// Covariance \[1\] of the relative intensity of the open sea of a scene before speckle by distance in rows and columns,
/// `[period, period]`, negative distances from the end.
///
/// # Errors
///
/// A value of the scene out of its range.
pub(super) fn covariance(scene: &Scene) -> Result<Field> {
    scene.validate()?;
    let scene = Scene {
        ships: Vec::new(),
        ..scene.clone()
    };
    let Prepared {
        models,
        effects,
        open,
        ..
    } = Prepared::new(&scene);
    let period = period(&scene);
    let spacing = scene.grid.spacing;
    let step = TAU / (period as f64 * spacing);
    let mut variances = wave_variances(&models.sea, period, spacing);
    add_swell(models.swell.as_ref(), &mut variances, period, step);
    let transfer = OpenSea::modulation_of(&open, &open.averaged(&models));
    let wavenumber = |n: usize| signed_index(n, period) as f64 * step;
    let correlations = Correlations::new(&variances, period, |n| {
        let k = [wavenumber(n / period), wavenumber(n % period)];
        let omega = angular_frequency(k[0].hypot(k[1]), models.sea.depth());
        let m = transfer.at(k, omega);
        let radial = models.transfer.radial(k, omega);
        let modulation = m.tilt + m.hydrodynamic + m.range_bunching;
        // Toward row 0 a displacement is one toward larger y.
        [modulation, radial * (models.range_to_velocity / spacing)]
    });
    let half = period / 2 + 1;
    let resolution = models.resolution().at(0.0);
    let lines: Vec<[Vec<f64>; 2]> = (0..half)
        .into_par_iter()
        .map(|a| {
            let ky = a as f64 * step;
            let both = if a == 0 || 2 * a == period { 1.0 } else { 2.0 };
            let left = both * smear(ky, resolution).powi(2) / period as f64;
            correlations.line(ky * spacing).map(|mut line| {
                line.iter_mut().for_each(|v| *v *= left);
                line
            })
        })
        .collect();
    let share = open.modulated_share(&effects.added()).powi(2);
    let rows: Vec<Vec<f64>> = (0..period)
        .into_par_iter()
        .map(|i| {
            let mut row = vec![0.0; half];
            for (a, [re, im]) in lines.iter().enumerate() {
                let (sin, cos) = (a as f64 * step * spacing * i as f64).sin_cos();
                for (sum, (re, im)) in row.iter_mut().zip(re.iter().zip(im)) {
                    *sum += re * cos + im * sin;
                }
            }
            row
        })
        .collect();
    let value = |n: usize| {
        let (i, j) = (n / period, n % period);
        let value = match j < half {
            true => rows[i][j],
            false => rows[(period - i) % period][period - j],
        };
        (share * value) as f32
    };
    let field = Field {
        rows: period,
        columns: period,
        values: (0..period * period).map(value).collect(),
    };
    let Some(response) = &models.response else {
        return Ok(field);
    };
    let torus = Torus::new(period);
    let mut spectrum = torus.spectrum(&field);
    for (n, value) in spectrum.iter_mut().enumerate() {
        let left = response.azimuth.intensity_transfer(wavenumber(n / period))
            * response.range.intensity_transfer(wavenumber(n % period));
        *value *= (left * left) as f32;
    }
    let [field, _] = torus.fields([&spectrum, &spectrum], [period; 2]);
    Ok(field)
}
