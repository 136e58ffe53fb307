//! Gradient of a convolution with respect to its image by the transposed product: the contribution of every tap is
//! computed for all outputs and added to the pixel that the tap reads.
//!
//! The weights are read once, in the order of their tensor. Rotated kernels need a copy of them, which takes longer than
//! the product itself for a small image.

use pulp::{Simd, WithSimd};
use rayon::prelude::*;

use super::geometry::Geometry;
use crate::kernels::arch::arch;
use crate::kernels::columns::columns;
use crate::kernels::tile::{self, ROWS};
use crate::kernels::zeros;

/// Image channels per task: with 1280 output channels and nine taps, their weights take 720 KiB of a core's L2 cache.
const CHANNELS: usize = 16;
/// Output channels that are multiplied at a time: a tile of outputs takes 24 KiB with the widest vectors.
const DEPTH: usize = 192;
/// Tiles of outputs at a time.
const TILES: usize = 8;

/// Gradient with respect to the image, with the shapes of [`image_gradient`](super::image_gradient).
///
/// ```text
/// G[c, t, p] = Σ_o weight[o, c, t] · dy[o, p],    ∂L/∂x[c, p · stride + t − border] += G[c, t, p]
/// ```
pub(super) fn image_gradient(dy: &[f32], weight: &[f32], geometry: &Geometry) -> Vec<f32> {
    let arch = arch();
    let [channels_in, _] = geometry.channels;
    let image = geometry.size[0] * geometry.size[1];
    let dy = packed(dy, geometry, arch.dispatch(tile::Width));
    let mut dx = zeros(geometry.batch * channels_in * image);
    columns(&mut dx, channels_in * image, CHANNELS * image)
        .into_par_iter()
        .enumerate()
        .for_each(|(n, dx)| {
            arch.dispatch(Share {
                dy: &dy,
                weight,
                geometry,
                first: n * CHANNELS,
                dx,
            });
        });
    dx
}

/// Packs the outputs of all images tile by tile: `[tile, channel out, output]`, padded with zeros.
fn packed(dy: &[f32], geometry: &Geometry, width: usize) -> Vec<f32> {
    let (pixels, channels) = (geometry.pixels_out(), geometry.channels[1]);
    let outputs = geometry.batch * pixels;
    let mut packed = vec![0.0; outputs.div_ceil(width) * channels * width];
    packed
        .par_chunks_exact_mut(channels * width)
        .enumerate()
        .for_each(|(tile, packed)| {
            let end = outputs.min((tile + 1) * width);
            let mut output = tile * width;
            while output < end {
                let (image, pixel) = (output / pixels, output % pixels);
                let (begin, count) = (output - tile * width, (pixels - pixel).min(end - output));
                let planes = dy[image * channels * pixels..].chunks_exact(pixels);
                for (plane, row) in planes.zip(packed.chunks_exact_mut(width)) {
                    row[begin..begin + count].copy_from_slice(&plane[pixel..pixel + count]);
                }
                output += count;
            }
        });
    packed
}

/// Some channels of all images.
struct Share<'a> {
    dy: &'a [f32],
    weight: &'a [f32],
    geometry: &'a Geometry,
    /// The first channel.
    first: usize,
    /// By image: `[channel, rows, columns]`.
    dx: Vec<&'a mut [f32]>,
}

impl WithSimd for Share<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let width = tile::width::<S>();
        let channels = self.geometry.channels[1];
        let left = self.left();
        let rows = left.len() / channels;
        let mut products = vec![0.0; TILES * rows * width];
        for (group, dy) in self.dy.chunks(TILES * channels * width).enumerate() {
            products.fill(0.0);
            for start in (0..channels).step_by(DEPTH) {
                let depth = start..channels.min(start + DEPTH);
                let tiles = dy.chunks_exact(channels * width);
                for (dy, products) in tiles.zip(products.chunks_exact_mut(rows * width)) {
                    let panel = &dy[depth.start * width..depth.end * width];
                    let lefts = left.chunks_exact(channels * ROWS);
                    for (left, products) in lefts.zip(products.chunks_exact_mut(ROWS * width)) {
                        let left = &left[depth.start * ROWS..];
                        let mut sums = tile::start(simd, [0.0; ROWS]);
                        for (sum, row) in sums.iter_mut().zip(products.chunks_exact(width)) {
                            *sum = tile::load(simd, row);
                        }
                        tile::multiply_columns(simd, left, ROWS, 0..ROWS, panel, &mut sums);
                        for (sum, row) in sums.into_iter().zip(products.chunks_exact_mut(width)) {
                            tile::store::<S, _>(sum, row);
                        }
                    }
                }
            }
            for (tile, products) in products.chunks_exact(rows * width).enumerate() {
                self.scatter((group * TILES + tile) * width, products, width);
            }
        }
    }
}

impl Share<'_> {
    /// Packs the weights of these channels by tiles of rows (channel, tap): `[tile, channel out, row]`, padded with zeros.
    fn left(&self) -> Vec<f32> {
        let (patch, channels) = (self.geometry.patch(), self.geometry.channels[1]);
        let taps = self.geometry.kernel * self.geometry.kernel;
        let begin = self.first * taps;
        let rows = patch.min(begin + CHANNELS * taps) - begin;
        let mut left = vec![0.0; rows.div_ceil(ROWS) * channels * ROWS];
        for (o, weights) in self.weight.chunks_exact(patch).enumerate() {
            let tiles = left.chunks_exact_mut(channels * ROWS);
            for (values, tile) in weights[begin..begin + rows].chunks(ROWS).zip(tiles) {
                tile[o * ROWS..][..values.len()].copy_from_slice(values);
            }
        }
        left
    }

    /// Adds the products `[channel, tap, output]` of one tile of outputs to their pixels; `first` counts over all images.
    #[inline(always)]
    fn scatter(&mut self, first: usize, products: &[f32], width: usize) {
        let Geometry {
            kernel,
            stride,
            size: [rows, columns],
            border: [top, left, ..],
            ..
        } = *self.geometry;
        let columns_out = self.geometry.size_out()[1];
        let pixels = self.geometry.pixels_out();
        let end = (first + width).min(self.geometry.batch * pixels);
        let mut output = first;
        while output < end {
            let (image, pixel) = (output / pixels, output % pixels);
            let (row, column) = (pixel / columns_out, pixel % columns_out);
            let count = (columns_out - column).min(end - output);
            let planes = self.dx[image].chunks_exact_mut(rows * columns);
            let taps = products.chunks_exact(kernel * kernel * width);
            for (plane, products) in planes.zip(taps) {
                for (tap, products) in products.chunks_exact(width).enumerate() {
                    let Some(row) = (row * stride + tap / kernel).checked_sub(top) else {
                        continue;
                    };
                    // Outputs whose tap reads a column of the image: from the first inside its left edge to the last
                    // inside its right.
                    let shift = tap % kernel;
                    let from = left.saturating_sub(shift).div_ceil(stride).max(column);
                    let to = (columns + left).saturating_sub(shift).div_ceil(stride);
                    let to = to.min(column + count);
                    if row >= rows || from >= to {
                        continue;
                    }
                    let values = &products[output - first + from - column..][..to - from];
                    let place = row * columns + from * stride + shift - left;
                    if stride == 1 {
                        let plane = &mut plane[place..place + values.len()];
                        plane.iter_mut().zip(values).for_each(|(x, v)| *x += v);
                    } else {
                        let plane = plane[place..].iter_mut().step_by(stride);
                        plane.zip(values).for_each(|(x, v)| *x += v);
                    }
                }
            }
            output += count;
        }
    }
}
