//! Matrix products of a linear layer and its gradients.
//!
//! Every task computes some rows and columns of a product, one stretch of the depth at a time: its columns of the right
//! factor are packed by tiles, which stay in a core's L2 cache, and rows of the left factor are read in place.

use std::ops::Range;

use pulp::{Simd, WithSimd};
use rayon::prelude::*;

use super::arch::arch;
use super::columns::columns;
use super::product::Rows;
use super::tile::{self, ROWS, WIDE};
use crate::kernels::zeros;

/// Rows multiplied with one tile of the right factor before the next, a multiple of a tile's rows.
const BLOCK: usize = 8 * ROWS;
/// Numbers of a row that are multiplied at a time, and columns that one core multiplies: together 480 KiB of its L2 cache. With fewer
/// numbers, sums are read and written more often than their latency is hidden.
const DEPTH: usize = 320;
const COLUMNS: usize = 384;
/// Largest number of rows for which the work is split by columns first: [`DEPTH`] numbers of each row fit into an L2 cache.
const FEW: usize = 800;
/// Least number of columns per task with few rows.
const NARROW: usize = 128;
/// Columns of a task are a multiple of this number, and so of the columns of a tile on every machine.
const TILES: usize = 64;
/// Columns that one core sums at a time.
const SUMMED: usize = 128;

/// Sizes of a layer: rows, input channels and output channels.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sizes {
    pub(crate) rows: usize,
    pub(crate) from: usize,
    pub(crate) to: usize,
}

/// `x W + b`.
///
/// # Shapes
///
/// `x`: `[rows, from]`, `weight`: `[from, to]`, `bias`: `[to]`; result: `[rows, to]`
pub(crate) fn forward(x: &[f32], weight: &[f32], bias: Option<&[f32]>, sizes: Sizes) -> Vec<f32> {
    product(
        x,
        Factor::Plain(weight),
        bias,
        [sizes.rows, sizes.from, sizes.to],
    )
}

/// Gradient with respect to x: `g Wᵀ`, `[rows, from]`.
pub(crate) fn to_input(gradient: &[f32], weight: &[f32], sizes: Sizes) -> Vec<f32> {
    let sizes = [sizes.rows, sizes.to, sizes.from];
    product(gradient, Factor::Transposed(weight), None, sizes)
}

/// Gradient with respect to W: `xᵀ g`, `[from, to]`.
pub(crate) fn to_weight(x: &[f32], gradient: &[f32], sizes: Sizes) -> Vec<f32> {
    let left = transposed(x, sizes.rows, sizes.from);
    let sizes = [sizes.from, sizes.rows, sizes.to];
    product(&left, Factor::Plain(gradient), None, sizes)
}

/// Gradient with respect to b: the sum over all rows, `[to]`.
pub(crate) fn to_bias(gradient: &[f32], to: usize) -> Vec<f32> {
    let mut sums = vec![0.0; to];
    sums.par_chunks_mut(SUMMED)
        .enumerate()
        .for_each(|(n, sums)| {
            for row in gradient.chunks_exact(to) {
                for (sum, value) in sums.iter_mut().zip(&row[n * SUMMED..]) {
                    *sum += value;
                }
            }
        });
    sums
}

/// Transposes a matrix `[rows, columns]` to `[columns, rows]`.
fn transposed(matrix: &[f32], rows: usize, columns: usize) -> Vec<f32> {
    let mut out = zeros(matrix.len());
    out.par_chunks_mut(rows * ROWS)
        .enumerate()
        .for_each(|(n, out)| {
            for (i, row) in matrix.chunks_exact(columns).enumerate() {
                let values = &row[n * ROWS..columns.min((n + 1) * ROWS)];
                for (out, value) in out.chunks_exact_mut(rows).zip(values) {
                    out[i] = *value;
                }
            }
        });
    out
}

/// A matrix as it lies in memory, or its transpose.
#[derive(Debug, Clone, Copy)]
enum Factor<'a> {
    Plain(&'a [f32]),
    Transposed(&'a [f32]),
}

/// Product of two matrices, plus a bias for every column.
///
/// # Shapes
///
/// Factors: `[rows, depth]` and `[depth, columns]`; result: `[rows, columns]`
fn product(left: &[f32], right: Factor<'_>, bias: Option<&[f32]>, sizes: [usize; 3]) -> Vec<f32> {
    let [rows, _, wide] = sizes;
    // Every task packs its columns again: take as many rows per task as leave four tasks per core. With few rows, packing takes
    // a good part of the time: split columns first, and leave two tasks per core.
    let cores = rayon::current_num_threads();
    let (wanted, block) = match rows > FEW {
        true => (4 * cores, COLUMNS),
        false => {
            let share = wide / (4 * cores);
            let block = share - share % TILES;
            (2 * cores, block.clamp(NARROW, COLUMNS))
        }
    };
    let shares = wanted.div_ceil(wide.div_ceil(block));
    let many = rows.div_ceil(shares).next_multiple_of(BLOCK);
    let mut out = zeros(rows * wide);
    columns(&mut out, wide, block)
        .par_iter_mut()
        .enumerate()
        .for_each(|(n, out)| {
            out.par_chunks_mut(many).enumerate().for_each(|(m, out)| {
                arch().dispatch(Task {
                    left,
                    right,
                    bias,
                    sizes,
                    first: [m * many, n * block],
                    out,
                });
            });
        });
    out
}

/// Some rows and columns of a product.
struct Task<'a, 'b> {
    left: &'a [f32],
    right: Factor<'a>,
    bias: Option<&'a [f32]>,
    /// Rows, depth and columns of the whole product.
    sizes: [usize; 3],
    /// The first row and column.
    first: [usize; 2],
    /// The columns of this task in each of its rows.
    out: &'a mut [&'b mut [f32]],
}

impl WithSimd for Task<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        match S::REGISTER_COUNT {
            32.. => self.run::<S, WIDE>(simd),
            _ => self.run::<S, 2>(simd),
        }
    }
}

impl Task<'_, '_> {
    /// Computes the product with tiles of V vectors.
    #[inline(always)]
    fn run<S: Simd, const V: usize>(mut self, simd: S) {
        let (width, depth) = (V * S::F32_LANES, self.sizes[1]);
        let tiles = self.out[0].len().div_ceil(width);
        let mut packed = vec![0.0; tiles * DEPTH.min(depth) * width];
        for first in (0..depth).step_by(DEPTH) {
            let count = DEPTH.min(depth - first);
            let packed = &mut packed[..tiles * count * width];
            self.pack(first, count, width, packed);
            for row in (0..self.out.len()).step_by(BLOCK) {
                for (tile, panel) in packed.chunks_exact(count * width).enumerate() {
                    for row in (row..self.out.len().min(row + BLOCK)).step_by(ROWS) {
                        self.multiply::<S, V>(simd, [row, first, tile], panel);
                    }
                }
            }
        }
    }

    /// Packs a stretch of the depth of this task's columns of the right factor: `[tile, depth, column]`.
    fn pack(&self, first: usize, count: usize, width: usize, packed: &mut [f32]) {
        let [_, depth, columns] = self.sizes;
        let begin = self.first[1] / width;
        for (tile, packed) in packed.chunks_exact_mut(count * width).enumerate() {
            match self.right {
                Factor::Plain(values) => Rows {
                    values: &values[first * columns..],
                    step: columns,
                    count,
                }
                .pack_tile(begin + tile, columns, width, packed),
                Factor::Transposed(values) => Rows {
                    values: &values[first..],
                    step: depth,
                    count: columns,
                }
                .pack_tile_transposed(begin + tile, count, width, packed),
            }
        }
    }

    /// Adds the product of six rows and one tile over a stretch of the depth, beginning at `first`.
    #[inline(always)]
    fn multiply<S: Simd, const V: usize>(
        &mut self,
        simd: S,
        [row, first, tile]: [usize; 3],
        panel: &[f32],
    ) {
        let (width, depth) = (V * S::F32_LANES, self.sizes[1]);
        let of_tile = tile * width..self.out[0].len().min((tile + 1) * width);
        let end = self.out.len().min(row + ROWS);
        let (top, last) = (self.first[0] + row, self.first[0] + end - 1);
        let count = panel.len() / width;
        let of = |i: usize| &self.left[(top + i).min(last) * depth + first..][..count];
        let factors = (std::array::from_fn(of), panel);
        let is_first = first == 0;
        let begin = self.bias.filter(|_| is_first);
        let begin = begin.map(|bias| &bias[self.first[1]..][of_tile.clone()]);
        let out = &mut self.out[row..end];
        match out.first_chunk_mut::<ROWS>() {
            // Sums of a known number of rows stay in registers.
            Some(out) => add::<S, V>(simd, factors, begin, is_first, &mut out[..], of_tile),
            None => add::<S, V>(simd, factors, begin, is_first, out, of_tile),
        }
    }
}

/// Adds the product of some rows and a panel to their numbers in the columns `of_tile`.
///
/// - `begin`: what the sums begin with; without it they continue from `out`, or begin with 0 in the first stretch of the depth
#[inline(always)]
fn add<S: Simd, const V: usize>(
    simd: S,
    (rows, panel): ([&[f32]; ROWS], &[f32]),
    begin: Option<&[f32]>,
    is_first: bool,
    out: &mut [&mut [f32]],
    of_tile: Range<usize>,
) {
    let mut sums = [[simd.splat_f32s(0.0); V]; ROWS];
    for (sum, out) in sums.iter_mut().zip(&*out) {
        *sum = match begin {
            Some(begin) => tile::load(simd, begin),
            None if is_first => *sum,
            None => tile::load(simd, &out[of_tile.clone()]),
        };
    }
    tile::multiply(simd, rows, 0, panel, &mut sums);
    for (sum, out) in sums.into_iter().zip(out) {
        tile::store::<S, V>(sum, &mut out[of_tile.clone()]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::noise;

    /// Every product against sums in f64, on sizes that fill tiles, blocks and stretches and on sizes that do not.
    #[test]
    fn products_are_sums() {
        for (rows, from, to) in [
            (1, 1, 1),
            (5, 7, 33),
            (50, 200, 70),
            (97, 385, 64),
            (20, 700, 800),
            (500, 20, 150),
            (850, 20, 400),
        ] {
            let sizes = Sizes { rows, from, to };
            let (x, weight) = (noise(rows * from, 1), noise(from * to, 2));
            let (bias, gradient) = (noise(to, 3), noise(rows * to, 4));
            let sum = |count: usize, term: &dyn Fn(usize) -> [f32; 2]| -> f64 {
                let terms = (0..count).map(term);
                terms.map(|[a, b]| f64::from(a) * f64::from(b)).sum()
            };
            let near = |found: &[f32],
                        columns: usize,
                        count: usize,
                        exact: &dyn Fn(usize, usize) -> f64| {
                for (n, value) in found.iter().enumerate() {
                    let exact = exact(n / columns, n % columns);
                    // As many roundings as terms, of sums below a quarter of their number.
                    let allowed = 6e-8 * (1.0 + count as f64).powf(1.5);
                    assert!((f64::from(*value) - exact).abs() < allowed, "{sizes:?} {n}");
                }
            };
            let out = forward(&x, &weight, Some(&bias), sizes);
            near(&out, to, from, &|i, j| {
                f64::from(bias[j]) + sum(from, &|k| [x[i * from + k], weight[k * to + j]])
            });
            near(&to_input(&gradient, &weight, sizes), from, to, &|i, k| {
                sum(to, &|j| [gradient[i * to + j], weight[k * to + j]])
            });
            near(&to_weight(&x, &gradient, sizes), to, rows, &|k, j| {
                sum(rows, &|i| [x[i * from + k], gradient[i * to + j]])
            });
            near(&to_bias(&gradient, to), to, rows, &|_, j| {
                sum(rows, &|i| [gradient[i * to + j], 1.0])
            });
        }
    }
}
