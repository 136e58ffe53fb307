//! Strong baseline: the sum of plane waves as one dense matrix product.
//!
//! ```text
//! f[i, j] = Σₙ Re[sₙ e^{iky yᵢ} · e^{ikx xⱼ}] = Σₙ (Re Yᵢₙ Re Xₙⱼ − Im Yᵢₙ Im Xₙⱼ)
//! ```
//!
//! Sines and cosines are evaluated on the rows and columns only; the rest is a real matrix product with inner length
//! 2·waves, blocked for caches and registers.

use super::{PlaneWaves, Quantity, Transfer, strengths};
use crate::raster::{Field, Raster};
use num_complex::Complex64;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

/// Rows of a register tile; its columns are two vectors.
const TILE: usize = 6;

/// Rows of a block: its left factor stays in the L2 cache.
const ROWS: usize = 8 * TILE;

/// Waves of a block: a tile of the right factor stays in the L1 cache.
const WAVES: usize = 128;

/// Sums plane waves on a raster as a matrix product, in `f32`, one field per quantity.
///
/// The same sum as [`harmonic_sum`](super::harmonic_sum), in waves × pixels multiplications. Its error is that of `f32`
/// sums, about 1e-6 of a field's rms for a few thousand waves with unrelated phases.
#[must_use]
pub fn matrix_product(
    waves: &PlaneWaves,
    transfer: &Transfer,
    quantities: &[Quantity],
    raster: &Raster,
) -> Vec<Field> {
    let arch = Arch::new();
    let right = arch.dispatch(PackRight { waves, raster });
    let strengths = strengths(waves, transfer, quantities);
    strengths
        .iter()
        .map(|strength| {
            let mut field = Field::constant(raster, 0.0);
            let block_len = ROWS * raster.columns.max(1);
            let blocks = field.values.par_chunks_mut(block_len).enumerate();
            blocks.for_each(|(block, out)| {
                let left = Left {
                    waves,
                    strength,
                    raster,
                    first_row: block * ROWS,
                };
                arch.dispatch(Block {
                    left,
                    right: &right,
                    out,
                });
            });
            field
        })
        .collect()
}

/// Packed e^{ikx x}: for every block of waves and every tile of columns, (Re, −Im) rows of the tile's width.
struct PackRight<'a> {
    waves: &'a PlaneWaves,
    raster: &'a Raster,
}

impl WithSimd for PackRight<'_> {
    type Output = Vec<f32>;

    fn with_simd<S: Simd>(self, _: S) -> Vec<f32> {
        let width = 2 * S::F32_LANES;
        let tiles = self.raster.columns.div_ceil(width);
        let mut packed = vec![0.0; 2 * self.waves.len() * tiles * width];
        let wave_blocks = packed.par_chunks_mut((2 * WAVES * tiles * width).max(1));
        wave_blocks.enumerate().for_each(|(block, out)| {
            let count = out.len() / (2 * tiles * width);
            for n in 0..count {
                let kx = self.waves.kx[block * WAVES + n];
                let step = Complex64::cis(kx * self.raster.spacing);
                for tile in 0..tiles {
                    let at = 2 * (tile * count + n) * width;
                    let mut phase = Complex64::cis(kx * self.raster.x(tile * width));
                    for j in 0..width {
                        out[at + j] = phase.re as f32;
                        out[at + width + j] = -phase.im as f32;
                        phase *= step;
                    }
                }
            }
        });
        packed
    }
}

/// The left factor of a block of rows.
struct Left<'a> {
    waves: &'a PlaneWaves,
    strength: &'a [Complex64],
    raster: &'a Raster,
    first_row: usize,
}

impl Left<'_> {
    /// Packs s e^{iky y} of some waves: for every tile of rows and every wave, (Re, Im) columns of the tile.
    fn pack(&self, waves: std::ops::Range<usize>, packed: &mut [f32]) {
        let y = self.raster.y(self.first_row);
        let count = waves.len();
        for (n, wave) in waves.enumerate() {
            let ky = self.waves.ky[wave];
            let step = Complex64::cis(-ky * self.raster.spacing);
            let mut value = self.strength[wave] * Complex64::cis(ky * y);
            for i in 0..ROWS {
                let at = (i / TILE * count + n) * 2 * TILE + i % TILE;
                packed[at] = value.re as f32;
                packed[at + TILE] = value.im as f32;
                value *= step;
            }
        }
    }
}

/// One block of rows of the product.
struct Block<'a> {
    left: Left<'a>,
    right: &'a [f32],
    out: &'a mut [f32],
}

impl WithSimd for Block<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let width = 2 * S::F32_LANES;
        let columns = self.left.raster.columns;
        let tiles = columns.div_ceil(width);
        let waves = self.left.waves.len();
        let mut left = vec![0.0; 2 * WAVES * ROWS];
        for start in (0..waves).step_by(WAVES) {
            let count = WAVES.min(waves - start);
            let left = &mut left[..2 * count * ROWS];
            self.left.pack(start..start + count, left);
            let right = &self.right[2 * start * tiles * width..][..2 * count * tiles * width];
            for (tile, right) in right.chunks_exact(2 * count * width).enumerate() {
                let (right, _) = S::as_simd_f32s(right);
                let from = tile * width;
                let to = columns.min(from + width);
                for (left, out) in left
                    .chunks_exact(2 * count * TILE)
                    .zip(self.out.chunks_mut(TILE * columns))
                {
                    let sums = tile_product(simd, left, right);
                    for (row, sums) in out.chunks_mut(columns).zip(&sums) {
                        let lanes: &[f32] = pulp::bytemuck::cast_slice(sums);
                        for (v, s) in row[from..to].iter_mut().zip(lanes) {
                            *v += s;
                        }
                    }
                }
            }
        }
    }
}

/// A register tile: `TILE` rows by two vectors, summed over the waves of a block.
#[inline(always)]
fn tile_product<S: Simd>(simd: S, left: &[f32], right: &[S::f32s]) -> [[S::f32s; 2]; TILE] {
    let mut sums = [[simd.splat_f32s(0.0); 2]; TILE];
    let (left, _) = left.as_chunks::<TILE>();
    let (right, _) = right.as_chunks::<2>();
    for (column, [a, b]) in left.iter().zip(right) {
        for (sum, &value) in sums.iter_mut().zip(column) {
            let value = simd.splat_f32s(value);
            sum[0] = simd.mul_add_f32s(value, *a, sum[0]);
            sum[1] = simd.mul_add_f32s(value, *b, sum[1]);
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::super::harmonic_sum;
    use super::*;

    /// The sum of 300 waves on rasters whose sizes are not multiples of a tile, against the harmonic sum.
    #[test]
    fn product_is_the_harmonic_sum() {
        let transfer = Transfer {
            depth: f64::INFINITY,
            incidence: 0.5,
            relaxation_rate: 0.7,
            action_slope: 4.5,
        };
        let mut waves = PlaneWaves::default();
        for n in 0..300 {
            let n = f64::from(n);
            let k = [(0.7 * n).sin(), (1.3 * n * n).sin()];
            waves.push(k, 2.0, Complex64::from_polar(1.0, 5.0 * n * n));
        }
        let quantities = [Quantity::Elevation, Quantity::VelocityZ, Quantity::SlopeX];
        for (rows, columns) in [(1, 1), (50, 37), (97, 16), (6, 130)] {
            let raster = Raster::image(rows, columns, 2.0);
            let pixels: Vec<_> = (0..raster.len())
                .map(|n| [n / columns, n % columns])
                .collect();
            let exact = harmonic_sum(&waves, &transfer, &quantities, &raster, &pixels);
            let fields = matrix_product(&waves, &transfer, &quantities, &raster);
            for (field, exact) in fields.iter().zip(exact) {
                for (v, e) in field.values.iter().zip(exact) {
                    // Waves of strength at most 2, rms 24: 600 products rounded to f32, with random errors adding up to
                    // 600^½ · 6e-8 · 24 = 4e-5; three times that.
                    assert!((f64::from(*v) - e).abs() < 1.2e-4);
                }
            }
        }
    }
}
