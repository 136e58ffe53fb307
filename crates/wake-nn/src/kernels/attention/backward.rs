//! Backward pass of attention: a tile holds tokens side by side, and queries are processed in turn.

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::super::product::{Rows, Target, multiply};
use super::super::silu::exp;
use super::super::tile::{self, WIDE};
use super::Shape;
use super::forward::{Softmax, TOKENS, add_values, fills_wide, products};
use crate::kernels::zeros;

/// Queries whose weights are held at a time: as many as tokens in the forward pass.
const QUERIES: usize = TOKENS;

/// Result of an attention, and the softmax statistics that its gradients need.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Attended<'a> {
    pub(crate) values: &'a [f32],
    pub(crate) softmax: &'a [Softmax],
}

/// Gradients with respect to query, key and value.
///
/// ```text
/// P = softmax(s Q Kᵀ),   dV = Pᵀ dO,   dP = dO Vᵀ
/// dS = s P ⊙ (dP − dO · O),   dQ = dS K,   dK = dSᵀ Q
/// ```
///
/// # Shapes
///
/// As for [`attend`](super::attend), whose result is `attended`; `gradient` has the shape of its values.
///
/// # References
///
/// Dao et al. (2022), "Fast and Memory-Efficient Exact Attention", algorithm 4 and appendix B.2.
pub(crate) fn gradients(
    [query, key, value]: [&[f32]; 3],
    attended: Attended<'_>,
    gradient: &[f32],
    shape: &Shape,
) -> [Vec<f32>; 3] {
    let arch = Arch::new();
    let [asking, seen] = shape.tokens;
    let heads: Vec<_> = shape
        .heads_of_batch()
        .map(|[n, head]| {
            let softmax = attended.softmax[n * asking * shape.heads..]
                .iter()
                .skip(head)
                .step_by(shape.heads);
            arch.dispatch(Backward {
                query: shape.head(query, asking, n, head),
                key: shape.head(key, seen, n, head),
                value: shape.head(value, seen, n, head),
                result: shape.head(attended.values, asking, n, head),
                softmax: softmax.take(asking).copied().collect(),
                gradient: shape.head(gradient, asking, n, head),
                shape,
            })
        })
        .collect();
    let join = |of: usize, tokens: usize| {
        let depth = shape.depth();
        let mut out = zeros(shape.batch * tokens * shape.channels);
        out.par_chunks_exact_mut(shape.channels)
            .enumerate()
            .with_min_len(64)
            .for_each(|(i, out)| {
                for (head, out) in out.chunks_exact_mut(depth).enumerate() {
                    let from = &heads[i / tokens * shape.heads + head][of];
                    out.copy_from_slice(&from[i % tokens * depth..][..depth]);
                }
            });
        out
    };
    [join(0, asking), join(1, seen), join(2, seen)]
}

/// One head of one sequence in the backward pass.
struct Backward<'a> {
    query: Rows<'a>,
    key: Rows<'a>,
    value: Rows<'a>,
    result: Rows<'a>,
    softmax: Vec<Softmax>,
    gradient: Rows<'a>,
    shape: &'a Shape,
}

impl WithSimd for Backward<'_> {
    type Output = [Vec<f32>; 3];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> [Vec<f32>; 3] {
        match S::REGISTER_COUNT {
            32.. if fills_wide::<S>(self.shape.tokens[1]) => self.run::<S, WIDE>(simd),
            _ => self.run::<S, 2>(simd),
        }
    }
}

impl Backward<'_> {
    /// Computes the gradients with tiles of V vectors.
    #[inline(always)]
    fn run<S: Simd, const V: usize>(self, simd: S) -> [Vec<f32>; 3] {
        let (width, depth) = (V * S::F32_LANES, self.shape.depth());
        let scale = self.shape.scale();
        let [asking, seen] = self.shape.tokens;
        let mut out = [asking, seen, seen].map(|tokens| vec![0.0; tokens * depth]);
        let [dquery, dkey, dvalue] = &mut out;
        // dO · O of each query.
        let means: Vec<f32> = (0..asking)
            .map(|i| {
                let [a, b] = [self.gradient, self.result].map(|rows| rows.get(i, depth));
                a.iter().zip(b).map(|(a, b)| a * b).sum()
            })
            .collect();
        // One column per token.
        let [mut weights, mut slopes] = [0; 2].map(|_| vec![0.0; QUERIES.min(asking) * width]);
        for token in (0..seen).step_by(width) {
            let [key, value] = [self.key, self.value].map(|rows| rows.from(token, width));
            let keys = key.pack_transposed(depth, width);
            let values = value.pack_transposed(depth, width);
            let right = key.pack(depth, tile::width::<S>());
            let [mut of_key, mut of_value] = [0; 2].map(|_| vec![0.0; depth * width]);
            // Queries before a token do not attend to it.
            let begin = if self.shape.causal { token } else { 0 };
            for first in (begin..asking).step_by(QUERIES) {
                let count = QUERIES.min(asking - first);
                let [query, gradient] =
                    [self.query, self.gradient].map(|rows| rows.from(first, count));
                let weights = &mut weights[..count * width];
                let slopes = &mut slopes[..count * width];
                products::<S, V>(simd, &query, &keys, weights);
                if self.shape.causal {
                    for (i, row) in weights.chunks_exact_mut(width).enumerate() {
                        let visible = (first + i + 1 - token).min(width);
                        row[visible..].fill(f32::NEG_INFINITY);
                    }
                }
                products::<S, V>(simd, &gradient, &values, slopes);
                let rows = weights
                    .chunks_exact_mut(width)
                    .zip(slopes.chunks_exact_mut(width));
                let of_query = self.softmax[first..].iter().zip(&means[first..]);
                for ((weights, slopes), (softmax, mean)) in rows.zip(of_query) {
                    let Softmax { largest, inverse } = *softmax;
                    for (weight, slope) in weights.iter_mut().zip(slopes) {
                        *weight = exp((*weight - largest) * scale) * inverse;
                        *slope = scale * *weight * (*slope - mean);
                    }
                }
                add_values::<S, V>(simd, &gradient, weights, depth, &mut of_value);
                add_values::<S, V>(simd, &query, slopes, depth, &mut of_key);
                let left = Rows {
                    values: slopes,
                    step: width,
                    count,
                };
                let mut target = Target {
                    values: &mut dquery[first * depth..],
                    step: depth,
                    columns: depth,
                    add: true,
                };
                multiply(simd, &left, key.count, &right, &mut target);
            }
            for (sums, out) in [(of_key, &mut *dkey), (of_value, &mut *dvalue)] {
                let rows = out[token * depth..].chunks_exact_mut(depth);
                for (j, row) in rows.take(key.count).enumerate() {
                    let column = sums[j..].iter().step_by(width);
                    row.iter_mut()
                        .zip(column)
                        .for_each(|(out, sum)| *out = *sum);
                }
            }
        }
        out
    }
}
