//! Squares of pixels as channels, and back, on all cores.

use rayon::prelude::*;

/// Division of planes into squares.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Cut {
    /// Side of a square in pixels.
    pub(crate) size: usize,
    /// Number of squares down and across.
    pub(crate) squares: [usize; 2],
}

impl Cut {
    /// Pixels of a plane.
    fn plane(&self) -> usize {
        self.size * self.size * self.squares[0] * self.squares[1]
    }

    /// Calls `put(place in planes of squares, place in the image)` for every pixel of a plane.
    #[inline(always)]
    fn places(&self, mut put: impl FnMut(usize, usize)) {
        let [rows, columns] = self.squares;
        let s = self.size;
        for (i, j) in (0..s).flat_map(|i| (0..s).map(move |j| (i, j))) {
            for r in 0..rows {
                let (to, from) = (
                    ((i * s + j) * rows + r) * columns,
                    (r * s + i) * columns * s + j,
                );
                for q in 0..columns {
                    put(to + q, from + q * s);
                }
            }
        }
    }

    /// `[planes, rows · s, columns · s]` to `[planes, s², rows, columns]`.
    pub(crate) fn to_depth(self, x: &[f32]) -> Vec<f32> {
        self.of_planes(x, |x, y| self.places(|square, pixel| y[square] = x[pixel]))
    }

    /// The inverse of [`Self::to_depth`].
    pub(crate) fn to_space(self, x: &[f32]) -> Vec<f32> {
        self.of_planes(x, |x, y| self.places(|square, pixel| y[pixel] = x[square]))
    }

    fn of_planes(&self, x: &[f32], change: impl Fn(&[f32], &mut [f32]) + Sync) -> Vec<f32> {
        let mut y = vec![0.0; x.len()];
        let plane = self.plane().max(1);
        y.par_chunks_mut(plane)
            .zip(x.par_chunks(plane))
            .for_each(|(y, x)| change(x, y));
        y
    }
}
