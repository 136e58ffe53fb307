//! Register tile of which all matrix products here consist.

use pulp::{Simd, WithSimd, bytemuck};

/// Rows of a tile. With two vectors a row, the sums fill 12 of the 16 registers of AVX2.
pub(super) const ROWS: usize = 6;

/// The sums of one tile, kept in registers.
pub(super) type Sums<S> = [[<S as Simd>::f32s; 2]; ROWS];

/// Vectors of a wide tile, whose sums fill 24 of 32 registers.
pub(super) const WIDE: usize = 4;

/// Columns of a tile: two vectors.
pub(super) const fn width<S: Simd>() -> usize {
    2 * S::F32_LANES
}

/// Task that returns the width of a tile on this machine.
pub(super) struct Width;

impl WithSimd for Width {
    type Output = usize;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> usize {
        width::<S>()
    }
}

/// Adds the product of six rows with a panel that is V vectors wide.
///
/// ```text
/// sums[i][j] += Σ_k rows[i][start + k] · panel[k][j]
/// ```
///
/// # Shapes
///
/// - `rows[i]`: at least as long as the panel, counted from `start`
/// - `panel`: `[k, width]`
#[inline(always)]
pub(super) fn multiply<S: Simd, const V: usize>(
    simd: S,
    rows: [&[f32]; ROWS],
    start: usize,
    panel: &[f32],
    sums: &mut [[S::f32s; V]; ROWS],
) {
    let (panel, _) = S::as_simd_f32s(panel).0.as_chunks::<V>();
    let [mut a, mut b, mut c, mut d, mut e, mut f] = rows;
    for row in [&mut a, &mut b, &mut c, &mut d, &mut e, &mut f] {
        *row = &row[start..start + panel.len()];
    }
    // A local copy stays in registers; through the reference every step would store all sums.
    let mut held = *sums;
    for (k, panel) in panel.iter().enumerate() {
        for (sums, value) in held.iter_mut().zip([a[k], b[k], c[k], d[k], e[k], f[k]]) {
            let value = simd.splat_f32s(value);
            for (sum, panel) in sums.iter_mut().zip(panel) {
                *sum = simd.mul_add_f32s(value, *panel, *sum);
            }
        }
    }
    *sums = held;
}

/// Adds the products of six rows with two panels, both one tile wide, as [`multiply`] does with each of them: the sums of both fill 24
/// of 32 registers, and each number of a row is read once.
#[inline(always)]
pub(super) fn multiply_two<S: Simd>(
    simd: S,
    rows: [&[f32]; ROWS],
    panels: [&[f32]; 2],
    sums: [&mut Sums<S>; 2],
) {
    let [left, right] = panels.map(|panel| S::as_simd_f32s(panel).0.as_chunks::<2>().0);
    let right = &right[..left.len()];
    let [mut a, mut b, mut c, mut d, mut e, mut f] = rows;
    for row in [&mut a, &mut b, &mut c, &mut d, &mut e, &mut f] {
        *row = &row[..left.len()];
    }
    let [first, second] = sums;
    let (mut lefts, mut rights) = (*first, *second);
    for (k, (left, right)) in left.iter().zip(right).enumerate() {
        let values = [a[k], b[k], c[k], d[k], e[k], f[k]];
        for ((ls, rs), value) in lefts.iter_mut().zip(&mut rights).zip(values) {
            let value = simd.splat_f32s(value);
            for n in 0..2 {
                ls[n] = simd.mul_add_f32s(value, left[n], ls[n]);
                rs[n] = simd.mul_add_f32s(value, right[n], rs[n]);
            }
        }
    }
    (*first, *second) = (lefts, rights);
}

/// Adds the product of the transpose of six columns with a panel that is V vectors wide.
///
/// ```text
/// sums[i][j] += Σ_k left[k][columns.start + i] · panel[k][j]
/// ```
///
/// # Shapes
///
/// - `left`: rows `step` apart, `[k, columns.end]`; with fewer than six columns the other sums stay unchanged
/// - `panel`: `[k, width]`
#[inline(always)]
pub(super) fn multiply_columns<S: Simd, const V: usize>(
    simd: S,
    left: &[f32],
    step: usize,
    columns: std::ops::Range<usize>,
    panel: &[f32],
    sums: &mut [[S::f32s; V]; ROWS],
) {
    let (panel, _) = S::as_simd_f32s(panel).0.as_chunks::<V>();
    let mut held = *sums;
    for (panel, row) in panel.iter().zip(left.chunks(step)) {
        let row = &row[columns.clone()];
        let mut few = [0.0; ROWS];
        let values = row.first_chunk().unwrap_or_else(|| {
            few[..row.len()].copy_from_slice(row);
            &few
        });
        for (sums, &value) in held.iter_mut().zip(values) {
            let value = simd.splat_f32s(value);
            for (sum, panel) in sums.iter_mut().zip(panel) {
                *sum = simd.mul_add_f32s(value, *panel, *sum);
            }
        }
    }
    *sums = held;
}

/// Sums that start at one value per row.
#[inline(always)]
pub(super) fn start<S: Simd>(simd: S, values: [f32; ROWS]) -> Sums<S> {
    let mut sums = [[simd.splat_f32s(0.0); 2]; ROWS];
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum = [simd.splat_f32s(value); 2];
    }
    sums
}

/// Sums that continue from those in `row`, as many as there are.
#[inline(always)]
pub(super) fn load<S: Simd, const V: usize>(simd: S, row: &[f32]) -> [S::f32s; V] {
    let whole = S::as_simd_f32s(row).0.first_chunk();
    whole.copied().unwrap_or_else(|| {
        let mut sums = [simd.splat_f32s(0.0); V];
        bytemuck::cast_slice_mut(&mut sums)[..row.len()].copy_from_slice(row);
        sums
    })
}

/// Writes the sums of one row, as many as fit in `row`.
#[inline(always)]
pub(super) fn store<S: Simd, const V: usize>(sums: [S::f32s; V], row: &mut [f32]) {
    match S::as_mut_simd_f32s(row).0.first_chunk_mut() {
        Some(whole) => *whole = sums,
        None => row.copy_from_slice(&bytemuck::cast_slice(&sums)[..row.len()]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::noise;

    struct Product<'a>(&'a [f32], &'a [f32]);

    impl WithSimd for Product<'_> {
        type Output = Vec<f32>;

        fn with_simd<S: Simd>(self, simd: S) -> Vec<f32> {
            let depth = self.0.len() / ROWS - 1;
            let mut rows = [self.0; ROWS];
            for (row, values) in rows.iter_mut().zip(self.0.chunks(depth + 1)) {
                *row = values;
            }
            let mut sums = start(simd, [1.0; ROWS]);
            multiply(simd, rows, 1, &self.1[..depth * width::<S>()], &mut sums);
            let mut out = vec![0.0; ROWS * width::<S>()];
            for (row, sums) in out.chunks_mut(width::<S>()).zip(sums) {
                store::<S, _>(sums, row);
            }
            out
        }
    }

    /// Adds a product to ones, with the vectors of this machine and with a single lane.
    #[test]
    fn a_tile_is_a_matrix_product() {
        let (rows, panel) = (noise(ROWS * 10, 1), noise(9 * 64, 2));
        let scalar = pulp::Scalar::new().vectorize(Product(&rows, &panel));
        for out in [scalar, pulp::Arch::new().dispatch(Product(&rows, &panel))] {
            let width = out.len() / ROWS;
            for (i, sum) in out.iter().enumerate() {
                let (row, column) = (i / width, i % width);
                let exact: f64 = (0..9)
                    .map(|k| {
                        f64::from(rows[row * 10 + 1 + k]) * f64::from(panel[k * width + column])
                    })
                    .sum();
                // Ten roundings of values below 3.
                assert!((f64::from(*sum) - 1.0 - exact).abs() < 10.0 * 3.0 * 6e-8);
            }
        }
    }

    struct Two<'a>(&'a [f32], &'a [f32]);

    impl WithSimd for Two<'_> {
        type Output = bool;

        fn with_simd<S: Simd>(self, simd: S) -> bool {
            let rows = std::array::from_fn(|i| &self.0[i * 10..(i + 1) * 10]);
            let panels = [0, 9].map(|from| &self.1[from * width::<S>()..][..9 * width::<S>()]);
            let bits =
                |sums: Sums<S>| -> Vec<u32> { bytemuck::cast_slice(sums.as_flattened()).to_vec() };
            let alone = panels.map(|panel| {
                let mut sums = start(simd, [0.5; ROWS]);
                multiply(simd, rows, 0, panel, &mut sums);
                bits(sums)
            });
            let [mut left, mut right] = [start(simd, [0.5; ROWS]); 2];
            multiply_two(simd, rows, panels, [&mut left, &mut right]);
            [left, right].map(bits) == alone
        }
    }

    /// Two panels at once give the same bits as one after the other.
    #[test]
    fn two_panels_are_multiplied_as_each_alone() {
        let (rows, panels) = (noise(ROWS * 10, 1), noise(18 * 64, 2));
        assert!(pulp::Scalar::new().vectorize(Two(&rows, &panels)));
        assert!(pulp::Arch::new().dispatch(Two(&rows, &panels)));
    }
}
