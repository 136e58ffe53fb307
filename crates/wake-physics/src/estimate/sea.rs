//! Covariance of the imaged open sea by the nonlinear transform: brightness and velocity bunching in full, range bunching to
//! first order.
//!
//! Sources of relative strength e^m are displaced by s in azimuth and by d in range. As m, s and d are Gaussian, the spectrum has
//! a closed form:
//!
//! ```text
//! P(k) = q² T²(k) Σ_r e^{−ik·r} [ W(r) {1 + i kx (Δ_d(r) + i ky Q(r))} − e^{−ky²σ²} ]
//! W(r) = g(r) exp(ρ_mm(r) + i ky Δ_s(r) − ky² (σ² − ρ_ss(r)))
//! Δ_a(r) = ρ_ma(r) − ρ_ma(−r),     Q(r) = 2ρ_ds(0) − ρ_ds(r) − ρ_ds(−r),     ρ_ab(r) = ⟨a(x + r) b(x)⟩,     σ² = ρ_ss(0)
//! g(r) = (1 + ½ vᵀHv)(1 + ½ uᵀHu) + vᵀHCHu + ½ tr HCHC,     v = ⟨∇ζ(x + r) m(x)⟩,     u = v(−r),     C = ⟨∇ζ(x + r) ∇ζ(x)ᵀ⟩
//! ```
//!
//! m: tilt and hydrodynamic modulation to first order; H: second derivatives of ln σ⁰ by the slopes along x and y; T: azimuth
//! smear of unresolved waves, sharing of sources between two pixels, and impulse response; q²: square of the share of the
//! intensity that waves modulate. The terms of first order in ρ are the quasi-linear spectrum of
//! [`LinearSea`](crate::simulate::LinearSea).
//!
//! # References
//!
//! Hasselmann and Hasselmann (1991), J. Geophys. Res. 96(C6), 10713; Krogstad (1992), J. Geophys. Res. 97(C2), 2421 (velocity
//! bunching in full, modulation to second order).

use super::torus::Torus;
use crate::dispersion::angular_frequency;
use crate::error::Result;
use crate::fft::{fast_length, lattice_sum, signed_index};
use crate::linear::curvature_of;
use crate::numeric::vector::{cos_sin, exp};
use crate::numeric::vectorized;
use crate::prepared::Prepared;
use crate::raster::Field;
use crate::sar::smooth::SMALLEST_VARIANCE;
use crate::scattering::modulation::smear;
use crate::scene::Scene;
use crate::simulate::linear_sea::{GUARD, add_swell};
use crate::surface::wave_variances;
use num_complex::{Complex32, Complex64};
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// Period of the covariance for a scene's grid \[pixels\].
pub(super) fn period(scene: &Scene) -> usize {
    fast_length(scene.grid.rows.max(scene.grid.columns) + GUARD)
}

/// Number of sums from which the covariances are computed.
const SUMS: usize = 10;

/// Covariances of brightness and displacement by distance, `[period, period]`, displacements in pixels.
#[derive(Default)]
struct Correlations {
    period: usize,
    /// Logarithm of the mean product of two brightnesses.
    brightness: Vec<f64>,
    /// Covariance of the displacement in azimuth.
    displacement: Vec<f64>,
    /// Largest covariance of the displacement in each row.
    largest: Vec<f64>,
    /// ρ(r) − ρ(−r) of brightness and displacement, in azimuth and in range.
    moving: [Vec<f64>; 2],
    /// 2ρ(0) − ρ(r) − ρ(−r) of displacements in range and azimuth.
    apart: Vec<f64>,
}

/// Smallest factor on the mean product of brightnesses, as a second-order sum has no lower bound.
const SMALLEST_FACTOR: f64 = 1e-3;

/// Exponent below which a pair of pixels counts as independent.
const INDEPENDENT: f64 = -16.0;

impl Correlations {
    /// - `of`: modulation, displacements in azimuth and in range, and slopes along x and y of each wave
    /// - `curvature`: second derivatives of ln σ⁰ by the slopes
    fn new(
        variances: &[f32],
        period: usize,
        curvature: [f64; 2],
        of: impl Fn(usize) -> [Complex64; 5] + Sync,
    ) -> Self {
        let waves: Vec<[Complex32; SUMS]> = variances
            .par_iter()
            .enumerate()
            .map(|(n, &variance)| {
                if variance <= 0.0 {
                    return [Complex32::default(); SUMS];
                }
                let [m, s, q, x, y] = of(n);
                let products = [
                    m * m.conj(),
                    s * s.conj(),
                    m * s.conj(),
                    m * q.conj(),
                    q * s.conj(),
                    x * m.conj(),
                    y * m.conj(),
                    x * x.conj(),
                    x * y.conj(),
                    y * y.conj(),
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
        let sums: Vec<Vec<f64>> = (0..SUMS).into_par_iter().map(sum).collect();
        let Ok([m, displacement, ms, mq, qs, xm, ym, xx, xy, yy]) =
            <[Vec<f64>; SUMS]>::try_from(sums)
        else {
            return Self::default();
        };
        let opposite =
            |n: usize| (period - n / period) % period * period + (period - n % period) % period;
        let odd = |of: &[f64]| (0..of.len()).map(|n| of[n] - of[opposite(n)]).collect();
        let [hx, hy] = curvature;
        let brightness = |n: usize| {
            let [a, b] = [[xm[n], ym[n]], [xm[opposite(n)], ym[opposite(n)]]];
            let bent = |[x, y]: [f64; 2]| 0.5 * (hx * x * x + hy * y * y);
            let [ha, hb] = [a, b].map(|[x, y]| [hx * x, hy * y]);
            let across =
                ha[0] * (xx[n] * hb[0] + xy[n] * hb[1]) + ha[1] * (xy[n] * hb[0] + yy[n] * hb[1]);
            let both = (hx * xx[n]).powi(2) + 2.0 * hx * hy * xy[n].powi(2) + (hy * yy[n]).powi(2);
            let factor = (1.0 + bent(a)) * (1.0 + bent(b)) + across + 0.5 * both;
            m[n] + factor.max(SMALLEST_FACTOR).ln()
        };
        let most = |row: &[f64]| row.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        Self {
            period,
            brightness: (0..m.len()).map(brightness).collect(),
            largest: displacement.chunks(period).map(most).collect(),
            displacement,
            moving: [odd(&ms), odd(&mq)],
            apart: (0..qs.len())
                .map(|n| 2.0 * qs[0] - qs[n] - qs[opposite(n)])
                .collect(),
        }
    }

    /// Sums over rows of the brackets times e^{i ky i}, for each column of the half plane: real and imaginary parts of the
    /// bracket without kx and of the factor of i kx.
    ///
    /// - `ky` [rad/pixel]
    fn line(&self, ky: f64) -> [Vec<f64>; 4] {
        let (period, half) = (self.period, self.period / 2 + 1);
        let square = ky * ky;
        let variance = self.displacement[0];
        let rest = exp(-square * variance);
        let mut sums = [0; 4].map(|_| vec![0.0; half]);
        vectorized(
            #[inline(always)]
            || {
                let reaching = |i: &usize| square * (self.largest[*i] - variance) > INDEPENDENT;
                for i in (0..period).filter(reaching) {
                    let (sin, cos) = (ky * i as f64).sin_cos();
                    let row = i * period..i * period + half;
                    let displacement = &self.displacement[row.clone()];
                    let brightness = &self.brightness[row.clone()];
                    let azimuth = &self.moving[0][row.clone()];
                    let range = &self.moving[1][row.clone()];
                    let apart = &self.apart[row];
                    let [re, im, along, across] = &mut sums;
                    let (re, im) = (&mut re[..half], &mut im[..half]);
                    let (along, across) = (&mut along[..half], &mut across[..half]);
                    for j in 0..half {
                        let weight = exp(square * (displacement[j] - variance) + brightness[j]);
                        let [even, odd] = cos_sin(turns(ky * azimuth[j]));
                        let [even, odd] = [even, odd].map(|v| weight * f64::from(v));
                        // The phase of the row.
                        let [a, b] = [even * cos - odd * sin, even * sin + odd * cos];
                        re[j] += a - rest * cos;
                        im[j] += b - rest * sin;
                        along[j] += a * range[j] - b * ky * apart[j];
                        across[j] += b * range[j] + a * ky * apart[j];
                    }
                }
            },
        );
        sums
    }
}

/// An angle [rad] in units of 2⁻³² turns.
#[inline(always)]
fn turns(angle: f64) -> u32 {
    let turns = angle * (1.0 / TAU);
    let part = turns - turns.round_ties_even();
    (part * 4_294_967_296.0) as i32 as u32
}

/// Covariance \[1\] of the relative intensity of a scene's open sea before speckle, by distance in rows and columns, `[period,
/// period]`, with negative distances at the end.
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
    let averaged = open.averaged(&models);
    let transfer = open.modulation_of(&averaged);
    let wavenumber = |n: usize| signed_index(n, period) as f64 * step;
    // Column 0 is nearest the radar, row 0 at the largest y.
    let lean = -1.0 / (models.incidence.tan() * spacing);
    let elevation: f64 = variances.iter().map(|v| f64::from(*v)).sum();
    let correlations = Correlations::new(&variances, period, curvature_of(&averaged), |n| {
        let k = [wavenumber(n / period), wavenumber(n % period)];
        let omega = angular_frequency(k[0].hypot(k[1]), models.sea.depth());
        let m = transfer.at(k, omega);
        let radial = models.transfer.radial(k, omega);
        let slopes = k.map(|k| Complex64::i() * k);
        [
            m.tilt + m.hydrodynamic,
            radial * (models.range_to_velocity / spacing),
            lean.into(),
            slopes[0],
            slopes[1],
        ]
    });
    let half = period / 2 + 1;
    let narrowest = PI * (2.0 * SMALLEST_VARIANCE).sqrt() * spacing;
    let resolution = models.resolution().at(0.0).max(narrowest);
    let lines: Vec<[Vec<f64>; 4]> = (0..half)
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
    let row = |i: usize| {
        let mut row = [vec![0.0; half], vec![0.0; half]];
        for (a, [re, im, along, across]) in lines.iter().enumerate() {
            let (sin, cos) = (a as f64 * step * spacing * i as f64).sin_cos();
            for (row, [re, im]) in row.iter_mut().zip([[re, im], [along, across]]) {
                for (sum, (re, im)) in row.iter_mut().zip(re.iter().zip(im)) {
                    *sum += re * cos + im * sin;
                }
            }
        }
        row
    };
    let rows: Vec<[Vec<f64>; 2]> = (0..period).into_par_iter().map(row).collect();
    // The bracket is even, the factor of i kx odd.
    let field = |order: usize| {
        let value = |n: usize| {
            let (i, j) = (n / period, n % period);
            let value = match j < half {
                true => rows[i][order][j],
                false => [1.0, -1.0][order] * rows[(period - i) % period][order][period - j],
            };
            (share * value) as f32
        };
        Field {
            rows: period,
            columns: period,
            values: (0..period * period).map(value).collect(),
        }
    };
    let torus = Torus::new(period);
    let [mut spectrum, slope] = torus.spectra([&field(0), &field(1)]);
    let between = between_pixels(lean * lean * elevation);
    for (n, (value, slope)) in spectrum.iter_mut().zip(&slope).enumerate() {
        let [ky, kx] = [wavenumber(n / period), wavenumber(n % period)];
        // Waves at half the sampling rate have no odd part.
        // The torus uses e^{+i kx x}.
        let odd = if 2 * (n % period) == period {
            0.0
        } else {
            kx * spacing
        };
        *value -= slope * Complex32::new(0.0, odd as f32);
        let mut left = 1.0 - 2.0 * between * (1.0 - (kx * spacing).cos());
        if let Some(response) = &models.response {
            let both =
                response.azimuth.intensity_transfer(ky) * response.range.intensity_transfer(kx);
            left *= both * both;
        }
        *value *= left as f32;
    }
    let [field, _] = torus.fields([&spectrum, &spectrum], [period; 2]);
    Ok(field)
}

/// Mean of d(1 − d), where d is the fraction of a Gaussian displacement between two pixels, which share the source.
///
/// - `variance`: variance of the displacement [pixel²]
fn between_pixels(variance: f64) -> f64 {
    let term = |n: i32| {
        let square = (PI * f64::from(n)).powi(2);
        (-2.0 * square * variance).exp() / square
    };
    1.0 / 6.0 - (1..=50).map(term).sum::<f64>()
}
