//! The wake integral by brute force: the reference for the nodes of a plan.

use super::KelvinWake;
use crate::raster::Raster;
use crate::waves::{Quantity, Transfer};
use num_complex::Complex64;
use rayon::prelude::*;

/// Intervals of the coarsest rule, and largest number of halvings.
const COARSEST: usize = 256;
const HALVINGS: usize = 14;

/// Integrates the wake over the wave directions pixel by pixel, by Romberg's rule in the angle θ.
///
/// ```text
/// field(x, y) = Re ∫ T A(θ) e^{i k·(x − x_ship)} dθ,     |k| ≤ π/spacing
/// ```
///
/// Intervals are halved until the sum changes by less than `error` of the integral of the magnitude, at most 14 times. The result
/// is independent of the nodes of a plan: another variable and another rule. There is no fade over the hull.
///
/// # Shapes
///
/// `pixels` are (row, column) pairs; one vector per quantity, one value per pixel.
#[must_use]
pub fn direct_quadrature(
    wake: &KelvinWake,
    transfer: &Transfer,
    quantities: &[Quantity],
    raster: &Raster,
    pixels: &[[usize; 2]],
    error: f64,
) -> Vec<Vec<f64>> {
    let steady = wake.steady_waves();
    let Some(last) = steady.last(raster.nyquist_wavenumber()) else {
        return vec![vec![0.0; pixels.len()]; quantities.len()];
    };
    let range = [steady.first(), last].map(|u| u.sinh().atan());
    let values: Vec<Vec<f64>> = pixels
        .par_iter()
        .map(|&[row, column]| {
            let seen = wake.track.seen_from_ship([raster.x(column), raster.y(row)]);
            let integrand = |v: f64| integrand(wake, transfer, quantities, seen, range, v);
            romberg(integrand, quantities.len(), error)
        })
        .collect();
    (0..quantities.len())
        .map(|q| values.iter().map(|v| v[q]).collect())
        .collect()
}

/// Integrand over v in [0, 1] with θ = θ₀ + (θ₁ − θ₀)v², waves to port and to starboard added: values, then magnitudes.
fn integrand(
    wake: &KelvinWake,
    transfer: &Transfer,
    quantities: &[Quantity],
    [ahead, port]: [f64; 2],
    [from, to]: [f64; 2],
    v: f64,
) -> Vec<f64> {
    let theta = from + (to - from) * v * v;
    let amplitude = wake.amplitude(theta) * (2.0 * (to - from) * v);
    let wave = wake.steady_waves().at(theta.tan().asinh());
    let mut out = vec![0.0; 2 * quantities.len()];
    for across in [wave.across, -wave.across] {
        let k = wake.track.turned([wave.along, across]);
        let phased = amplitude * Complex64::cis(wave.along * ahead + across * port);
        for (i, &quantity) in quantities.iter().enumerate() {
            let value = transfer.factor(quantity, k, wake.speed * wave.along) * phased;
            out[i] += value.re;
            out[i + quantities.len()] += value.norm();
        }
    }
    out
}

/// Romberg's rule on [0, 1] for `count` values followed by their magnitudes: trapezoidal sums over halved intervals, extrapolated
/// to intervals of width 0.
fn romberg(f: impl Fn(f64) -> Vec<f64>, count: usize, error: f64) -> Vec<f64> {
    let sum = |start: f64, step: f64, n: usize| {
        let mut total = vec![0.0; 2 * count];
        for i in 0..n {
            for (t, v) in total.iter_mut().zip(f(start + i as f64 * step)) {
                *t += v * step;
            }
        }
        total
    };
    let (mut n, mut row) = (
        COARSEST,
        vec![sum(0.0, 1.0 / COARSEST as f64, COARSEST + 1)],
    );
    for (t, (a, b)) in row[0].iter_mut().zip(f(0.0).into_iter().zip(f(1.0))) {
        *t -= 0.5 * (a + b) / n as f64;
    }
    for _ in 0..HALVINGS {
        let step = 1.0 / n as f64;
        let middle = sum(0.5 * step, step, n);
        let mut finer: Vec<Vec<f64>> = vec![mixed(&row[0], &middle, 0.5)];
        for (order, coarse) in row.iter().enumerate().take(6) {
            let weight = 1.0 / (4f64.powi(order as i32 + 1) - 1.0);
            finer.push(mixed(&finer[order], coarse, -weight));
        }
        let (old, new) = (&row[row.len() - 1], &finer[finer.len() - 1]);
        let settled = (0..count).all(|i| (new[i] - old[i]).abs() <= error * finer[0][count + i]);
        (n, row) = (2 * n, finer);
        if settled {
            break;
        }
    }
    let mut best = row.pop().unwrap_or_default();
    best.truncate(count);
    best
}

/// (1 − part)·a + part·b.
fn mixed(a: &[f64], b: &[f64], part: f64) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + part * (b - a)).collect()
}
