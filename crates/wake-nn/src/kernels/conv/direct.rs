//! Convolution by its defining sum, for any kernel and stride.

use std::ops::Range;

use pulp::{Simd, WithSimd};

use crate::kernels::arch::arch;
use rayon::prelude::*;

use super::geometry::Geometry;
use super::layout::{Gather, Layout};
use crate::kernels::columns::columns;
use crate::kernels::tile::{self, ROWS, Sums};
use crate::kernels::zeros;

/// Rows of a panel of patches that are multiplied at once. So many weights are read in a row, since shorter runs are slower; six panels of
/// 32 columns take 768 KiB of a core's L2 cache.
const DEPTH: usize = 1024;

/// Largest number of panels that share one pass over the weights.
const PANELS: usize = 6;

/// Convolves a batch of images, with the shapes of [`convolve`](super::convolve).
pub(super) fn convolve(
    x: &[f32],
    weight: &[f32],
    bias: Option<&[f32]>,
    geometry: &Geometry,
) -> Vec<f32> {
    let layout = Layout::new(geometry);
    let planes = layout.lay_out(x, geometry);
    let mut y = zeros(geometry.batch * geometry.channels[1] * geometry.pixels_out());
    let arch = arch();
    let block = block_width(geometry, arch.dispatch(tile::Width));
    let one = Geometry {
        batch: 1,
        ..*geometry
    };
    by_blocks(&mut y, &planes, geometry, [1, block], |planes, i, y| {
        arch.dispatch(Block {
            planes,
            weight,
            bias,
            first: i * block,
            y,
            geometry: &one,
            layout,
        });
    });
    y
}

/// Computes a few images at a time, in blocks of consecutive pixels of all their channels, on all cores.
///
/// - `planes`: the laid-out images
/// - `images`, `block`: number of images at a time, and pixels of each in a block
/// - `task`: called with the planes of these images, the number of a block in them, and the block's pixels by image and channel
pub(super) fn by_blocks(
    y: &mut [f32],
    planes: &[f32],
    geometry: &Geometry,
    [images, block]: [usize; 2],
    task: impl Fn(&[f32], usize, Vec<&mut [f32]>) + Sync,
) {
    let (image, pixels) = (y.len() / geometry.batch, geometry.pixels_out());
    y.par_chunks_mut(images * image)
        .zip(planes.par_chunks(images * (planes.len() / geometry.batch)))
        .for_each(|(y, planes)| {
            columns(y, pixels, block)
                .into_par_iter()
                .enumerate()
                .for_each(|(i, y)| task(planes, i, y));
        });
}

/// Pixels per task: few enough to give every core work, many enough to reuse the weights. Two panels are multiplied at once, so a task
/// has at least two if there are two panels per core.
fn block_width(geometry: &Geometry, width: usize) -> usize {
    let panels = geometry.pixels_out().div_ceil(width);
    let cores = rayon::current_num_threads();
    let all = panels * geometry.batch;
    let least = if all < 2 * cores { 1 } else { 2 };
    width * all.div_ceil(4 * cores).clamp(least, PANELS).min(panels)
}

/// Some consecutive pixels of all channels of one image.
struct Block<'a> {
    planes: &'a [f32],
    weight: &'a [f32],
    bias: Option<&'a [f32]>,
    first: usize,
    y: Vec<&'a mut [f32]>,
    geometry: &'a Geometry,
    layout: Layout,
}

impl WithSimd for Block<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let width = tile::width::<S>();
        let taps = self.geometry.kernel * self.geometry.kernel;
        let channels = self.geometry.channels[0];
        let step = (DEPTH / taps).clamp(1, channels);
        let panels = self.y[0].len().div_ceil(width);
        let mut patches = vec![0.0; panels * step * taps * width];
        for channel in (0..channels).step_by(step) {
            let channels = channel..channels.min(channel + step);
            let depth = channels.len() * taps;
            let patches = &mut patches[..panels * depth * width];
            for (i, panel) in patches.chunks_exact_mut(depth * width).enumerate() {
                self.pack::<S>(channels.clone(), i * width, panel);
            }
            self.multiply(simd, channels.start * taps, patches, depth);
        }
    }
}

impl Block<'_> {
    /// Writes the patches of one tile's pixels: a row of pixels for every channel and tap.
    #[inline(always)]
    fn pack<S: Simd>(&self, channels: Range<usize>, first: usize, panel: &mut [f32]) {
        let gather = Gather::new::<S>(&self.layout, self.geometry, self.first + first);
        let plane = self.layout.plane();
        let planes = self.planes.chunks_exact(plane).skip(channels.start);
        let rows = panel.chunks_exact_mut(panel.len() / channels.len());
        for (plane, rows) in planes.zip(rows) {
            gather.read::<S>(plane, rows);
        }
    }

    /// Adds the product of `depth` columns of the weights, beginning at `start`, with the patches.
    #[inline(always)]
    fn multiply<S: Simd>(&mut self, simd: S, start: usize, patches: &[f32], depth: usize) {
        let width = tile::width::<S>();
        let together = match S::REGISTER_COUNT {
            32.. => 2,
            _ => 1,
        };
        let patch = self.geometry.patch();
        let last = self.y.len() - 1;
        for (i, y) in self.y.chunks_mut(ROWS).enumerate() {
            let mut weights = [&self.weight[..0]; ROWS];
            let mut bias = [0.0; ROWS];
            for (r, (weights, bias)) in weights.iter_mut().zip(&mut bias).enumerate() {
                let row = (i * ROWS + r).min(last);
                *weights = &self.weight[row * patch + start..][..depth];
                *bias = self.bias.map_or(0.0, |bias| bias[row]);
            }
            let begin = |y: &[&mut [f32]], part: &Range<usize>| {
                let mut sums = tile::start(simd, bias);
                if start > 0 {
                    for (sum, y) in sums.iter_mut().zip(y) {
                        *sum = tile::load(simd, &y[part.clone()]);
                    }
                }
                sums
            };
            let end = |sums: Sums<S>, y: &mut [&mut [f32]], part: &Range<usize>| {
                for (sum, y) in sums.into_iter().zip(y) {
                    tile::store::<S, _>(sum, &mut y[part.clone()]);
                }
            };
            let pixels = y[0].len();
            for (n, patches) in patches.chunks(together * depth * width).enumerate() {
                let first = n * together * width;
                let [near, far] = [first, first + width].map(|at| at..pixels.min(at + width));
                let (panel, other) = patches.split_at(depth * width);
                let mut sums = begin(y, &near);
                if other.is_empty() {
                    tile::multiply(simd, weights, 0, panel, &mut sums);
                } else {
                    let mut others = begin(y, &far);
                    let both = [&mut sums, &mut others];
                    tile::multiply_two(simd, weights, [panel, other], both);
                    end(others, y, &far);
                }
                end(sums, y, &near);
            }
        }
    }
}
