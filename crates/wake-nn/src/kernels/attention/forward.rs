//! Forward pass of attention: a tile holds queries side by side, and tokens are processed in turn.

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::super::product::Rows;
use super::super::silu::exp;
use super::super::tile::{self, ROWS, WIDE};
use super::Shape;
use crate::kernels::zeros;

/// Tokens whose scores are held at a time, a multiple of a tile's rows: the scores of 32 queries take 24 KiB, the scores of 64
/// queries 48 KiB.
pub(super) const TOKENS: usize = 32 * ROWS;

/// Computes attention; see [`attention`](crate::attention::attention).
///
/// Keys and values are read in place: the scores are computed as `K Qᵀ`, with one column per query, which is the layout
/// that the second product `Vᵀ P` needs.
///
/// # Shapes
///
/// - `query`: `[batch, tokens, channels]`; `key`, `value`: `[batch, tokens of the context, channels]`
/// - result: as `query`, and the softmax statistics `[batch, tokens, heads]`
///
/// # References
///
/// Dao et al. (2022), "Fast and Memory-Efficient Exact Attention", algorithm 1 (running maximum of the scores, with sums
/// rescaled whenever it grows).
pub(crate) fn attend(
    query: &[f32],
    key: &[f32],
    value: &[f32],
    shape: &Shape,
) -> (Vec<f32>, Vec<Softmax>) {
    let vectors = Arch::new().dispatch(Vectors(shape));
    blocks([query, key, value], shape, vectors)
}

/// Number of vectors of queries in a tile: a wide one, unless places would stay empty or cores idle.
struct Vectors<'a>(&'a Shape);

impl WithSimd for Vectors<'_> {
    type Output = usize;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> usize {
        let asking = self.0.tokens[0];
        let tasks = self.0.batch * asking.div_ceil(WIDE * S::F32_LANES);
        match S::REGISTER_COUNT {
            32.. if fills_wide::<S>(asking) && tasks >= 2 * rayon::current_num_threads() => WIDE,
            _ => 2,
        }
    }
}

/// True if wide tiles have no more empty places than tiles of two vectors.
pub(super) fn fills_wide<S: Simd>(tokens: usize) -> bool {
    let [few, many] = [2, WIDE].map(|vectors| tokens.next_multiple_of(vectors * S::F32_LANES));
    few == many
}

/// Attention in blocks of as many queries as `vectors` hold.
fn blocks(
    [query, key, value]: [&[f32]; 3],
    shape: &Shape,
    vectors: usize,
) -> (Vec<f32>, Vec<Softmax>) {
    let arch = Arch::new();
    let block = arch.dispatch(tile::Width) / 2 * vectors;
    let [asking, seen] = shape.tokens;
    let mut out = zeros(query.len());
    let mut softmaxes = vec![Softmax::default(); shape.batch * asking * shape.heads];
    out.par_chunks_mut(asking * shape.channels)
        .zip(softmaxes.par_chunks_mut(asking * shape.heads))
        .enumerate()
        .for_each(|(n, (out, softmaxes))| {
            out.par_chunks_mut(block * shape.channels)
                .zip(softmaxes.par_chunks_mut(block * shape.heads))
                .enumerate()
                .for_each(|(i, (out, softmaxes))| {
                    for head in 0..shape.heads {
                        arch.dispatch(Forward {
                            softmaxes: &mut softmaxes[head..],
                            query: shape.head(query, asking, n, head).from(i * block, block),
                            key: shape.head(key, seen, n, head),
                            value: shape.head(value, seen, n, head),
                            first: i * block,
                            shape,
                            vectors,
                            out: &mut out[head * shape.depth()..],
                        });
                    }
                });
        });
    (out, softmaxes)
}

/// Largest score and inverse sum of one query, which turn its scores x into weights: `e^(s (x − largest)) · inverse`.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Softmax {
    pub(super) largest: f32,
    /// One over the sum of exponentials.
    pub(super) inverse: f32,
}

/// Queries of one head, at most a tile's width of them.
struct Forward<'a> {
    /// Statistics of the queries, as far apart as there are heads.
    softmaxes: &'a mut [Softmax],
    query: Rows<'a>,
    key: Rows<'a>,
    value: Rows<'a>,
    /// Position of the first query in its sequence.
    first: usize,
    shape: &'a Shape,
    /// Vectors of queries.
    vectors: usize,
    out: &'a mut [f32],
}

impl WithSimd for Forward<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        match self.vectors {
            WIDE => self.run::<S, WIDE>(simd),
            _ => self.run::<S, 2>(simd),
        }
    }
}

impl Forward<'_> {
    /// Attends with tiles of V vectors.
    #[inline(always)]
    fn run<S: Simd, const V: usize>(self, simd: S) {
        let (width, depth) = (V * S::F32_LANES, self.shape.depth());
        let query = self.query.pack_transposed(depth, width);
        let mut scores = vec![0.0; TOKENS.min(self.key.count) * width];
        // For each query: the weighted sum of values, the largest score and the sum of exponentials.
        let mut sums = vec![0.0; depth * width];
        let mut largest = vec![f32::NEG_INFINITY; width];
        let mut totals = vec![0.0; width];
        let last = self.first + self.query.count;
        let seen = match self.shape.causal {
            true => self.key.count.min(last),
            false => self.key.count,
        };
        for first in (0..seen).step_by(TOKENS) {
            let count = TOKENS.min(seen - first);
            let scores = &mut scores[..count * width];
            products::<S, V>(simd, &self.key.from(first, count), &query, scores);
            if self.shape.causal {
                hide(scores, width, first, self.first);
            }
            let shrunk = exponentials(scores, &mut largest, &mut totals, self.shape.scale());
            for sums in sums.chunks_exact_mut(width) {
                for (sum, shrunk) in sums.iter_mut().zip(&shrunk) {
                    *sum *= shrunk;
                }
            }
            add_values::<S, V>(
                simd,
                &self.value.from(first, count),
                scores,
                depth,
                &mut sums,
            );
        }
        let rows = self.out.chunks_mut(self.shape.channels);
        let softmaxes = self.softmaxes.iter_mut().step_by(self.shape.heads);
        for (j, (out, softmax)) in rows.zip(softmaxes).take(self.query.count).enumerate() {
            let (total, sums) = (totals[j], sums[j..].iter().step_by(width));
            for (out, sum) in out[..depth].iter_mut().zip(sums) {
                *out = sum / total;
            }
            *softmax = Softmax {
                largest: largest[j],
                inverse: 1.0 / total,
            };
        }
    }
}

/// `scores[k][j] = Σ_d key[k][d] · query[d][j]`
#[inline(always)]
pub(super) fn products<S: Simd, const V: usize>(
    simd: S,
    key: &Rows<'_>,
    query: &[f32],
    scores: &mut [f32],
) {
    let width = V * S::F32_LANES;
    let depth = query.len() / width;
    for (tile, scores) in scores.chunks_mut(ROWS * width).enumerate() {
        let mut rows = [key.values; ROWS];
        for (i, row) in rows.iter_mut().enumerate() {
            *row = key.get(tile * ROWS + i, depth);
        }
        let mut sums = [[simd.splat_f32s(0.0); V]; ROWS];
        tile::multiply(simd, rows, 0, query, &mut sums);
        for (sum, scores) in sums.into_iter().zip(scores.chunks_exact_mut(width)) {
            tile::store::<S, _>(sum, scores);
        }
    }
}

/// Masks tokens after their query.
fn hide(scores: &mut [f32], width: usize, first_token: usize, first_query: usize) {
    for (k, scores) in scores.chunks_exact_mut(width).enumerate() {
        let before = (first_token + k).saturating_sub(first_query).min(width);
        scores[..before].fill(f32::NEG_INFINITY);
    }
}

/// Replaces each x by `e^(s (x − m))`, where m is the largest score of its query so far, and returns the factors by which
/// the earlier sums of each query must be multiplied.
#[inline(always)]
fn exponentials(
    scores: &mut [f32],
    largest: &mut [f32],
    totals: &mut [f32],
    scale: f32,
) -> Vec<f32> {
    let width = largest.len();
    let mut shrunk = largest.to_vec();
    for row in scores.chunks_exact(width) {
        for (max, &x) in largest.iter_mut().zip(row) {
            *max = if x > *max { x } else { *max };
        }
    }
    for ((shrunk, total), max) in shrunk.iter_mut().zip(totals.iter_mut()).zip(&*largest) {
        *shrunk = exp((*shrunk - max) * scale);
        *total *= *shrunk;
    }
    // Block by block, to keep running sums short.
    for block in scores.chunks_mut(TOKENS * width) {
        let mut sums = vec![0.0; width];
        for row in block.chunks_exact_mut(width) {
            for ((x, sum), max) in row.iter_mut().zip(&mut sums).zip(&*largest) {
                *x = exp((*x - max) * scale);
                *sum += *x;
            }
        }
        for (total, sum) in totals.iter_mut().zip(sums) {
            *total += sum;
        }
    }
    shrunk
}

/// `sums[d][j] += Σ_k value[k][d] · weights[k][j]`
#[inline(always)]
pub(super) fn add_values<S: Simd, const V: usize>(
    simd: S,
    value: &Rows<'_>,
    weights: &[f32],
    depth: usize,
    sums: &mut [f32],
) {
    let width = V * S::F32_LANES;
    for first in (0..depth).step_by(ROWS) {
        // The last tile starts earlier where possible, and only its new rows are kept.
        let from = first.min(depth.saturating_sub(ROWS));
        let mut tile = [[simd.splat_f32s(0.0); V]; ROWS];
        tile::multiply_columns(
            simd,
            value.values,
            value.step,
            from..depth,
            weights,
            &mut tile,
        );
        let rows = sums[first * width..].chunks_exact_mut(width);
        for (tile, sums) in tile.into_iter().skip(first - from).zip(rows) {
            let before: [_; V] = tile::load(simd, sums);
            let sum = std::array::from_fn(|n| simd.add_f32s(before[n], tile[n]));
            tile::store::<S, V>(sum, sums);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::noise;

    /// Wide tiles give the same bits, for whole blocks of queries and for a part of one.
    #[test]
    fn wide_tiles_change_nothing() {
        for tokens in [[128, 77], [70, 200], [5, 5]] {
            let shape = Shape {
                batch: 2,
                heads: 2,
                channels: 22,
                tokens,
                causal: tokens[0] == tokens[1],
            };
            let [query, context] = tokens.map(|count| noise(2 * count * 22, 7));
            let of = |vectors| blocks([&query, &context, &context], &shape, vectors).0;
            assert!(of(WIDE) == of(2), "{tokens:?}");
        }
    }
}
