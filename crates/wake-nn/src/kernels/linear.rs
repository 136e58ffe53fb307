//! Products of whole matrices, as a linear layer and its gradients need them.
//!
//! One factor is packed by tiles, once; blocks of rows of the other one pass by on all cores, a stretch of their depth at a time, which
//! with its part of a tile stays in a core's first cache.

use pulp::{Simd, WithSimd};
use rayon::prelude::*;

use super::arch::arch;
use super::product::Rows;
use super::tile::{self, ROWS};

/// Rows of a block, a multiple of a tile's.
const BLOCK: usize = 8 * ROWS;
/// Numbers of a row that are multiplied at a time: a tile takes 24 KiB with the widest vectors.
const DEPTH: usize = 192;
/// Columns whose sum is one core's work.
const COLUMNS: usize = 64;

/// The sizes of a layer: rows, what comes in, what goes out.
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
    let right = packed(weight, sizes.from, sizes.to);
    product(x, &right, bias, [sizes.rows, sizes.from, sizes.to])
}

/// The gradient to x: `g Wᵀ`, `[rows, from]`.
pub(crate) fn to_input(gradient: &[f32], weight: &[f32], sizes: Sizes) -> Vec<f32> {
    let right = packed_transposed(weight, sizes.from, sizes.to);
    product(gradient, &right, None, [sizes.rows, sizes.to, sizes.from])
}

/// The gradient to W: `xᵀ g`, `[from, to]`.
pub(crate) fn to_weight(x: &[f32], gradient: &[f32], sizes: Sizes) -> Vec<f32> {
    let left = transposed(x, sizes.rows, sizes.from);
    let right = packed(gradient, sizes.rows, sizes.to);
    product(&left, &right, None, [sizes.from, sizes.rows, sizes.to])
}

/// The gradient to b: the sum over all rows, `[to]`.
pub(crate) fn to_bias(gradient: &[f32], to: usize) -> Vec<f32> {
    let mut sums = vec![0.0; to];
    sums.par_chunks_mut(COLUMNS)
        .enumerate()
        .for_each(|(n, sums)| {
            for row in gradient.chunks_exact(to) {
                for (sum, value) in sums.iter_mut().zip(&row[n * COLUMNS..]) {
                    *sum += value;
                }
            }
        });
    sums
}

/// Packs a matrix `[depth, columns]` on all cores: `[tile of columns, depth, column]`.
fn packed(matrix: &[f32], depth: usize, columns: usize) -> Vec<f32> {
    let rows = Rows {
        values: matrix,
        step: columns,
        count: depth,
    };
    in_tiles(depth, columns, |tile, width, packed| {
        rows.pack_tile(tile, columns, width, packed);
    })
}

/// Packs the transpose of a matrix `[columns, depth]` in the same way.
fn packed_transposed(matrix: &[f32], columns: usize, depth: usize) -> Vec<f32> {
    let rows = Rows {
        values: matrix,
        step: depth,
        count: columns,
    };
    in_tiles(depth, columns, |tile, width, packed| {
        rows.pack_tile_transposed(tile, depth, width, packed);
    })
}

/// Tiles of columns, each packed by a function of its number and width.
fn in_tiles(
    depth: usize,
    columns: usize,
    pack: impl Fn(usize, usize, &mut [f32]) + Sync,
) -> Vec<f32> {
    let width = arch().dispatch(tile::Width);
    let mut packed = vec![0.0; columns.div_ceil(width) * depth * width];
    packed
        .par_chunks_exact_mut(depth * width)
        .enumerate()
        .for_each(|(tile, packed)| pack(tile, width, packed));
    packed
}

/// `[columns, rows]` of a matrix `[rows, columns]`.
fn transposed(matrix: &[f32], rows: usize, columns: usize) -> Vec<f32> {
    let mut out = vec![0.0; matrix.len()];
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

/// The product of rows with a packed matrix, and a bias.
///
/// # Shapes
///
/// `left`: `[rows, depth]`, `right`: `[tile, depth, width]`; result: `[rows, columns]`
fn product(
    left: &[f32],
    right: &[f32],
    bias: Option<&[f32]>,
    [rows, depth, columns]: [usize; 3],
) -> Vec<f32> {
    let mut out = vec![0.0; rows * columns];
    out.par_chunks_mut(BLOCK * columns)
        .zip(left.par_chunks(BLOCK * depth))
        .for_each(|(out, left)| {
            arch().dispatch(Block {
                left,
                right,
                bias,
                depth,
                columns,
                out,
            });
        });
    out
}

/// Some rows of a product.
struct Block<'a> {
    left: &'a [f32],
    right: &'a [f32],
    bias: Option<&'a [f32]>,
    depth: usize,
    columns: usize,
    out: &'a mut [f32],
}

impl WithSimd for Block<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (width, depth, columns) = (tile::width::<S>(), self.depth, self.columns);
        let last = self.left.len() / depth - 1;
        for first in (0..depth).step_by(DEPTH) {
            let stretch = first * width..depth.min(first + DEPTH) * width;
            for (tile, right) in self.right.chunks_exact(depth * width).enumerate() {
                let of_tile = tile * width..columns.min((tile + 1) * width);
                let panel = &right[stretch.clone()];
                for (n, out) in self.out.chunks_mut(ROWS * columns).enumerate() {
                    let row = |i: usize| &self.left[(n * ROWS + i).min(last) * depth..][..depth];
                    let rows = std::array::from_fn(row);
                    let mut sums = tile::start(simd, [0.0; ROWS]);
                    for (sum, out) in sums.iter_mut().zip(out.chunks_exact(columns)) {
                        *sum = match self.bias {
                            _ if first > 0 => tile::load(simd, &out[of_tile.clone()]),
                            Some(bias) => tile::load(simd, &bias[of_tile.clone()]),
                            None => *sum,
                        };
                    }
                    tile::multiply(simd, rows, first, panel, &mut sums);
                    for (sum, out) in sums.into_iter().zip(out.chunks_exact_mut(columns)) {
                        tile::store::<S>(sum, &mut out[of_tile.clone()]);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::noise;

    /// Every product against sums in f64, on sizes that fill tiles, blocks and stretches and on sizes that do not.
    #[test]
    fn products_are_sums() {
        for (rows, from, to) in [(1, 1, 1), (5, 7, 33), (50, 200, 70), (97, 385, 64)] {
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
                    // As many roundings of sums below a quarter of their number.
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
