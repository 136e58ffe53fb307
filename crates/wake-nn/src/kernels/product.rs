//! Products of small matrices: rows are read in place, columns are packed by tiles.

use pulp::Simd;

use super::tile::{self, ROWS};

/// Columns that are transposed at a time.
const SQUARE: usize = 16;

/// Rows that are `step` apart in memory.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rows<'a> {
    pub(super) values: &'a [f32],
    pub(super) step: usize,
    pub(super) count: usize,
}

impl<'a> Rows<'a> {
    /// First `length` numbers of row `i`, or of the last row if there is no row `i`.
    pub(super) fn get(&self, i: usize, length: usize) -> &'a [f32] {
        &self.values[i.min(self.count - 1) * self.step..][..length]
    }

    /// The rows from the `first` on, at most `count` of them.
    pub(super) fn from(&self, first: usize, count: usize) -> Self {
        Self {
            values: &self.values[first * self.step..],
            count: count.min(self.count - first),
            ..*self
        }
    }

    /// Packs the first `columns` columns of all rows: `[tile of columns, row, column]`.
    pub(super) fn pack(&self, columns: usize, width: usize) -> Vec<f32> {
        let mut packed = vec![0.0; columns.div_ceil(width) * self.count * width];
        for (tile, packed) in packed.chunks_exact_mut(self.count * width).enumerate() {
            self.pack_tile(tile, columns, width, packed);
        }
        packed
    }

    /// Packs one tile of columns: `[row, column]`.
    pub(super) fn pack_tile(&self, tile: usize, columns: usize, width: usize, packed: &mut [f32]) {
        let from = tile * width;
        let to = columns.min(from + width);
        for (i, packed) in packed.chunks_exact_mut(width).enumerate() {
            packed[..to - from].copy_from_slice(&self.get(i, columns)[from..to]);
        }
    }

    /// Packs the transposed matrix: `[tile of rows, column, row]`.
    pub(super) fn pack_transposed(&self, columns: usize, width: usize) -> Vec<f32> {
        let mut packed = vec![0.0; self.count.div_ceil(width) * columns * width];
        for (tile, packed) in packed.chunks_exact_mut(columns * width).enumerate() {
            self.pack_tile_transposed(tile, columns, width, packed);
        }
        packed
    }

    /// Packs one tile of rows, transposed: `[column, row]`.
    pub(super) fn pack_tile_transposed(
        &self,
        tile: usize,
        columns: usize,
        width: usize,
        packed: &mut [f32],
    ) {
        let rows = width.min(self.count - tile * width);
        // Few columns at a time, so that the places they are written to stay in a core's L1 cache.
        for (n, packed) in packed.chunks_mut(SQUARE * width).enumerate() {
            for i in 0..rows {
                let row = &self.get(tile * width + i, columns)[n * SQUARE..];
                for (value, packed) in row.iter().zip(packed.chunks_exact_mut(width)) {
                    packed[i] = *value;
                }
            }
        }
    }
}

/// Destination of a product: rows `step` apart and `columns` wide, which the product replaces or is added to.
#[derive(Debug)]
pub(super) struct Target<'a> {
    pub(super) values: &'a mut [f32],
    pub(super) step: usize,
    pub(super) columns: usize,
    pub(super) add: bool,
}

/// Multiplies rows with packed columns.
///
/// # Shapes
///
/// - `left`: `[rows, depth]`
/// - `right`: `[tile, depth, width]`
/// - `target`: `[rows, columns]`
#[inline(always)]
pub(super) fn multiply<S: Simd>(
    simd: S,
    left: &Rows<'_>,
    depth: usize,
    right: &[f32],
    target: &mut Target<'_>,
) {
    let width = tile::width::<S>();
    for (tile, right) in right.chunks_exact(depth * width).enumerate() {
        let columns = tile * width..target.columns.min((tile + 1) * width);
        for first in (0..left.count).step_by(ROWS) {
            let mut rows = [left.values; ROWS];
            for (i, row) in rows.iter_mut().enumerate() {
                *row = left.get(first + i, depth);
            }
            let count = ROWS.min(left.count - first);
            let out = target.values[first * target.step..]
                .chunks_mut(target.step)
                .take(count);
            let mut sums = tile::start(simd, [0.0; ROWS]);
            if target.add {
                for (sum, out) in sums.iter_mut().zip(out) {
                    *sum = tile::load(simd, &out[columns.clone()]);
                }
            }
            tile::multiply(simd, rows, 0, right, &mut sums);
            let out = target.values[first * target.step..]
                .chunks_mut(target.step)
                .take(count);
            for (sum, out) in sums.into_iter().zip(out) {
                tile::store::<S, _>(sum, &mut out[columns.clone()]);
            }
        }
    }
}
