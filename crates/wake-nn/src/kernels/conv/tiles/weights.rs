//! Gradient with respect to the weights by tiles.

use pulp::{Simd, WithSimd};

use crate::kernels::arch::arch;
use rayon::prelude::*;

use super::{LANES, PLACES, differences, tiles_of};
use crate::kernels::conv::geometry::Geometry;
use crate::kernels::conv::weights::interleave;
use crate::kernels::tile::{self, ROWS};

/// Numbers of transformed windows and gradients that a task keeps in a core's L2 cache: 384 KiB.
const NEAR: usize = 96 * 1024;

/// Places in one row of a transformed tile, which is one task.
const ROW: usize = 4;

/// Gradient with respect to the weights, with the shapes of [`weight_gradient`](crate::kernels::conv::weight_gradient).
pub(in crate::kernels::conv) fn weight_gradient(
    x: &[f32],
    dy: &[f32],
    geometry: &Geometry,
) -> Vec<f32> {
    let arch = arch();
    let width = arch.dispatch(tile::Width);
    let [channels_in, channels_out] = geometry.channels;
    let [rows, columns] = geometry.size_out();
    let windows = tiles_of(geometry);
    let x = &interleave(x, channels_in, geometry.size, windows.border, width);
    let border = [0, 0, rows % 2, columns % 2];
    let dy = &interleave(dy, channels_out, [rows, columns], border, width);
    let tiles = channels_in.div_ceil(width);
    // For every tile of input channels and row of places: `[place, channel out, channel in]`.
    let gradients: Vec<_> = (0..tiles * ROW)
        .into_par_iter()
        .map(|task| {
            arch.dispatch(Share {
                x,
                dy,
                row: task % ROW,
                tile: task / ROW,
                windows: &windows,
            })
        })
        .collect();
    let mut out = vec![0.0; channels_out * channels_in * 9];
    out.par_chunks_mut(channels_in * 9)
        .enumerate()
        .with_min_len(8)
        .for_each(|(channel, out)| {
            for (of_tile, out) in gradients.chunks(ROW).zip(out.chunks_mut(9 * width)) {
                kernels(of_tile, channel, width, out);
            }
        });
    out
}

/// Gradients at one row of places, for one tile of input channels.
struct Share<'a> {
    /// The image and the output's gradient: `[image, tile of channels, pixel, channel]`.
    x: &'a [f32],
    dy: &'a [f32],
    row: usize,
    tile: usize,
    windows: &'a Geometry,
}

impl WithSimd for Share<'_> {
    type Output = Vec<f32>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Vec<f32> {
        let width = tile::width::<S>();
        let channels = self.windows.channels[1].next_multiple_of(width);
        let total = self.windows.batch * self.windows.pixels_out();
        let count = (NEAR / (ROW * (channels + width))).clamp(1, total);
        let mut gradient = vec![0.0; ROW * channels * width];
        let mut seen = vec![0.0; ROW * count * width];
        let mut asked = vec![0.0; ROW * count * channels];
        for first in (0..total).step_by(count) {
            let here = count.min(total - first);
            for i in 0..here {
                self.transform_window(simd, first + i, &mut seen[i * width..], count * width);
                let asked = &mut asked[i * channels..];
                self.transform_gradient(simd, first + i, asked, count * channels);
            }
            let places = seen
                .chunks_exact(count * width)
                .zip(asked.chunks_exact(count * channels));
            let gradients = gradient.chunks_exact_mut(channels * width);
            for ((seen, asked), gradient) in places.zip(gradients) {
                let seen = &seen[..here * width];
                for (i, gradient) in gradient.chunks_mut(ROWS * width).enumerate() {
                    let columns = i * ROWS..channels.min((i + 1) * ROWS);
                    let mut sums = tile::start(simd, [0.0; ROWS]);
                    for (sum, row) in sums.iter_mut().zip(gradient.chunks_exact(width)) {
                        *sum = tile::load(simd, row);
                    }
                    tile::multiply_columns(simd, asked, channels, columns, seen, &mut sums);
                    for (sum, row) in sums.into_iter().zip(gradient.chunks_exact_mut(width)) {
                        tile::store::<S, _>(sum, row);
                    }
                }
            }
        }
        gradient
    }
}

impl Share<'_> {
    /// Image, row and column of a window.
    fn place(&self, window: usize) -> (usize, usize, usize) {
        let [rows, columns] = self.windows.size_out();
        let (image, window) = (window / (rows * columns), window % (rows * columns));
        (image, window / columns, window % columns)
    }

    /// Writes one row of `Bᵀ d B` of a window for all channels of the tile, with places `step` apart.
    #[inline(always)]
    fn transform_window<S: Simd>(&self, simd: S, window: usize, out: &mut [f32], step: usize) {
        let width = tile::width::<S>();
        let (image, row, column) = self.place(window);
        let [top, left, bottom, right] = self.windows.border;
        let [rows, columns] = self.windows.size;
        let [rows, columns] = [top + rows + bottom, left + columns + right];
        let tiles = self.windows.channels[0].div_ceil(width);
        let plane = (image * tiles + self.tile) * rows * columns;
        // Each row of Bᵀ has two numbers that are not zero: 1, −1 or 1, 1.
        let (a, b) = [(0, 2), (1, 2), (2, 1), (1, 3)][self.row];
        let a = &self.x[(plane + (2 * row + a) * columns + 2 * column) * width..][..4 * width];
        let b = &self.x[(plane + (2 * row + b) * columns + 2 * column) * width..][..4 * width];
        let (a, _) = S::as_simd_f32s(a);
        let (b, _) = S::as_simd_f32s(b);
        let mut d = [[simd.splat_f32s(0.0); 4]; 2];
        for column in 0..4 {
            for half in 0..2 {
                let (a, b) = (a[2 * column + half], b[2 * column + half]);
                d[half][column] = if self.row == 1 {
                    simd.add_f32s(a, b)
                } else {
                    simd.sub_f32s(a, b)
                };
            }
        }
        let (near, far) = (differences(simd, d[0]), differences(simd, d[1]));
        for place in 0..ROW {
            let (out, _) = S::as_mut_simd_f32s(&mut out[place * step..][..width]);
            out[0] = near[place];
            out[1] = far[place];
        }
    }

    /// Writes one row of `A dy Aᵀ` of a tile for all channels, with places `step` apart.
    #[inline(always)]
    fn transform_gradient<S: Simd>(&self, simd: S, window: usize, out: &mut [f32], step: usize) {
        let width = tile::width::<S>();
        let (image, row, column) = self.place(window);
        let [rows, columns] = self.windows.size_out().map(|tiles| 2 * tiles);
        let tiles = self.windows.channels[1].div_ceil(width);
        for tile in 0..tiles {
            let plane = (image * tiles + tile) * rows * columns;
            let upper = &self.dy[(plane + 2 * row * columns + 2 * column) * width..];
            let (upper, lower) = (&upper[..2 * width], &upper[columns * width..][..2 * width]);
            let (upper, _) = S::as_simd_f32s(upper);
            let (lower, _) = S::as_simd_f32s(lower);
            for half in 0..2 {
                let mut pixels = [simd.splat_f32s(0.0); 2];
                for (column, pixel) in pixels.iter_mut().enumerate() {
                    let (upper, lower) = (upper[2 * column + half], lower[2 * column + half]);
                    *pixel = match self.row {
                        0 => upper,
                        1 => simd.add_f32s(upper, lower),
                        2 => simd.sub_f32s(upper, lower),
                        _ => simd.neg_f32s(lower),
                    };
                }
                let [left, right] = pixels;
                let places = [
                    left,
                    simd.add_f32s(left, right),
                    simd.sub_f32s(left, right),
                    simd.neg_f32s(right),
                ];
                for (place, value) in places.into_iter().enumerate() {
                    let (out, _) =
                        S::as_mut_simd_f32s(&mut out[place * step + tile * width..][..width]);
                    out[half] = value;
                }
            }
        }
    }
}

/// Computes `Gᵀ u G` for one output channel as `[channel in, tap]`, from `[row][column, channel out, channel in]`.
fn kernels(gradients: &[Vec<f32>], channel: usize, width: usize, out: &mut [f32]) {
    for (i, out) in out.chunks_mut(9 * LANES).enumerate() {
        let begin = i * LANES;
        let lanes = LANES.min(width - begin);
        let mut u = [[0.0; LANES]; PLACES];
        for (place, u) in u.iter_mut().enumerate() {
            let of_row = &gradients[place / ROW];
            let from = place % ROW * (of_row.len() / ROW) + channel * width + begin;
            u[..lanes].copy_from_slice(&of_row[from..from + lanes]);
        }
        let mut rows = [[0.0; LANES]; 12];
        for column in 0..4 {
            let part = back([u[column], u[4 + column], u[8 + column], u[12 + column]]);
            for (i, part) in part.into_iter().enumerate() {
                rows[4 * i + column] = part;
            }
        }
        let mut taps = [[0.0; LANES]; 9];
        for i in 0..3 {
            let part = back([
                rows[4 * i],
                rows[4 * i + 1],
                rows[4 * i + 2],
                rows[4 * i + 3],
            ]);
            taps[3 * i..][..3].copy_from_slice(&part);
        }
        for (lane, kernel) in out.as_chunks_mut::<9>().0.iter_mut().enumerate() {
            for (value, tap) in kernel.iter_mut().zip(&taps) {
                *value = tap[lane];
            }
        }
    }
}

/// `Gᵀ` times four numbers, side by side.
fn back([a, b, c, d]: [[f32; LANES]; 4]) -> [[f32; LANES]; 3] {
    let mut out = [[0.0; LANES]; 3];
    for lane in 0..LANES {
        let (sum, difference) = (0.5 * (b[lane] + c[lane]), 0.5 * (b[lane] - c[lane]));
        out[0][lane] = a[lane] + sum;
        out[1][lane] = difference;
        out[2][lane] = sum + d[lane];
    }
    out
}
