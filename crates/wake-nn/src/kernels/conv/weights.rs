//! Gradients of a convolution with respect to its weights, by the defining sum, and to its bias.

use pulp::{Simd, WithSimd};

use crate::kernels::arch::arch;
use rayon::prelude::*;

use super::geometry::Geometry;
use super::layout::Layout;
use crate::kernels::sum::sum;
use crate::kernels::tile::{self, ROWS};
use crate::kernels::zeros;

/// Gradient with respect to the weights, with the shapes of [`weight_gradient`](super::weight_gradient).
pub(super) fn weight_gradient(x: &[f32], dy: &[f32], geometry: &Geometry) -> Vec<f32> {
    let layout = Layout::new(geometry);
    let planes = layout.lay_out(x, geometry);
    let arch = arch();
    let channels_out = geometry.channels[1];
    let width = arch.dispatch(tile::Width);
    let columns = interleave(dy, channels_out, geometry.size_out(), [0; 4], width);
    let mut transposed = vec![0.0; geometry.patch() * channels_out];
    let tiles = geometry.patch().div_ceil(ROWS);
    let share = tiles.div_ceil(2 * rayon::current_num_threads()) * ROWS;
    transposed
        .par_chunks_mut(share * channels_out)
        .enumerate()
        .for_each(|(i, gradient)| {
            arch.dispatch(Share {
                planes: &planes,
                dy: &columns,
                gradient,
                first: i * share,
                geometry,
                layout,
            });
        });
    transpose(&transposed, channels_out)
}

/// Gradient with respect to the bias: `∂L/∂bias[o] = Σ_{n, p} dy[n, o, p]`.
///
/// # Shapes
///
/// - `dy`: `[batch, channels out, rows out, columns out]`
/// - result: `[channels out]`
pub(crate) fn bias_gradient(dy: &[f32], geometry: &Geometry) -> Vec<f32> {
    let (channels, pixels) = (geometry.channels[1], geometry.pixels_out());
    (0..channels)
        .into_par_iter()
        .with_min_len(8)
        .map(|channel| {
            let planes = dy.chunks_exact(pixels).skip(channel).step_by(channels);
            planes.map(|plane| sum(plane, |v| v)).sum()
        })
        .collect()
}

/// Interleaves the channels of images, with a border of zeros: `[image, tile of channels, pixel, channel]`.
pub(super) fn interleave(
    images: &[f32],
    channels: usize,
    size: [usize; 2],
    [top, left, bottom, right]: [usize; 4],
    width: usize,
) -> Vec<f32> {
    let [rows, columns] = size;
    let tiles = channels.div_ceil(width);
    let batch = images.len() / (channels * rows * columns);
    let row = (left + columns + right) * width;
    let plane = (top + rows + bottom) * row;
    let mut out = zeros(batch * tiles * plane);
    out.par_chunks_mut(plane)
        .enumerate()
        .with_min_len(2)
        .for_each(|(i, out)| {
            let (image, tile) = (i / tiles, i % tiles);
            let count = width.min(channels - tile * width);
            let from = (image * channels + tile * width) * rows * columns;
            let planes = &images[from..][..count * rows * columns];
            let out = out.chunks_exact_mut(row).skip(top);
            for (i, out) in out.take(rows).enumerate() {
                let out = &mut out[left * width..][..columns * width];
                interleave_rows(&planes[i * columns..], rows * columns, out, width);
            }
        });
    out
}

/// Transposes rows of pixels, `step` apart, into pixels of `width` channels, in squares that fit in registers.
fn interleave_rows(rows: &[f32], step: usize, out: &mut [f32], width: usize) {
    const SQUARE: usize = 8;
    let pixels = out.len() / width;
    for (channel, rows) in rows.chunks(SQUARE * step).enumerate() {
        for begin in (0..pixels).step_by(SQUARE) {
            let end = pixels.min(begin + SQUARE);
            for (i, row) in rows.chunks(step).enumerate() {
                for (j, value) in row[begin..end].iter().enumerate() {
                    out[(begin + j) * width + channel * SQUARE + i] = *value;
                }
            }
        }
    }
}

/// Transposes `[n, columns]` to `[columns, n]`.
fn transpose(matrix: &[f32], columns: usize) -> Vec<f32> {
    const SQUARE: usize = 16;
    let rows = matrix.len() / columns;
    let mut out = zeros(matrix.len());
    out.par_chunks_mut(SQUARE * rows)
        .enumerate()
        .for_each(|(i, out)| {
            for begin in (0..rows).step_by(SQUARE) {
                let end = rows.min(begin + SQUARE);
                for (j, out) in out.chunks_exact_mut(rows).enumerate() {
                    for row in begin..end {
                        out[row] = matrix[row * columns + i * SQUARE + j];
                    }
                }
            }
        });
    out
}

/// Numbers of the output's gradient that should stay in a core's L2 cache: 192 KiB.
const NEAR: usize = 48 * 1024;

/// Some images, and the gradient of one tile of their output channels.
struct Images<'a> {
    planes: &'a [f32],
    dy: &'a [f32],
    /// Steps from one image to the next in `planes` and `dy`.
    steps: [usize; 2],
}

/// Some rows (channel in, tap) of the transposed gradient, which has one column per output channel.
struct Share<'a> {
    planes: &'a [f32],
    dy: &'a [f32],
    gradient: &'a mut [f32],
    first: usize,
    geometry: &'a Geometry,
    layout: Layout,
}

impl WithSimd for Share<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let width = tile::width::<S>();
        let [channels_in, channels_out] = self.geometry.channels;
        let panel = self.geometry.pixels_out() * width;
        let image = [
            channels_in * self.layout.plane(),
            channels_out.div_ceil(width) * panel,
        ];
        let tiles = self.gradient.len().div_ceil(ROWS * channels_out);
        let reads: Vec<_> = (0..tiles).map(|tile| self.reads(tile)).collect();
        let group = (NEAR / panel).clamp(1, self.geometry.batch);
        let planes = self.planes.chunks(group * image[0]);
        for (planes, dy) in planes.zip(self.dy.chunks(group * image[1])) {
            for first in (0..channels_out).step_by(width) {
                let images = Images {
                    planes,
                    dy: &dy[first / width * panel..],
                    steps: image,
                };
                self.add(simd, &images, &reads, first);
            }
        }
    }
}

impl Share<'_> {
    /// Adds the contribution of some images to one tile of output channels.
    #[inline(always)]
    fn add<S: Simd>(
        &mut self,
        simd: S,
        images: &Images<'_>,
        reads: &[[usize; ROWS]],
        first: usize,
    ) {
        let width = tile::width::<S>();
        let channels_out = self.geometry.channels[1];
        let end = channels_out.min(first + width);
        let [rows_out, columns_out] = self.geometry.size_out();
        let step = self.layout.pixel(1, 0);
        let tiles = self.gradient.chunks_mut(ROWS * channels_out);
        for (gradient, places) in tiles.zip(reads) {
            let mut sums = tile::start(simd, [0.0; ROWS]);
            for (sum, row) in sums.iter_mut().zip(gradient.chunks_exact(channels_out)) {
                *sum = tile::load(simd, &row[first..end]);
            }
            let planes = images.planes.chunks_exact(images.steps[0]);
            for (planes, dy) in planes.zip(images.dy.chunks(images.steps[1])) {
                let mut reads = [planes; ROWS];
                for (read, place) in reads.iter_mut().zip(places) {
                    *read = &planes[*place..];
                }
                let panels = dy.chunks_exact(columns_out * width).take(rows_out);
                for (row, dy) in panels.enumerate() {
                    tile::multiply(simd, reads, row * step, dy, &mut sums);
                }
            }
            for (sum, row) in sums
                .into_iter()
                .zip(gradient.chunks_exact_mut(channels_out))
            {
                tile::store::<S, _>(sum, &mut row[first..end]);
            }
        }
    }

    /// Positions from which the rows of a tile read: their channel, shifted by their tap; beyond the last row, the positions of the last row.
    fn reads(&self, tile: usize) -> [usize; ROWS] {
        let taps = self.geometry.kernel * self.geometry.kernel;
        let last = self.geometry.patch() - 1;
        std::array::from_fn(|i| {
            let row = (self.first + tile * ROWS + i).min(last);
            row / taps * self.layout.plane() + self.layout.tap(row % taps)
        })
    }
}
