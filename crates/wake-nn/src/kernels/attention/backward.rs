//! The way back through attention.

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::super::product::{Rows, Target, multiply};
use super::super::tile;
use super::Shape;
use super::forward::{TOKENS, add_values, exponentials, hide, products};

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
pub(crate) fn gradients(
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
        let mut out = [asking, seen, seen].map(|tokens| vec![0.0; tokens * depth]);
        // One column a query.
        let [mut weights, mut slopes] = [0, 1].map(|_| vec![0.0; seen * width]);
        for first in (0..asking).step_by(width) {
            let [query, gradient] = [self.query, self.gradient].map(|rows| rows.from(first, width));
            let columns = query.pack_transposed(depth, width);
            products::<S>(simd, &self.key, &columns, &mut weights);
            if self.shape.causal {
                hide(&mut weights, width, 0, first);
            }
            normalise::<S>(&mut weights, self.shape.scale());
            let columns = gradient.pack_transposed(depth, width);
            products::<S>(simd, &self.value, &columns, &mut slopes);
            through_softmax::<S>(&weights, &mut slopes, self.shape.scale());

            let [dquery, dkey, dvalue] = &mut out;
            let mut sums = vec![0.0; depth * width];
            add_values::<S>(simd, &self.key, &slopes, depth, &mut sums);
            let rows = dquery[first * depth..]
                .chunks_exact_mut(depth)
                .take(query.count);
            for (j, row) in rows.enumerate() {
                let column = sums[j..].iter().step_by(width);
                row.iter_mut()
                    .zip(column)
                    .for_each(|(out, sum)| *out = *sum);
            }
            for (left, right, out) in [(&slopes, query, dkey), (&weights, gradient, dvalue)] {
                let left = Rows {
                    values: left,
                    step: width,
                    count: seen,
                };
                let mut target = Target {
                    values: out,
                    step: depth,
                    columns: depth,
                    add: true,
                };
                let packed = right.pack(depth, width);
                multiply(simd, &left, right.count, &packed, &mut target);
            }
        }
        out
    }
}

/// From scores to weights: the softmax of every column.
#[inline(always)]
fn normalise<S: Simd>(scores: &mut [f32], scale: f32) {
    let width = tile::width::<S>();
    let [mut largest, mut totals] = [f32::NEG_INFINITY, 0.0].map(|x| vec![x; width]);
    exponentials::<S>(scores, &mut largest, &mut totals, scale);
    for total in &mut totals {
        *total = 1.0 / *total;
    }
    for row in scores.chunks_exact_mut(width) {
        for (weight, inverse) in row.iter_mut().zip(&totals) {
            *weight *= inverse;
        }
    }
}

/// From the gradient to the weights to the gradient to the scores before they were scaled.
#[inline(always)]
fn through_softmax<S: Simd>(weights: &[f32], slopes: &mut [f32], scale: f32) {
    let width = tile::width::<S>();
    let mut means = vec![0.0; width];
    let blocks = weights.chunks(TOKENS * width);
    for (weights, slopes) in blocks.zip(slopes.chunks(TOKENS * width)) {
        let mut sums = vec![0.0; width];
        for (weights, slopes) in weights.chunks_exact(width).zip(slopes.chunks_exact(width)) {
            for ((sum, weight), slope) in sums.iter_mut().zip(weights).zip(slopes) {
                *sum += weight * slope;
            }
        }
        for (mean, sum) in means.iter_mut().zip(sums) {
            *mean += sum;
        }
    }
    let rows = weights
        .chunks_exact(width)
        .zip(slopes.chunks_exact_mut(width));
    for (weights, slopes) in rows {
        for ((slope, weight), mean) in slopes.iter_mut().zip(weights).zip(&means) {
            *slope = scale * weight * (*slope - mean);
        }
    }
}
