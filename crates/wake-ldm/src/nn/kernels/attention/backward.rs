//! The way back through attention.

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::super::product::{Rows, Target, multiply};
use super::super::sum::product_sum;
use super::super::tile;
use super::{Scores, Shape};

/// Gradients to query, key and value.
///
/// ```text
/// P = softmax(s Q Kᵀ),   dV = Pᵀ dO,   dP = dO Vᵀ
/// dS = s P ⊙ (dP − Σ_j P dP),   dQ = dS K,   dK = dSᵀ Q
/// ```
///
/// # Shapes
///
/// As [`attend`](super::attend); `gradient` as its result.
///
/// # References
///
/// Dao et al. (2022), "Fast and Memory-Efficient Exact Attention", appendix B.2.
pub(in crate::nn) fn gradients(
    [query, key, value]: [&[f32]; 3],
    gradient: &[f32],
    shape: &Shape,
) -> [Vec<f32>; 3] {
    let arch = Arch::new();
    let [asking, seen] = shape.tokens;
    let heads: Vec<_> = shape
        .heads_of_batch()
        .map(|[n, head]| {
            arch.dispatch(Backward {
                query: shape.head(query, asking, n, head),
                key: shape.head(key, seen, n, head),
                value: shape.head(value, seen, n, head),
                gradient: shape.head(gradient, asking, n, head),
                shape,
            })
        })
        .collect();
    let join = |of: usize, tokens: usize| {
        let depth = shape.depth();
        let mut out = vec![0.0; shape.batch * tokens * shape.channels];
        for (i, out) in out.chunks_exact_mut(shape.channels).enumerate() {
            for (head, out) in out.chunks_exact_mut(depth).enumerate() {
                let from = &heads[i / tokens * shape.heads + head][of];
                out.copy_from_slice(&from[i % tokens * depth..][..depth]);
            }
        }
        out
    };
    [join(0, asking), join(1, seen), join(2, seen)]
}

/// One head of one sequence, on the way back.
struct Backward<'a> {
    query: Rows<'a>,
    key: Rows<'a>,
    value: Rows<'a>,
    gradient: Rows<'a>,
    shape: &'a Shape,
}

impl WithSimd for Backward<'_> {
    type Output = [Vec<f32>; 3];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> [Vec<f32>; 3] {
        let (width, depth) = (tile::width::<S>(), self.shape.depth());
        let [asking, seen] = self.shape.tokens;
        let key_transposed = self.key.pack_transposed(depth, width);
        let value_transposed = self.value.pack_transposed(depth, width);
        let key = self.key.pack(depth, width);
        let mut out = [asking, seen, seen].map(|tokens| vec![0.0; tokens * depth]);
        let block = self.shape.block();
        for first in (0..asking).step_by(block) {
            let query = self.query.from(first, block);
            let gradient = self.gradient.from(first, block);
            let scores = Scores {
                query,
                key: &key_transposed,
                first,
                shape: self.shape,
            };
            let (mut weights, inverses) = scores.softmax(simd);
            for (weights, inverse) in weights.chunks_exact_mut(seen).zip(inverses) {
                for weight in weights {
                    *weight *= inverse;
                }
            }
            let mut slopes = vec![0.0; weights.len()];
            let mut target = rows_of(&mut slopes, seen, false);
            multiply(simd, &gradient, depth, &value_transposed, &mut target);
            through_softmax(&weights, &mut slopes, seen, self.shape.scale());

            let [dquery, dkey, dvalue] = &mut out;
            let rows = matrix(&slopes, seen);
            let mut target = rows_of(&mut dquery[first * depth..], depth, false);
            multiply(simd, &rows, seen, &key, &mut target);
            for (left, right, out) in [(&slopes, query, dkey), (&weights, gradient, dvalue)] {
                let left = transpose(left, seen);
                let right = right.pack(depth, width);
                let mut target = rows_of(out, depth, true);
                multiply(
                    simd,
                    &matrix(&left, query.count),
                    query.count,
                    &right,
                    &mut target,
                );
            }
        }
        out
    }
}

fn matrix(values: &[f32], columns: usize) -> Rows<'_> {
    Rows {
        values,
        step: columns,
        count: values.len() / columns,
    }
}

fn rows_of(values: &mut [f32], columns: usize, add: bool) -> Target<'_> {
    Target {
        values,
        step: columns,
        columns,
        add,
    }
}

/// From the gradient to the weights to the gradient to the scores before they were scaled.
#[inline(always)]
fn through_softmax(weights: &[f32], slopes: &mut [f32], seen: usize, scale: f32) {
    let rows = weights
        .chunks_exact(seen)
        .zip(slopes.chunks_exact_mut(seen));
    for (weights, slopes) in rows {
        let mean = product_sum(weights, slopes, |v| v);
        for (slope, weight) in slopes.iter_mut().zip(weights) {
            *slope = scale * weight * (*slope - mean);
        }
    }
}

/// `[rows, columns]` to `[columns, rows]`.
fn transpose(values: &[f32], columns: usize) -> Vec<f32> {
    const SQUARE: usize = 8;
    let rows = values.len() / columns;
    let mut out = vec![0.0; values.len()];
    for first in (0..columns).step_by(SQUARE) {
        let end = columns.min(first + SQUARE);
        for (i, row) in values.chunks_exact(columns).enumerate() {
            for (j, value) in row[first..end].iter().enumerate() {
                out[(first + j) * rows + i] = *value;
            }
        }
    }
    out
}
