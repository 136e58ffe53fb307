//! Mean σ⁰ of a facet as a function of slope, wind and incidence: a spline with all its derivatives.
//!
//! ```text
//! σ(s) = ∬ p(u) σ_facet(s + u) du      p Gaussian: the slopes of the whole sea
//! ```
//!
//! The Bragg return of plane facets is computed on a lattice of slopes and convolved with p by Fourier transform; the knots of
//! the spline are points of the lattice. Derivatives by slope are derivatives of the spline; derivatives by wind and incidence
//! are central differences of all values.

use super::bright::BrightWaves;
use crate::fft::{fast_length, signed_index};
use crate::scattering::Backscatter;
use num_complex::Complex64;
use rayon::prelude::*;
use rustfft::{Fft, FftPlanner};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Largest spacing of plane facets \[1\], the first spacing that the table of mean σ⁰ tries.
const SPACING: f64 = 0.02;

/// Step of the derivatives of the specular return by slope, in units of the covariance of slope and velocity.
const STEP: f64 = 0.03;

/// Range of an average, in standard deviations.
const REACH: f64 = 5.5;

/// Number of values by which tables are differenced: wind speed, wind direction, incidence.
pub(super) const OUTER: usize = 3;

/// Number of parts: Bragg and specular return, both times the velocity u of the waves, and both times u² − ⟨u²⟩.
const PARTS: usize = 6;

/// Number of derivatives of the parts by the outer values.
const BY_OUTER: usize = PARTS * OUTER;

/// Cells of the spline across the square of slopes, and beyond it on each side, where the end conditions decay.
const CELLS: usize = 64;
const BEYOND: usize = 6;

/// σ⁰ as a cubic spline: twice differentiable, fourth-order accurate in cells of a thirty-second of the reach.
pub(super) struct CrossSection {
    /// Half the side of the square of slopes covered by the spline \[1\].
    reach: f64,
    /// B-spline coefficients, `[side, side]`, with the slope along x running fastest.
    parts: Vec<[f64; PARTS]>,
    /// Coefficients of the derivatives by the outer values, empty if there are none.
    by_outer: Vec<[f64; BY_OUTER]>,
}

/// Number of coefficients along each axis.
const SIDE: usize = CELLS + 2 * BEYOND + 1;

/// σ⁰ at one slope: Bragg and specular return, and the means of both times u and times u² − ⟨u²⟩, with u the velocity of the
/// sea's waves toward the radar \[m/s\].
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct At {
    pub(super) value: [f64; PARTS],
    /// Derivatives by the slopes along x and y.
    pub(super) slope: [[f64; 2]; PARTS],
    /// Derivatives by wind speed, wind direction and incidence.
    pub(super) outer: [[f64; OUTER]; PARTS],
}

/// Backscatter of plane facets, and the covariances of the sea's waves.
pub(super) type Facets = (Backscatter, BrightWaves);

impl CrossSection {
    /// σ⁰ over the square of slopes up to `reach`.
    ///
    /// - `outer`: for each outer value, σ⁰ one step below and above it, and twice the step; `None` for no derivative
    pub(super) fn new(
        here: &Facets,
        outer: &[Option<([&Facets; 2], f64)>; OUTER],
        reach: f64,
    ) -> Self {
        let lattice = Lattice::new(reach, here.0.tilt.principal_axes().variance[0].sqrt());
        let moved = outer.iter().flatten().flat_map(|(pair, _)| *pair);
        let all: Vec<&Facets> = std::iter::once(here).chain(moved).collect();
        let mut tables = all
            .par_iter()
            .map(|facets| lattice.averages(facets))
            .collect::<Vec<_>>()
            .into_iter();
        let mut parts = tables.next().unwrap_or_default();
        let count = if outer.iter().any(Option::is_some) {
            SIDE * SIDE
        } else {
            0
        };
        let mut by_outer = vec![[0.0; BY_OUTER]; count];
        for (n, pair) in outer.iter().enumerate() {
            if let (Some((_, width)), Some(below), Some(above)) = (
                pair,
                pair.and_then(|_| tables.next()),
                pair.and_then(|_| tables.next()),
            ) {
                for (to, (a, b)) in by_outer.iter_mut().zip(below.iter().zip(&above)) {
                    for part in 0..PARTS {
                        to[part * OUTER + n] = (b[part] - a[part]) / width;
                    }
                }
            }
        }
        spline(&mut parts);
        spline(&mut by_outer);
        Self {
            reach,
            parts,
            by_outer,
        }
    }

    /// σ⁰ at a slope; slopes beyond the spline are clamped to its edge.
    ///
    /// - `BY`: with derivatives by the outer values
    #[inline(always)]
    pub(super) fn at<const BY: bool>(&self, slope: [f64; 2]) -> At {
        let per = CELLS as f64 / (2.0 * self.reach);
        let mut first_cell = [0; 2];
        let mut weights = [[[0.0; 4]; 2]; 2];
        for axis in 0..2 {
            let inside = slope[axis].clamp(-self.reach, self.reach);
            let place = (inside + self.reach) * per + BEYOND as f64;
            let cell = (place as usize).min(SIDE - 3);
            first_cell[axis] = cell - 1;
            weights[axis] = spline_weights(place - cell as f64);
        }
        let [[u, du], [v, dv]] = weights;
        let mut at = At::default();
        for (j, (v, dv)) in v.into_iter().zip(dv).enumerate() {
            let start = (first_cell[1] + j) * SIDE + first_cell[0];
            let line = self.parts[start..].first_chunk::<4>();
            let (mut sum, mut slope) = ([0.0; PARTS], [0.0; PARTS]);
            for (i, c) in line.into_iter().flatten().enumerate() {
                for n in 0..PARTS {
                    sum[n] += u[i] * c[n];
                    slope[n] += du[i] * c[n];
                }
            }
            for n in 0..PARTS {
                at.value[n] += v * sum[n];
                at.slope[n][0] += per * v * slope[n];
                at.slope[n][1] += per * dv * sum[n];
            }
        }
        if !BY || self.by_outer.is_empty() {
            return at;
        }
        let mut by_outer = [0.0; BY_OUTER];
        for (j, v) in v.into_iter().enumerate() {
            let start = (first_cell[1] + j) * SIDE + first_cell[0];
            let line = self.by_outer[start..].first_chunk::<4>();
            for (i, c) in line.into_iter().flatten().enumerate() {
                for (sum, c) in by_outer.iter_mut().zip(c) {
                    *sum += v * u[i] * c;
                }
            }
        }
        at.outer = std::array::from_fn(|n| std::array::from_fn(|p| by_outer[n * OUTER + p]));
        at
    }
}

/// Weights of four B-splines at t in their middle cell, with their derivatives.
#[inline(always)]
fn spline_weights(t: f64) -> [[f64; 4]; 2] {
    let r = 1.0 - t;
    [
        [
            r * r * r / 6.0,
            (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0,
            (4.0 - 6.0 * r * r + 3.0 * r * r * r) / 6.0,
            t * t * t / 6.0,
        ],
        [
            -0.5 * r * r,
            -2.0 * t + 1.5 * t * t,
            2.0 * r - 1.5 * r * r,
            0.5 * t * t,
        ],
    ]
}

/// Replaces values at the knots by B-spline coefficients: the inverse of 1/6, 4/6, 1/6 along both axes.
fn spline<const CHANNELS: usize>(knots: &mut [[f64; CHANNELS]]) {
    if knots.is_empty() {
        return;
    }
    for (step, line) in [(1, SIDE), (SIDE, 1)] {
        for n in 0..SIDE {
            let places: Vec<usize> = (0..SIDE).map(|k| n * line + k * step).collect();
            (0..CHANNELS).for_each(|channel| {
                let mut values: Vec<f64> = places.iter().map(|&at| knots[at][channel]).collect();
                unsmooth(&mut values);
                for (&at, value) in places.iter().zip(values) {
                    knots[at][channel] = value;
                }
            });
        }
    }
}

/// Solves (c₋ + 4c + c₊)/6 = value along a line, leaving its ends unchanged.
fn unsmooth(values: &mut [f64]) {
    let last = values.len() - 1;
    let mut factor = vec![0.0; last];
    for n in 1..last {
        let pivot = 1.0 / (4.0 - factor[n - 1]);
        factor[n] = pivot;
        values[n] = (6.0 * values[n] - values[n - 1]) * pivot;
    }
    for n in (1..last).rev() {
        values[n] -= factor[n] * values[n + 1];
    }
}

/// Lattice of slopes around 0, which contains the knots.
struct Lattice {
    side: usize,
    spacing: f64,
    /// Steps of the lattice from knot to knot.
    finer: usize,
    forward: Arc<dyn Fft<f64>>,
    inverse: Arc<dyn Fft<f64>>,
}

impl Lattice {
    /// - `widest`: largest standard deviation of the averages
    fn new(reach: f64, widest: f64) -> Self {
        let cell = 2.0 * reach / CELLS as f64;
        let finer = (cell / SPACING).ceil().max(1.0) as usize;
        let spacing = cell / finer as f64;
        let around = (REACH * widest / spacing).ceil() as usize;
        let side = fast_length(SIDE * finer + 2 * around);
        let mut planner = FftPlanner::new();
        Self {
            forward: planner.plan_fft_forward(side),
            inverse: planner.plan_fft_inverse(side),
            side,
            spacing,
            finer,
        }
    }

    /// Index of the lattice point at a knot.
    fn at_knot(&self, n: usize) -> usize {
        self.side / 2 + n * self.finer - SIDE / 2 * self.finer
    }

    /// Slope at a point.
    fn slope(&self, n: usize) -> f64 {
        (n as f64 - (self.side / 2) as f64) * self.spacing
    }

    /// The parts at the knots, with the slope along x running fastest.
    fn averages(&self, (backscatter, waves): &Facets) -> Vec<[f64; PARTS]> {
        let side = self.side;
        let mut facets = vec![0.0; side];
        let mut values = Vec::with_capacity(side * side);
        for j in 0..side {
            let first = [self.slope(0), self.slope(j)];
            backscatter
                .two_scale
                .facets(first, [self.spacing, 0.0], &mut facets);
            values.extend(facets.iter().map(|&f| Complex64::from(f)));
        }
        self.forward.process(&mut values);
        transpose(&mut values, side);
        self.forward.process(&mut values);
        let tilt = &backscatter.tilt;
        let step = TAU / (side as f64 * self.spacing);
        let wavenumber = |n: usize| signed_index(n, side) as f64 * step;
        // Waves at half the sampling rate have no odd part.
        let is_inside = |n: usize| 2 * (n / side) != side && 2 * (n % side) != side;
        let inside = |n: usize| f64::from(u8::from(is_inside(n)));
        let mut squares = vec![Complex64::default(); side * side];
        for (n, (value, square)) in values.iter_mut().zip(&mut squares).enumerate() {
            let [x, y] = [wavenumber(n / side), wavenumber(n % side)];
            let exponent = tilt.xx * x * x + 2.0 * tilt.xy * x * y + tilt.yy * y * y;
            let along = |[a, b]: [f64; 2]| a * x + b * y;
            let velocity = Complex64::new(
                waves.velocity_modulation,
                along(waves.velocity_slope) * inside(n),
            );
            let moved = Complex64::cis(along(waves.slope_modulation) * inside(n));
            *value *= moved * ((-0.5 * exponent).exp() / (side * side) as f64);
            *square = *value * velocity * velocity;
            // Mean and its product with the velocity, both real after the transform, as one complex number.
            *value *= Complex64::ONE + Complex64::i() * velocity;
        }
        for values in [&mut values, &mut squares] {
            self.inverse.process(values);
            transpose(values, side);
        }
        let mut out = Vec::with_capacity(SIDE * SIDE);
        for j in (0..SIDE).map(|n| self.at_knot(n)) {
            let [row, squares] = [&mut values, &mut squares].map(|values| {
                let row = &mut values[j * side..(j + 1) * side];
                self.inverse.process(row);
                row
            });
            out.extend((0..SIDE).map(|n| {
                let i = self.at_knot(n);
                let slope = [self.slope(i), self.slope(j)];
                let specular = &backscatter.specular;
                let moved = |by: f64| {
                    specular.sigma0([0, 1].map(|a| slope[a] + by * waves.velocity_slope[a]))
                };
                let [below, here, above] = [-STEP, 0.0, STEP].map(moved);
                let velocity = (above - below) / (2.0 * STEP);
                let square = (above - 2.0 * here + below) / (STEP * STEP);
                [row[i].re, here, row[i].im, velocity, squares[i].re, square]
            }));
        }
        out
    }
}

fn transpose(values: &mut [Complex64], side: usize) {
    for i in 0..side {
        for j in 0..i {
            values.swap(i * side + j, j * side + i);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    /// The spline of a polynomial has its values and derivatives.
    #[test]
    fn the_spline_is_the_polynomial() {
        let (t3, t2) = (
            |x: f64| 4.0 * x * x * x - 3.0 * x,
            |y: f64| 2.0 * y * y - 1.0,
        );
        let t4 = |x: f64| 8.0 * x.powi(4) - 8.0 * x * x + 1.0;
        let half = (SIDE / 2) as f64;
        let at = |n: usize| n as f64 / half - 1.0;
        // T₃(x) T₂(y) in the Bragg part, T₄(x) in the specular one, and the first as the derivative of a part by an outer value.
        let knot = |n: usize| {
            let mut parts = [0.0; PARTS];
            parts[0] = t3(at(n % SIDE)) * t2(at(n / SIDE));
            parts[1] = t4(at(n % SIDE));
            parts
        };
        let mut parts: Vec<_> = (0..SIDE * SIDE).map(knot).collect();
        spline(&mut parts);
        let outer = |part: &[f64; PARTS]| {
            let mut outer = [0.0; BY_OUTER];
            outer[2 * OUTER + 1] = part[0];
            outer
        };
        let section = CrossSection {
            reach: 1.0 / (1.0 + 2.0 * BEYOND as f64 / CELLS as f64),
            by_outer: parts.iter().map(outer).collect(),
            parts,
        };
        for [x, y] in [[0.0, 0.0], [0.31, -0.52], [-0.8, 0.7], [0.123, 0.456]] {
            let at = section.at::<true>([x, y]);
            assert!((at.outer[2][1] - at.value[0]).abs() < 1e-12);
            let alone = section.at::<false>([x, y]).value.into_iter();
            assert!(alone.zip(at.value).all(|(a, b)| (a - b).abs() < 1e-12));
            let (d3, d2) = (12.0 * x * x - 3.0, 4.0 * y);
            // Fourth order in cells of 1/38, fourth derivatives up to 192.
            assert!((at.value[0] - t3(x) * t2(y)).abs() < 1e-5);
            assert!((at.value[1] - t4(x)).abs() < 1e-5);
            assert!((at.slope[0][0] - d3 * t2(y)).abs() < 1e-3);
            assert!((at.slope[0][1] - t3(x) * d2).abs() < 1e-3);
        }
    }

    /// Products with the velocity, against differences of the mean σ⁰ by direct quadrature.
    #[test]
    fn velocities_are_weighted_with_brightness() {
        let scene = Scene::default();
        let models = super::super::frozen::averaged(&scene);
        let facets = (
            models.backscatter(true, true),
            BrightWaves {
                slope_modulation: [0.01, -0.02],
                velocity_slope: [0.012, 0.007],
                velocity_modulation: 0.04,
            },
        );
        let section = CrossSection::new(&facets, &[const { None }; OUTER], 0.4);
        let (exact, waves) = &facets;
        let step = 0.1;
        let along = |slope: [f64; 2], n: f64| {
            exact.parts([0, 1].map(|a| slope[a] + n * step * waves.velocity_slope[a]))
        };
        for slope in [[0.0, 0.0], [0.2, -0.1]] {
            let found = section.at::<true>(slope).value;
            let shifted = [0, 1].map(|a| slope[a] + waves.slope_modulation[a]);
            for (n, at) in [shifted, slope].into_iter().enumerate() {
                let [below, here, above] = [-1.0, 0.0, 1.0].map(|by: f64| along(at, by)[n]);
                let first = (above - below) / (2.0 * step);
                let second = (above - 2.0 * here + below) / (step * step);
                let c = [waves.velocity_modulation, 0.0][n];
                // Differences over a slope of 0.0014 where σ⁰ changes by its own size over 0.04: errors of 1e-3 of each
                // derivative.
                let close = |found: f64, expected: f64, unit: f64| {
                    let allowed = 1e-3 * (expected.abs() + unit);
                    assert!((found - expected).abs() < allowed, "{found} {expected}");
                };
                close(found[n], here, here);
                close(found[2 + n], c * here + first, 0.1 * here);
                close(
                    found[4 + n],
                    c * c * here + 2.0 * c * first + second,
                    0.02 * here,
                );
            }
        }
    }

    /// The mean σ⁰ agrees with direct quadrature.
    #[test]
    fn it_is_the_exact_cross_section() {
        for keys in [
            &[][..],
            &["sea.wind_speed=3", "radar.incidence=24"],
            &["sea.wind_toward=130", "radar.polarization=HH"],
        ] {
            let scene = Scene::default().with_assignments(keys).unwrap();
            let models = super::super::frozen::averaged(&scene);
            let exact = models.backscatter(true, true);
            let facets = (exact, BrightWaves::default());
            let section = CrossSection::new(&facets, &[const { None }; OUTER], 0.4);
            let exact = &facets.0;
            let calm: f64 = exact.parts([0.0; 2]).iter().sum();
            for slope in [[0.0, 0.0], [0.2, -0.1], [-0.35, 0.3]] {
                let found = section.at::<true>(slope).value;
                for (found, expected) in found.iter().zip(exact.parts(slope)) {
                    assert!(
                        (found - expected).abs() < 2e-4 * calm.max(expected),
                        "{keys:?} {slope:?}: {found} {expected}"
                    );
                }
            }
        }
    }
}
