//! Elementwise activations and their derivatives, in vector instructions and on all cores.

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::silu::{exp, sigmoid};
use crate::kernels::zeros;

/// A function of one number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Curve {
    /// `x σ(β x)`; with β = 1 the sigmoid linear unit.
    Swish(f32),
    /// `x Φ(x)`, Φ the normal distribution function.
    Gelu,
}

/// Elements that one core processes at a time.
const PART: usize = 1 << 13;

/// Applies a curve to every element.
pub(crate) fn map(x: &[f32], curve: Curve) -> Vec<f32> {
    let mut y = zeros(x.len());
    let arch = Arch::new();
    y.par_chunks_mut(PART)
        .zip(x.par_chunks(PART))
        .for_each(|(y, x)| arch.dispatch(Map { x, y, curve }));
    y
}

/// Gradient of [`map`] with respect to `x`, from the gradient of its result.
pub(crate) fn map_gradient(x: &[f32], dy: &[f32], curve: Curve) -> Vec<f32> {
    let mut dx = dy.to_vec();
    let arch = Arch::new();
    dx.par_chunks_mut(PART)
        .zip(x.par_chunks(PART))
        .for_each(|(dx, x)| arch.dispatch(MapBack { x, dx, curve }));
    dx
}

/// Gate of a gated feed-forward layer: maps every token `(a, b)` to `a ⊙ gelu(b)`.
///
/// # Shapes
///
/// `x`: `[tokens, 2 · inner]`; result: `[tokens, inner]`
pub(crate) fn gate(x: &[f32], inner: usize) -> Vec<f32> {
    let mut y = zeros(x.len() / 2);
    let tokens = tokens_at_once(inner);
    let arch = Arch::new();
    y.par_chunks_mut(tokens * inner)
        .zip(x.par_chunks(tokens * 2 * inner))
        .for_each(|(y, x)| arch.dispatch(Gate { x, y, inner }));
    y
}

/// Gradient of [`gate`] with respect to `x`, from the gradient of its result.
///
/// # Shapes
///
/// `dy`: `[tokens, inner]`; result: as `x`
pub(crate) fn gate_gradient(x: &[f32], dy: &[f32], inner: usize) -> Vec<f32> {
    let mut dx = zeros(x.len());
    let tokens = tokens_at_once(inner);
    let arch = Arch::new();
    dx.par_chunks_mut(tokens * 2 * inner)
        .zip(x.par_chunks(tokens * 2 * inner))
        .zip(dy.par_chunks(tokens * inner))
        .for_each(|((dx, x), dy)| arch.dispatch(GateBack { x, dy, dx, inner }));
    dx
}

fn tokens_at_once(inner: usize) -> usize {
    (PART / inner.max(1)).max(1)
}

/// Φ(x), the standard normal distribution function.
///
/// ```text
/// ½ erfc(u) = ½ t Q(t) e^(−u²),   u = |x|/√2,   t = 1/(1 + 0.35 u)
/// ```
///
/// Q is the polynomial of degree 9 with the least maximum of the relative error for u from 0 to 9.6, 7e-9: fitted here to
/// erfc with forty digits. In f32, Φ(x) is right to 8 units in the last place down to x = −1; below, the relative error
/// grows to u² units.
#[inline(always)]
fn normal(x: f32) -> f32 {
    const Q: [f32; 9] = [
        -0.155_418_44,
        0.172_895_5,
        -0.015_804_179,
        0.076_661_12,
        0.151_887_37,
        0.149_050_73,
        0.188_388_69,
        0.197_075_8,
        0.197_487_24,
    ];
    let u = x.abs() * std::f32::consts::FRAC_1_SQRT_2;
    let t = 1.0 / u.mul_add(0.35, 1.0);
    let q = Q
        .iter()
        .fold(0.037_776_183, |sum: f32, &c| sum.mul_add(t, c));
    let tail = 0.5 * t * q * exp(-u * u);
    if x < 0.0 { tail } else { 1.0 - tail }
}

#[inline(always)]
fn gelu(x: f32) -> f32 {
    x * normal(x)
}

#[inline(always)]
fn gelu_slope(x: f32) -> f32 {
    const DENSITY: f32 = 0.398_942_3; // 1/√(2π)
    (DENSITY * x).mul_add(exp(-0.5 * x * x), normal(x))
}

#[inline(always)]
fn swish(x: f32, beta: f32) -> f32 {
    x * sigmoid(beta * x)
}

#[inline(always)]
fn swish_slope(x: f32, beta: f32) -> f32 {
    let share = sigmoid(beta * x);
    (beta * x * share).mul_add(1.0 - share, share)
}

struct Map<'a> {
    x: &'a [f32],
    y: &'a mut [f32],
    curve: Curve,
}

impl WithSimd for Map<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let pairs = self.y.iter_mut().zip(self.x);
        match self.curve {
            Curve::Swish(beta) => pairs.for_each(|(y, &x)| *y = swish(x, beta)),
            Curve::Gelu => pairs.for_each(|(y, &x)| *y = gelu(x)),
        }
    }
}

struct MapBack<'a> {
    x: &'a [f32],
    dx: &'a mut [f32],
    curve: Curve,
}

impl WithSimd for MapBack<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let pairs = self.dx.iter_mut().zip(self.x);
        match self.curve {
            Curve::Swish(beta) => pairs.for_each(|(dx, &x)| *dx *= swish_slope(x, beta)),
            Curve::Gelu => pairs.for_each(|(dx, &x)| *dx *= gelu_slope(x)),
        }
    }
}

struct Gate<'a> {
    x: &'a [f32],
    y: &'a mut [f32],
    inner: usize,
}

impl WithSimd for Gate<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let tokens = self.x.chunks_exact(2 * self.inner);
        for (y, x) in self.y.chunks_exact_mut(self.inner).zip(tokens) {
            let (a, b) = x.split_at(self.inner);
            for (y, (&a, &b)) in y.iter_mut().zip(a.iter().zip(b)) {
                *y = a * gelu(b);
            }
        }
    }
}

struct GateBack<'a> {
    x: &'a [f32],
    dy: &'a [f32],
    dx: &'a mut [f32],
    inner: usize,
}

impl WithSimd for GateBack<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let inner = self.inner;
        let tokens = self
            .x
            .chunks_exact(2 * inner)
            .zip(self.dy.chunks_exact(inner));
        for (dx, (x, dy)) in self.dx.chunks_exact_mut(2 * inner).zip(tokens) {
            let (a, b) = x.split_at(inner);
            let (da, db) = dx.split_at_mut(inner);
            for (da, (&b, &dy)) in da.iter_mut().zip(b.iter().zip(dy)) {
                *da = dy * gelu(b);
            }
            for (db, ((&a, &b), &dy)) in db.iter_mut().zip(a.iter().zip(b).zip(dy)) {
                *db = dy * a * gelu_slope(b);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::noise;
    use super::*;

    /// Φ by its integral: Simpson's rule with 4,000 intervals from x to x + 12 (below −12 nothing is left in f32).
    fn integral(x: f64) -> f64 {
        let density = |x: f64| (-0.5 * x * x).exp() / std::f64::consts::TAU.sqrt();
        let (n, step) = (4000, 12.0 / 4000.0);
        let weight = |k: usize| match k {
            0 => 1.0,
            k if k == n => 1.0,
            k => [2.0, 4.0][k % 2],
        };
        let sum: f64 = (0..=n)
            .map(|k| weight(k) * density(x.abs() + k as f64 * step))
            .sum();
        let tail = sum * step / 3.0;
        if x < 0.0 { tail } else { 1.0 - tail }
    }

    #[test]
    fn the_normal_distribution_is_its_integral() {
        for k in -1100..=1100 {
            let x = k as f32 * 1e-2;
            let exact = integral(f64::from(x));
            // The exponential amplifies the rounding of its exponent −u².
            let units = 8.0 + f64::from(x.min(0.0) * x);
            let error = (f64::from(normal(x)) / exact - 1.0).abs();
            assert!(error < units * f64::from(f32::EPSILON), "{x}: {error:e}");
        }
        assert!(normal(f32::NAN).is_nan() && normal(-40.0).abs() < 1e-37);
        assert!((normal(1e30) - 1.0).abs() < f32::EPSILON);
    }

    /// Slopes equal the difference quotients of their curves in f64.
    #[test]
    fn slopes_are_difference_quotients() {
        let step = 1e-4;
        for k in -80..=80 {
            let x = 0.1 * f64::from(k);
            let gelu = |x: f64| x * integral(x);
            let swish = |x: f64| x / (1.0 + (-1.702 * x).exp());
            let quotient = |f: &dyn Fn(f64) -> f64| (f(x + step) - f(x - step)) / (2.0 * step);
            // Third derivatives are below 2, times the squared step over 6; the rest is rounding.
            let bound = 1e-8 + 8.0 * f64::from(f32::EPSILON);
            for (slope, quotient) in [
                (gelu_slope(x as f32), quotient(&gelu)),
                (swish_slope(x as f32, 1.702), quotient(&swish)),
            ] {
                assert!(
                    (f64::from(slope) - quotient).abs() < bound,
                    "{x}: {slope} {quotient}"
                );
            }
        }
    }

    /// Every element is computed for any number of elements, and the gate applies to every token.
    #[test]
    fn every_element_is_done() {
        for count in [0, 1, 7, PART - 1, PART, 3 * PART + 5] {
            let (x, dy) = (noise(count, 1), noise(count, 2));
            let (y, dx) = (
                map(&x, Curve::Gelu),
                map_gradient(&x, &dy, Curve::Swish(1.0)),
            );
            for i in 0..count {
                assert!((y[i] - gelu(x[i])).abs() < 1e-7);
                assert!((dx[i] - dy[i] * swish_slope(x[i], 1.0)).abs() < 1e-7);
            }
        }
        for (tokens, inner) in [(1, 3), (5, 7), (40, 512), (3, PART + 1)] {
            let (x, dy) = (noise(2 * tokens * inner, 3), noise(tokens * inner, 4));
            let (y, dx) = (gate(&x, inner), gate_gradient(&x, &dy, inner));
            for i in 0..tokens * inner {
                let (at, beside) = (i / inner * 2 * inner + i % inner, inner);
                let (a, b) = (x[at], x[at + beside]);
                assert!((y[i] - a * gelu(b)).abs() < 1e-7);
                assert!((dx[at] - dy[i] * gelu(b)).abs() < 1e-7);
                assert!((dx[at + beside] - dy[i] * a * gelu_slope(b)).abs() < 1e-7);
            }
        }
    }
}
