//! Images with their border, split by the phase of the stride.

use pulp::Simd;
use rayon::prelude::*;

use super::geometry::Geometry;
use crate::kernels::tile;
use crate::kernels::zeros;

/// Positions in a laid-out plane.
///
/// A padded row i = q · stride + phase goes to row q of that phase, likewise for columns, so one tap
/// of the kernel reads consecutive pixels for any stride.
#[derive(Debug, Clone, Copy)]
pub(super) struct Layout {
    /// Rows and columns of one phase.
    phase: [usize; 2],
    stride: usize,
    kernel: usize,
}

impl Layout {
    pub(super) fn new(geometry: &Geometry) -> Self {
        let reach = (geometry.kernel - 1) / geometry.stride;
        Self {
            phase: geometry.size_out().map(|size| size + reach),
            stride: geometry.stride,
            kernel: geometry.kernel,
        }
    }

    /// Pixels of one laid-out plane.
    pub(super) fn plane(&self) -> usize {
        self.stride * self.stride * self.phase[0] * self.phase[1]
    }

    /// Position at which the first output pixel reads through a tap (row · kernel + column).
    pub(super) fn tap(&self, tap: usize) -> usize {
        let (row, column) = (tap / self.kernel, tap % self.kernel);
        let phase = row % self.stride * self.stride + column % self.stride;
        phase * self.phase[0] * self.phase[1] + self.pixel(row / self.stride, column / self.stride)
    }

    /// Offset of an output pixel from the first.
    pub(super) fn pixel(&self, row: usize, column: usize) -> usize {
        row * self.phase[1] + column
    }

    /// Offset of an output, counted over all images, from the first output of the first image.
    pub(super) fn output(&self, output: usize, geometry: &Geometry) -> usize {
        let columns = geometry.size_out()[1];
        let (image, pixel) = (
            output / geometry.pixels_out(),
            output % geometry.pixels_out(),
        );
        image * geometry.channels[0] * self.plane() + self.pixel(pixel / columns, pixel % columns)
    }

    /// Position in the laid-out plane of a pixel of the padded image, if any output reads it.
    fn place(&self, row: usize, column: usize) -> Option<usize> {
        let (r, c) = (row / self.stride, column / self.stride);
        let phase = row % self.stride * self.stride + column % self.stride;
        (r < self.phase[0] && c < self.phase[1])
            .then(|| (phase * self.phase[0] + r) * self.phase[1] + c)
    }

    /// Lays out all planes of a batch.
    pub(super) fn lay_out(&self, x: &[f32], geometry: &Geometry) -> Vec<f32> {
        let [rows, columns] = geometry.size;
        let [top, left, ..] = geometry.border;
        let mut planes = zeros(x.len() / (rows * columns) * self.plane());
        planes
            .par_chunks_mut(self.plane())
            .zip(x.par_chunks(rows * columns))
            .with_min_len(8)
            .for_each(|(plane, x)| {
                for (row, x) in x.chunks_exact(columns).enumerate() {
                    self.lay_out_row(plane, x, row + top, left);
                }
            });
        planes
    }

    fn lay_out_row(&self, plane: &mut [f32], x: &[f32], row: usize, left: usize) {
        if self.stride == 1 {
            if let Some(begin) = self.place(row, left) {
                let count = x.len().min(self.phase[1] - left);
                plane[begin..begin + count].copy_from_slice(&x[..count]);
            }
            return;
        }
        for phase in 0..self.stride {
            // The first pixel of the row whose column in the padded image has this phase.
            let skipped = (phase + self.stride - left % self.stride) % self.stride;
            let column = left + skipped;
            let Some(begin) = self.place(row, column) else {
                continue;
            };
            let room = self.phase[1] - column / self.stride;
            let plane = &mut plane[begin..begin + room];
            let values = &x[skipped.min(x.len())..];
            if self.stride == 2 {
                // Pairs become vector instructions, which a step known only at run time does not.
                let (pairs, last) = values.as_chunks::<2>();
                let values = pairs.iter().map(|pair| pair[0]);
                for (place, value) in plane.iter_mut().zip(values) {
                    *place = value;
                }
                if let (Some(place), [value]) = (plane.get_mut(pairs.len()), last) {
                    *place = *value;
                }
            } else {
                for (place, value) in plane.iter_mut().zip(values.iter().step_by(self.stride)) {
                    *place = *value;
                }
            }
        }
    }
}

/// Reads the pixels that consecutive outputs need through the taps of a kernel.
#[derive(Debug)]
pub(super) struct Gather {
    taps: Vec<usize>,
    pixels: Vec<usize>,
    /// All pixels are consecutive.
    whole: bool,
    /// The pixels of each vector are consecutive.
    halves: bool,
}

impl Gather {
    /// Prepares one tile of outputs, from the `first`, counted over all images; beyond the last output, the last is repeated.
    pub(super) fn new<S: Simd>(layout: &Layout, geometry: &Geometry, first: usize) -> Self {
        let last = geometry.batch * geometry.pixels_out() - 1;
        let pixels: Vec<usize> = (0..tile::width::<S>())
            .map(|i| layout.output((first + i).min(last), geometry))
            .collect();
        let run = |pixels: &[usize]| pixels.windows(2).all(|pair| pair[1] == pair[0] + 1);
        Self {
            taps: (0..geometry.kernel * geometry.kernel)
                .map(|tap| layout.tap(tap))
                .collect(),
            whole: run(&pixels),
            halves: run(&pixels[..S::F32_LANES]) && run(&pixels[S::F32_LANES..]),
            pixels,
        }
    }

    /// Reads one laid-out plane of every image as `[tap, pixel]`; `plane` begins with the plane of the first image.
    #[inline(always)]
    pub(super) fn read<S: Simd>(&self, plane: &[f32], rows: &mut [f32]) {
        let width = tile::width::<S>();
        for (tap, row) in self.taps.iter().zip(rows.chunks_exact_mut(width)) {
            let plane = &plane[*tap..];
            if self.whole {
                row.copy_from_slice(&plane[self.pixels[0]..][..width]);
            } else if self.halves {
                let (left, right) = row.split_at_mut(S::F32_LANES);
                left.copy_from_slice(&plane[self.pixels[0]..][..S::F32_LANES]);
                right.copy_from_slice(&plane[self.pixels[S::F32_LANES]..][..S::F32_LANES]);
            } else {
                for (value, &pixel) in row.iter_mut().zip(&self.pixels) {
                    *value = plane[pixel];
                }
            }
        }
    }
}
