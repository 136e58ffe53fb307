//! Normalisation of every token over its channels, and its gradients, in one pass over memory each.

use pulp::{Simd, WithSimd};
use rayon::prelude::*;

use super::arch::arch;
use super::sum::{product_sum, sum};
use crate::kernels::zeros;

/// Elements that one core processes at a time.
const PART: usize = 1 << 14;
/// Columns that one core sums at a time.
const COLUMNS: usize = 64;

/// Mean and 1 / √(variance + ε) of every token.
pub(crate) type Moments = Vec<[f32; 2]>;

/// Normalises tokens to mean 0 and variance 1, then scales and shifts every channel.
///
/// ```text
/// y = (x − μ) / √(σ² + ε) · γ + β        μ, σ²: mean and variance of the token
/// ```
///
/// # Shapes
///
/// - `x`: `[tokens, channels]`; `parameters`: γ and β, `[channels]` each
/// - result: as `x`, and the moments `[tokens]`
pub(crate) fn normalize(x: &[f32], parameters: [&[f32]; 2], epsilon: f32) -> (Vec<f32>, Moments) {
    let channels = parameters[0].len();
    let tokens = (PART / channels).max(1);
    let mut y = zeros(x.len());
    let mut moments = vec![[0.0; 2]; x.len() / channels];
    let arch = arch();
    y.par_chunks_mut(tokens * channels)
        .zip(x.par_chunks(tokens * channels))
        .zip(moments.par_chunks_mut(tokens))
        .for_each(|((y, x), moments)| {
            arch.dispatch(Forward {
                x,
                parameters,
                epsilon,
                y,
                moments,
            });
        });
    (y, moments)
}

/// Some tokens in the forward pass.
struct Forward<'a> {
    x: &'a [f32],
    parameters: [&'a [f32]; 2],
    epsilon: f32,
    y: &'a mut [f32],
    moments: &'a mut [[f32; 2]],
}

impl WithSimd for Forward<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let [weight, bias] = self.parameters;
        let channels = weight.len();
        let tokens = self.x.chunks_exact(channels);
        let outs = self.y.chunks_exact_mut(channels).zip(self.moments);
        for (x, (y, moments)) in tokens.zip(outs) {
            let mean = sum(x, |v| v) / channels as f32;
            let variance = sum(x, |v| (v - mean) * (v - mean)) / channels as f32;
            let inverse = 1.0 / (variance + self.epsilon).sqrt();
            for ((y, x), (weight, bias)) in y.iter_mut().zip(x).zip(weight.iter().zip(bias)) {
                *y = ((x - mean) * inverse).mul_add(*weight, *bias);
            }
            *moments = [mean, inverse];
        }
    }
}

/// Gradient with respect to the tokens.
///
/// ```text
/// dx = r (γ dy − ⟨γ dy⟩ − x̂ ⟨γ dy x̂⟩)        x̂ = (x − μ) r,   ⟨·⟩: mean over the token
/// ```
///
/// # Shapes
///
/// - `x`, `dy`: `[tokens, channels]`; `weight`: γ, `[channels]`; `moments`: from [`normalize`]
/// - result: as `x`
pub(crate) fn to_input(x: &[f32], dy: &[f32], weight: &[f32], moments: &[[f32; 2]]) -> Vec<f32> {
    let channels = weight.len();
    let tokens = (PART / channels).max(1);
    let mut dx = zeros(x.len());
    let arch = arch();
    dx.par_chunks_mut(tokens * channels)
        .zip(x.par_chunks(tokens * channels))
        .zip(dy.par_chunks(tokens * channels))
        .zip(moments.par_chunks(tokens))
        .for_each(|(((dx, x), dy), moments)| {
            arch.dispatch(Backward {
                x,
                dy,
                weight,
                moments,
                dx,
            });
        });
    dx
}

/// Some tokens in the backward pass.
struct Backward<'a> {
    x: &'a [f32],
    dy: &'a [f32],
    weight: &'a [f32],
    moments: &'a [[f32; 2]],
    dx: &'a mut [f32],
}

impl WithSimd for Backward<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let channels = self.weight.len();
        let tokens = self.x.chunks_exact(channels);
        let outs = self.dx.chunks_exact_mut(channels).zip(self.moments);
        for ((x, dy), (dx, [mean, inverse])) in tokens.zip(self.dy.chunks_exact(channels)).zip(outs)
        {
            for ((dx, dy), weight) in dx.iter_mut().zip(dy).zip(self.weight) {
                *dx = dy * weight;
            }
            let slope = sum(dx, |v| v) / channels as f32;
            let along = product_sum(dx, x, |x| (x - mean) * inverse) / channels as f32;
            for (dx, x) in dx.iter_mut().zip(x) {
                *dx = inverse * (*dx - slope - (x - mean) * inverse * along);
            }
        }
    }
}

/// Gradients with respect to γ, `Σ dy x̂`, and to β, `Σ dy`, over all tokens: `[channels]` each.
pub(crate) fn to_parameters(
    x: &[f32],
    dy: &[f32],
    moments: &[[f32; 2]],
    channels: usize,
) -> [Vec<f32>; 2] {
    let [mut weight, mut bias] = [0; 2].map(|_| vec![0.0; channels]);
    weight
        .par_chunks_mut(COLUMNS)
        .zip(bias.par_chunks_mut(COLUMNS))
        .enumerate()
        .for_each(|(n, (weight, bias))| {
            let rows = x.chunks_exact(channels).zip(dy.chunks_exact(channels));
            for ((x, dy), [mean, inverse]) in rows.zip(moments) {
                let values = x[n * COLUMNS..].iter().zip(&dy[n * COLUMNS..]);
                for ((weight, bias), (x, dy)) in weight.iter_mut().zip(&mut *bias).zip(values) {
                    *weight += dy * (x - mean) * inverse;
                    *bias += dy;
                }
            }
        });
    [weight, bias]
}
