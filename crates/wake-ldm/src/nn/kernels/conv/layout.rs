//! Images with their border, split by the phase of the stride.

use rayon::prelude::*;

use super::Geometry;

/// Where things are in a laid-out plane.
///
/// A padded row i = q · stride + phase goes to row q of that phase, columns likewise, so that one tap
/// of the kernel reads consecutive pixels whatever the stride.
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

    /// Where the first output pixel reads through a tap (row · kernel + column).
    pub(super) fn tap(&self, tap: usize) -> usize {
        let (row, column) = (tap / self.kernel, tap % self.kernel);
        let phase = row % self.stride * self.stride + column % self.stride;
        phase * self.phase[0] * self.phase[1] + self.pixel(row / self.stride, column / self.stride)
    }

    /// How far an output pixel is from the first.
    pub(super) fn pixel(&self, row: usize, column: usize) -> usize {
        row * self.phase[1] + column
    }

    /// Row and column in the laid-out plane of a pixel of the padded image, if any output sees it.
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
        let mut planes = vec![0.0; x.len() / (rows * columns) * self.plane()];
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
        for (column, &value) in x.iter().enumerate() {
            if let Some(place) = self.place(row, column + left) {
                plane[place] = value;
            }
        }
    }
}
