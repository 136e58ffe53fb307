//! Forward convolution by tiles.

use std::ops::Range;

use pulp::{Simd, WithSimd};

use crate::kernels::arch::arch;
use rayon::prelude::*;

use super::{LANES, PLACES, differences, tiles_of};
use crate::kernels::columns::columns;
use crate::kernels::conv::direct::by_blocks;
use crate::kernels::conv::geometry::Geometry;
use crate::kernels::conv::layout::{Gather, Layout};
use crate::kernels::tile::{self, ROWS, Sums};
use crate::kernels::zeros;

/// Numbers of the transformed image that a task keeps in a core's L2 cache: 512 KiB.
const NEAR: usize = 128 * 1024;
/// Largest number of channels that are summed at a time, whose two panels of windows stay in the L2 cache.
const DEPTH: usize = 320;

/// Convolves a batch of images by tiles, with the shapes of [`convolve`](crate::kernels::conv::convolve).
pub(in crate::kernels::conv) fn convolve(
    x: &[f32],
    weight: &[f32],
    bias: Option<&[f32]>,
    geometry: &Geometry,
) -> Vec<f32> {
    let arch = arch();
    let width = arch.dispatch(tile::Width);
    let tiles = tiles_of(geometry);
    let layout = Layout::new(&tiles);
    let planes = layout.lay_out(x, &tiles);
    let weight = &transformed(weight, geometry);
    let (images, rows) = task(&tiles, width);
    let columns = geometry.size_out()[1];
    let mut y = zeros(geometry.batch * geometry.channels[1] * geometry.pixels_out());
    let block = 2 * rows * columns;
    by_blocks(
        &mut y,
        &planes,
        geometry,
        [images, block],
        |planes, i, y| {
            arch.dispatch(Block {
                planes,
                weight,
                bias,
                first: i * rows * tiles.size_out()[1],
                columns,
                tiles: Geometry {
                    batch: y.len() / geometry.channels[1],
                    ..tiles
                },
                y,
                layout,
            });
        },
    );
    y
}

/// Images and rows of tiles per task: at least a full panel, and more if they fit in the cache and every core gets a share
/// of the work. Several images are taken whole.
fn task(tiles: &Geometry, width: usize) -> (usize, usize) {
    let [rows, columns] = tiles.size_out();
    let near = NEAR / (PLACES * tiles.channels[0]) / columns;
    let share = rows * tiles.batch / (4 * rayon::current_num_threads());
    let least = width.div_ceil(columns);
    let of_a_task = near.min(share).max(least);
    if of_a_task < 2 * rows {
        (least.div_ceil(rows), of_a_task.min(rows))
    } else {
        (of_a_task / rows, rows)
    }
}

/// Transformed kernels `G w Gᵀ`: `[place, channels out, channels in]`.
fn transformed(weight: &[f32], geometry: &Geometry) -> Vec<f32> {
    let [channels_in, channels_out] = geometry.channels;
    let mut out = vec![0.0; PLACES * channels_out * channels_in];
    columns(&mut out, channels_out * channels_in, channels_in)
        .into_par_iter()
        .zip(weight.par_chunks_exact(9 * channels_in))
        .with_min_len(8)
        .for_each(|(mut places, kernels)| {
            for (i, kernels) in kernels.chunks(9 * LANES).enumerate() {
                let mut taps = [[0.0; LANES]; 9];
                for (lane, kernel) in kernels.as_chunks::<9>().0.iter().enumerate() {
                    for (tap, value) in taps.iter_mut().zip(kernel) {
                        tap[lane] = *value;
                    }
                }
                let transformed = transformed_kernels(&taps);
                let channels = i * LANES..i * LANES + kernels.len() / 9;
                for (place, values) in places.iter_mut().zip(&transformed) {
                    place[channels.clone()].copy_from_slice(&values[..channels.len()]);
                }
            }
        });
    out
}

fn transformed_kernels(w: &[[f32; LANES]; 9]) -> [[f32; LANES]; PLACES] {
    let mut rows = [[0.0; LANES]; 12];
    let mut out = [[0.0; LANES]; PLACES];
    for j in 0..3 {
        for lane in 0..LANES {
            let [a, b, c] = [w[j][lane], w[3 + j][lane], w[6 + j][lane]];
            rows[j][lane] = a;
            rows[3 + j][lane] = 0.5 * (a + b + c);
            rows[6 + j][lane] = 0.5 * (a - b + c);
            rows[9 + j][lane] = c;
        }
    }
    for i in 0..4 {
        for lane in 0..LANES {
            let [a, b, c] = [
                rows[3 * i][lane],
                rows[3 * i + 1][lane],
                rows[3 * i + 2][lane],
            ];
            out[4 * i][lane] = a;
            out[4 * i + 1][lane] = 0.5 * (a + b + c);
            out[4 * i + 2][lane] = 0.5 * (a - b + c);
            out[4 * i + 3][lane] = c;
        }
    }
    out
}

/// Some rows of tiles of all channels of one image, or all rows of some images.
struct Block<'a> {
    planes: &'a [f32],
    /// `[place, channels out, channels in]`.
    weight: &'a [f32],
    bias: Option<&'a [f32]>,
    /// The first tile.
    first: usize,
    /// Whole rows of pixels, by image and channel.
    y: Vec<&'a mut [f32]>,
    /// Pixels of a row.
    columns: usize,
    /// Windows of these images.
    tiles: Geometry,
    layout: Layout,
}

impl WithSimd for Block<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let width = tile::width::<S>();
        let channels = self.tiles.channels[0];
        let rows = (self.y[0].len() / self.columns).div_ceil(2);
        let windows = self.tiles.batch * rows * self.tiles.size_out()[1];
        let panels = windows.div_ceil(width);
        // A row of tiles of a wide image exceeds the cache: transform some panels of it at a time, and of many channels a part.
        let deep = channels.div_ceil(channels.div_ceil(DEPTH));
        let together = (NEAR / (PLACES * deep * width)).clamp(2.min(panels), panels);
        let rows = self.tiles.channels[1].div_ceil(ROWS);
        let mut image = vec![0.0; together * PLACES * deep * width];
        // Of every panel and six channels: `[row, place, window]`. Sums of a part of the channels wait here for the next part.
        let waiting = if deep < channels { rows } else { 1 };
        let mut products = vec![0.0; waiting * together * ROWS * PLACES * width];
        let mut window = vec![0.0; PLACES * width];
        for first in (0..panels).step_by(together) {
            let together = together.min(panels - first);
            for channel in (0..channels).step_by(deep) {
                let part = channel..channels.min(channel + deep);
                let panel = PLACES * part.len() * width;
                let image = &mut image[..together * panel];
                for (i, panel) in image.chunks_exact_mut(panel).enumerate() {
                    let begin = self.first + (first + i) * width;
                    let gather = Gather::new::<S>(&self.layout, &self.tiles, begin);
                    for (k, channel) in part.clone().enumerate() {
                        let planes = &self.planes[channel * self.layout.plane()..];
                        gather.read::<S>(planes, &mut window);
                        transform_window(simd, &window, k, panel);
                    }
                }
                let size = together * ROWS * PLACES * width;
                for row in 0..rows {
                    let products = &mut products[row % waiting * size..][..size];
                    self.multiply(simd, image, row * ROWS, part.clone(), products);
                    if part.end == channels {
                        self.write(simd, products, row * ROWS, first);
                    }
                }
            }
        }
    }
}

/// `Aᵀ` times four numbers.
#[inline(always)]
fn sums<S: Simd>(simd: S, [a, b, c, d]: [S::f32s; 4]) -> [S::f32s; 2] {
    [
        simd.add_f32s(simd.add_f32s(a, b), c),
        simd.sub_f32s(simd.sub_f32s(b, c), d),
    ]
}

/// `Bᵀ d B` of a tile of windows `[place, window]`, written to `[place, channel, window]`.
#[inline(always)]
fn transform_window<S: Simd>(simd: S, window: &[f32], channel: usize, panel: &mut [f32]) {
    let (d, _) = S::as_simd_f32s(window);
    let (out, _) = S::as_mut_simd_f32s(panel);
    let place = out.len() / PLACES;
    for half in 0..2 {
        let mut columns = [[simd.splat_f32s(0.0); 4]; 4];
        for (j, column) in columns.iter_mut().enumerate() {
            let d = &d[2 * j + half..][..25];
            *column = differences(simd, [d[0], d[8], d[16], d[24]]);
        }
        let [a, b, c, d] = columns;
        for i in 0..4 {
            let row = differences(simd, [a[i], b[i], c[i], d[i]]);
            for (j, value) in row.into_iter().enumerate() {
                out[(4 * i + j) * place + 2 * channel + half] = value;
            }
        }
    }
}

impl Block<'_> {
    /// Multiplies six kernels and windows at all sixteen places over a part of the channels; adds to the products of the part before.
    ///
    /// - `row`: the first kernel
    #[inline(always)]
    fn multiply<S: Simd>(
        &self,
        simd: S,
        image: &[f32],
        row: usize,
        part: Range<usize>,
        products: &mut [f32],
    ) {
        let width = tile::width::<S>();
        let [channels, channels_out] = self.tiles.channels;
        let panel = PLACES * part.len() * width;
        for place in 0..PLACES {
            let weights = std::array::from_fn(|r| {
                let row = place * channels_out + (row + r).min(channels_out - 1);
                &self.weight[row * channels..][part.clone()]
            });
            let start = |products: &[f32]| -> Sums<S> {
                let mut sums = tile::start(simd, [0.0; ROWS]);
                if part.start > 0 {
                    let rows = products.chunks_exact(PLACES * width);
                    for (sum, row) in sums.iter_mut().zip(rows) {
                        *sum = tile::load(simd, &row[place * width..][..width]);
                    }
                }
                sums
            };
            let store = |sums: Sums<S>, products: &mut [f32]| {
                let rows = products.chunks_exact_mut(PLACES * width);
                for (sum, row) in sums.into_iter().zip(rows) {
                    tile::store::<S, _>(sum, &mut row[place * width..][..width]);
                }
            };
            let at_place = place * part.len() * width..(place + 1) * part.len() * width;
            let panels = image
                .chunks_exact(panel)
                .map(|panel| &panel[at_place.clone()]);
            let mut both = panels.zip(products.chunks_exact_mut(ROWS * PLACES * width));
            while let Some((panel, product)) = both.next() {
                let mut sums = start(product);
                let next = match S::REGISTER_COUNT {
                    32.. => both.next(),
                    _ => None,
                };
                if let Some((next, product)) = next {
                    let mut others = start(product);
                    let both = [&mut sums, &mut others];
                    tile::multiply_two(simd, weights, [panel, next], both);
                    store(others, product);
                } else {
                    tile::multiply(simd, weights, 0, panel, &mut sums);
                }
                store(sums, product);
            }
        }
    }

    /// Writes the pixels of six kernels, beginning at `row`, from the `first` panel on.
    #[inline(always)]
    fn write<S: Simd>(&mut self, simd: S, products: &[f32], row: usize, first: usize) {
        let width = tile::width::<S>();
        let channels_out = self.tiles.channels[1];
        for (i, products) in products.chunks_exact(ROWS * PLACES * width).enumerate() {
            let channels = row..channels_out.min(row + ROWS);
            for (channel, products) in channels.zip(products.chunks_exact(PLACES * width)) {
                let bias = self.bias.map_or(0.0, |bias| bias[channel]);
                let tiles = Run {
                    first: (first + i) * width,
                    columns: self.columns,
                    images: channels_out,
                };
                tiles.write(simd, products, bias, &mut self.y[channel..]);
            }
        }
    }
}

/// Position of a panel's tiles.
struct Run {
    /// First tile of the panel, counted from the block's first.
    first: usize,
    /// Pixels of a row.
    columns: usize,
    /// Number of planes from one image to the next.
    images: usize,
}

impl Run {
    /// Writes `Aᵀ m A` of the products `[place, tile]` plus a bias to their pixels; the first of `planes` belongs to the first
    /// image.
    #[inline(always)]
    fn write<S: Simd>(&self, simd: S, products: &[f32], bias: f32, planes: &mut [&mut [f32]]) {
        let width = tile::width::<S>();
        let (m, _) = S::as_simd_f32s(products);
        let bias = simd.splat_f32s(bias);
        // By row and column in the tile, and by half of the panel.
        let mut pixels = [[[bias; 2]; 2]; 2];
        for half in 0..2 {
            let mut columns = [[bias; 2]; 4];
            for (j, column) in columns.iter_mut().enumerate() {
                let m = &m[2 * j + half..][..25];
                *column = sums(simd, [m[0], m[8], m[16], m[24]]);
            }
            let [a, b, c, d] = columns;
            for (row, pixels) in pixels.iter_mut().enumerate() {
                let values = sums(simd, [a[row], b[row], c[row], d[row]]);
                for (pixels, value) in pixels.iter_mut().zip(values) {
                    pixels[half] = simd.add_f32s(value, pixels[half]);
                }
            }
        }
        let in_a_row = self.columns.div_ceil(2);
        let in_a_plane = (planes[0].len() / self.columns).div_ceil(2);
        let mut done = 0;
        while done < width {
            let (row, column) = (
                (self.first + done) / in_a_row,
                (self.first + done) % in_a_row,
            );
            // Beyond the last image there is nothing to write.
            let Some(plane) = planes.get_mut(row / in_a_plane * self.images) else {
                return;
            };
            let count = (in_a_row - column).min(width - done);
            let end = self.columns.min(2 * (column + count));
            let rows = plane
                .chunks_exact_mut(self.columns)
                .skip(row % in_a_plane * 2);
            for ([even, odd], row) in pixels.iter().zip(rows) {
                let even: &[f32] = pulp::bytemuck::cast_slice(even);
                let odd: &[f32] = pulp::bytemuck::cast_slice(odd);
                alternate(
                    &even[done..done + count],
                    &odd[done..done + count],
                    &mut row[2 * column..end],
                );
            }
            done += count;
        }
    }
}

/// Interleaves the even and odd pixels of a row, which may end with an even one.
#[inline(always)]
fn alternate(even: &[f32], odd: &[f32], row: &mut [f32]) {
    let (pairs, last) = row.as_chunks_mut::<2>();
    for ((pair, even), odd) in pairs.iter_mut().zip(even).zip(odd) {
        *pair = [*even, *odd];
    }
    if let ([last], [.., even]) = (last, even) {
        *last = *even;
    }
}
