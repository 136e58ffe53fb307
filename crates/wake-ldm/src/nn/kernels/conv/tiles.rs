//! Convolutions with kernels of 3 × 3 by tiles of 2 × 2 pixels, with four products a pixel in the place of nine.
//!
//! ```text
//! y = Aᵀ [ (G w Gᵀ) ⊙ (Bᵀ d B) ] A
//!
//!      ⎡1  0 −1  0⎤       ⎡ 1   0   0⎤        ⎡1  1  1  0⎤
//! Bᵀ = ⎢0  1  1  0⎥   G = ⎢ ½   ½   ½⎥   Aᵀ = ⎣0  1 −1 −1⎦
//!      ⎢0 −1  1  0⎥       ⎢ ½  −½   ½⎥
//!      ⎣0  1  0 −1⎦       ⎣ 0   0   1⎦
//! ```
//!
//! - `d`: the 4 × 4 pixels that a tile sees, `w`: a kernel
//! - `⊙`: number by number; summed over the channels, a matrix product for each of the sixteen places
//!
//! # References
//!
//! Winograd (1980), "Arithmetic Complexity of Computations"; Lavin & Gray (2016), "Fast Algorithms for Convolutional Neural
//! Networks", Eq. 5 to 8, F(2 × 2, 3 × 3).

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::Geometry;
use super::forward::{by_blocks, columns, convolve};
use super::layout::{Gather, Layout};
use crate::nn::kernels::tile::{self, ROWS};

/// Places of a transformed tile.
const PLACES: usize = 16;

/// Numbers of the transformed image that a task keeps in a core's second cache: 512 KiB.
const NEAR: usize = 128 * 1024;

/// Most numbers of transformed kernels, which all tasks read: 20 MiB, a share of the cores' last cache.
const FAR: usize = 5 * 1024 * 1024;

/// Below so many channels transforms cost more than they save.
const FEW: usize = 16;

/// Products that take as long as the transform of one kernel, memory included.
const TRANSFORM: usize = 1500;

/// Convolves a batch of images, by tiles where that saves products and directly elsewhere.
///
/// Tiles round more often than the direct sum: windows and kernels are sums before they are multiplied.
///
/// # Shapes
///
/// As of [`convolve`].
pub(in crate::nn) fn convolve_by_tiles(
    x: &[f32],
    weight: &[f32],
    bias: Option<&[f32]>,
    geometry: &Geometry,
) -> Vec<f32> {
    let arch = Arch::new();
    let width = arch.dispatch(tile::Width);
    if !tiles_win(geometry, width) {
        return convolve(x, weight, bias, geometry);
    }
    let tiles = tiles_of(geometry);
    let layout = Layout::new(&tiles);
    let planes = layout.lay_out(x, &tiles);
    let weight = &transformed(weight, geometry);
    let rows = rows_of_a_task(&tiles, width);
    let columns = geometry.size_out()[1];
    let mut y = vec![0.0; geometry.batch * geometry.channels[1] * geometry.pixels_out()];
    by_blocks(
        &mut y,
        &planes,
        geometry,
        2 * rows * columns,
        |planes, i, y| {
            arch.dispatch(Block {
                planes,
                weight,
                bias,
                first: i * rows * tiles.size_out()[1],
                y,
                columns,
                tiles: &tiles,
                layout,
            });
        },
    );
    y
}

/// Whether tiles need at most two thirds of the products, transforms of kernels and unfilled vectors counted, and kernels stay
/// near.
fn tiles_win(geometry: &Geometry, width: usize) -> bool {
    let [channels_in, channels_out] = geometry.channels;
    let [rows, columns] = geometry.size_out();
    let fill = |pixels: usize| geometry.batch * pixels.div_ceil(width) * width;
    let tiles = PLACES * fill(rows.div_ceil(2) * columns.div_ceil(2));
    (geometry.kernel, geometry.stride) == (3, 1)
        && channels_in.min(channels_out) >= FEW
        && PLACES * channels_in * channels_out <= FAR
        && 3 * (tiles + TRANSFORM) <= 2 * 9 * fill(rows * columns)
}

/// The windows that tiles see: 4 × 4 pixels, two apart.
fn tiles_of(geometry: &Geometry) -> Geometry {
    let [rows, columns] = geometry.size_out();
    let [top, left, bottom, right] = geometry.border;
    Geometry {
        kernel: 4,
        stride: 2,
        border: [top, left, bottom + rows % 2, right + columns % 2],
        ..*geometry
    }
}

/// Rows of tiles that are one task: a full panel at least, and as many more as stay near and leave every core its share.
fn rows_of_a_task(tiles: &Geometry, width: usize) -> usize {
    let [rows, columns] = tiles.size_out();
    let near = NEAR / (PLACES * tiles.channels[0]) / columns;
    let share = rows * tiles.batch / (4 * rayon::current_num_threads());
    near.min(share).max(width.div_ceil(columns)).min(rows)
}

/// The kernels `G w Gᵀ`: `[place, channels out, channels in]`.
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

/// Kernels that are transformed side by side.
const LANES: usize = 16;

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

/// Some rows of tiles of all channels of one image.
struct Block<'a> {
    planes: &'a [f32],
    /// `[place, channels out, channels in]`.
    weight: &'a [f32],
    bias: Option<&'a [f32]>,
    /// The first tile.
    first: usize,
    /// Whole rows of pixels, by channel.
    y: Vec<&'a mut [f32]>,
    /// Pixels of a row.
    columns: usize,
    tiles: &'a Geometry,
    layout: Layout,
}

impl WithSimd for Block<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let width = tile::width::<S>();
        let channels = self.tiles.channels[0];
        let rows = (self.y[0].len() / self.columns).div_ceil(2);
        let panels = (rows * self.tiles.size_out()[1]).div_ceil(width);
        let mut image = vec![0.0; panels * PLACES * channels * width];
        let mut window = vec![0.0; PLACES * width];
        for (i, panel) in image
            .chunks_exact_mut(PLACES * channels * width)
            .enumerate()
        {
            let gather = Gather::new::<S>(&self.layout, self.tiles, self.first + i * width);
            let planes = self.planes.chunks_exact(self.layout.plane());
            for (channel, plane) in planes.enumerate() {
                gather.read::<S>(plane, &mut window);
                transform_window(simd, &window, channel, panel);
            }
        }
        self.multiply(simd, &image);
    }
}

/// `Bᵀ` times four numbers.
#[inline(always)]
fn differences<S: Simd>(simd: S, [a, b, c, d]: [S::f32s; 4]) -> [S::f32s; 4] {
    [
        simd.sub_f32s(a, c),
        simd.add_f32s(b, c),
        simd.sub_f32s(c, b),
        simd.sub_f32s(b, d),
    ]
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
    /// The sixteen products of kernels and windows, and the pixels that follow.
    #[inline(always)]
    fn multiply<S: Simd>(&mut self, simd: S, image: &[f32]) {
        let width = tile::width::<S>();
        let [channels, channels_out] = self.tiles.channels;
        let panel = PLACES * channels * width;
        // Of every panel: `[row, place, window]`.
        let mut products = vec![0.0; image.len() / panel * ROWS * PLACES * width];
        for first in (0..channels_out).step_by(ROWS) {
            for place in 0..PLACES {
                let mut weights = [&self.weight[..0]; ROWS];
                for (r, weights) in weights.iter_mut().enumerate() {
                    let row = place * channels_out + (first + r).min(channels_out - 1);
                    *weights = &self.weight[row * channels..][..channels];
                }
                let products = products.chunks_exact_mut(ROWS * PLACES * width);
                for (image, products) in image.chunks_exact(panel).zip(products) {
                    let image = &image[place * channels * width..][..channels * width];
                    let mut sums = tile::start(simd, [0.0; ROWS]);
                    tile::multiply(simd, weights, 0, image, &mut sums);
                    let rows = products.chunks_exact_mut(PLACES * width);
                    for (sum, row) in sums.into_iter().zip(rows) {
                        tile::store::<S>(sum, &mut row[place * width..][..width]);
                    }
                }
            }
            for (i, products) in products.chunks_exact(ROWS * PLACES * width).enumerate() {
                let rows = self.y[first..]
                    .iter_mut()
                    .zip(products.chunks_exact(PLACES * width));
                for (r, (y, products)) in rows.take(ROWS).enumerate() {
                    let bias = self.bias.map_or(0.0, |bias| bias[first + r]);
                    let tiles = Run {
                        first: i * width,
                        columns: self.columns,
                    };
                    tiles.write(simd, products, bias, y);
                }
            }
        }
    }
}

/// Where the tiles of a panel lie.
struct Run {
    /// The panel's first tile, counted from the block's.
    first: usize,
    /// Pixels of a row.
    columns: usize,
}

impl Run {
    /// Writes `Aᵀ m A` of the products `[place, tile]` and a bias to their pixels.
    #[inline(always)]
    fn write<S: Simd>(&self, simd: S, products: &[f32], bias: f32, y: &mut [f32]) {
        let width = tile::width::<S>();
        let (m, _) = S::as_simd_f32s(products);
        let bias = simd.splat_f32s(bias);
        // By row and column in the tile, and half of the panel.
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
        let mut done = 0;
        while done < width {
            let (row, column) = (
                (self.first + done) / in_a_row,
                (self.first + done) % in_a_row,
            );
            let count = (in_a_row - column).min(width - done);
            let end = self.columns.min(2 * (column + count));
            let rows = y.chunks_exact_mut(self.columns).skip(2 * row);
            for ([even, odd], y) in pixels.iter().zip(rows) {
                let even: &[f32] = pulp::bytemuck::cast_slice(even);
                let odd: &[f32] = pulp::bytemuck::cast_slice(odd);
                alternate(
                    &even[done..done + count],
                    &odd[done..done + count],
                    &mut y[2 * column..end],
                );
            }
            done += count;
        }
    }
}

/// Writes the even and the odd pixels of a row, which may end with an even one.
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
