//! The only file that calls an FFT: sign, order and normalisation are stated here, once.
//!
//! # Sign and normalisation
//!
//! A synthesis adds plane waves and divides by nothing:
//!
//! ```text
//! f(x, y) = Σ_a Σ_b S[b, a] · exp(i(kx_b·x + ky_a·y)),   kx_b = b·2π/(columns·spacing), ky_a likewise
//! ```
//!
//! # Order
//!
//! The spectrum is stored *transposed*, `[columns, rows]`: entry `S[b·rows + a]`; indices run in FFT order
//! (0, 1, …, then negative). The field comes out as `[rows, columns]`, row 0 at the largest y. Pixel `[0, 0]`
//! is the phase reference: multiply the spectrum by `exp(i(kx·x₀ + ky·y₀))` to place it.

use num_complex::Complex;
use rayon::prelude::*;
use rustfft::{Fft, FftNum, FftPlanner};
use std::sync::Arc;

/// Rows transposed at once in the second pass.
const BLOCK: usize = 16;

/// The two precisions a transform can run in; fields are `f32` either way.
pub trait Real: FftNum {
    /// Rounds to `f32`.
    fn to_f32(self) -> f32;
    /// Rounds from `f64`.
    fn from_f64(value: f64) -> Self;
}

impl Real for f32 {
    fn to_f32(self) -> f32 {
        self
    }
    fn from_f64(value: f64) -> Self {
        value as Self
    }
}

impl Real for f64 {
    fn to_f32(self) -> f32 {
        self as f32
    }
    fn from_f64(value: f64) -> Self {
        value
    }
}

/// Sums plane waves of a lattice of wavenumbers on a raster, by two passes of one-dimensional FFTs.
pub struct Synthesis<T> {
    rows: usize,
    columns: usize,
    along_y: Arc<dyn Fft<T>>,
    along_x: Arc<dyn Fft<T>>,
}

impl<T> std::fmt::Debug for Synthesis<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Synthesis")
            .field("rows", &self.rows)
            .field("columns", &self.columns)
            .finish_non_exhaustive()
    }
}

impl<T: Real> Synthesis<T> {
    /// Plans the sum for a lattice of `rows` × `columns` points, both at least 1.
    #[must_use]
    pub fn new(rows: usize, columns: usize) -> Self {
        let mut planner = FftPlanner::new();
        Self {
            rows,
            columns,
            // Row 0 is the largest y: a growing row index means a falling y, so this direction is "forward".
            along_y: planner.plan_fft_forward(rows),
            along_x: planner.plan_fft_inverse(columns),
        }
    }

    /// Sums `spectrum` (transposed, see the module page; overwritten) and keeps the first `keep[0]` rows and
    /// `keep[1]` columns. `finish` may change each row (given its number) before its real part goes to `re`
    /// and its imaginary part to `im`: two real fields for one transform.
    ///
    /// # Shapes
    ///
    /// - `spectrum`: `[columns, rows]`
    /// - `re`, `im`: `keep`, row after row
    ///
    /// # Panics
    ///
    /// If a length is another, or more is kept than there is.
    pub fn run<F>(
        &self,
        spectrum: &mut [Complex<T>],
        keep: [usize; 2],
        (re, im): (&mut [f32], &mut [f32]),
        finish: F,
    ) where
        F: Fn(usize, &mut [Complex<T>]) + Sync,
    {
        let [keep_rows, keep_columns] = keep;
        assert_eq!(
            spectrum.len(),
            self.rows * self.columns,
            "spectrum of another size"
        );
        assert!(
            keep_rows <= self.rows && keep_columns <= self.columns,
            "more kept than there is"
        );
        assert!(
            re.len() == keep_rows * keep_columns && im.len() == re.len(),
            "output of another size"
        );
        spectrum.par_chunks_mut(self.rows).for_each_init(
            || vec![Complex::new(T::zero(), T::zero()); self.along_y.get_inplace_scratch_len()],
            |scratch, line| self.along_y.process_with_scratch(line, scratch),
        );
        let spectrum = &*spectrum;
        let block_len = BLOCK * keep_columns.max(1);
        re.par_chunks_mut(block_len)
            .zip(im.par_chunks_mut(block_len))
            .enumerate()
            .for_each_init(
                || self.row_buffers(),
                |(block, scratch), (b, (re, im))| {
                    let first = b * BLOCK;
                    let rows = first..(first + BLOCK).min(keep_rows);
                    self.gather(spectrum, rows.clone(), block);
                    let lines = block.chunks_exact_mut(self.columns);
                    let out = re.chunks_mut(keep_columns).zip(im.chunks_mut(keep_columns));
                    for ((i, row), (re, im)) in rows.zip(lines).zip(out) {
                        self.along_x.process_with_scratch(row, scratch);
                        finish(i, &mut row[..keep_columns]);
                        for ((v, re), im) in row.iter().zip(re).zip(im) {
                            *re = v.re.to_f32();
                            *im = v.im.to_f32();
                        }
                    }
                },
            );
    }

    /// Transposes some rows into a block; reading a few rows at once touches each cache line once.
    fn gather(
        &self,
        spectrum: &[Complex<T>],
        rows: std::ops::Range<usize>,
        block: &mut [Complex<T>],
    ) {
        for (j, line) in spectrum.chunks_exact(self.rows).enumerate() {
            for (i, &v) in line[rows.clone()].iter().enumerate() {
                block[i * self.columns + j] = v;
            }
        }
    }

    fn row_buffers(&self) -> (Vec<Complex<T>>, Vec<Complex<T>>) {
        let zero = Complex::new(T::zero(), T::zero());
        (
            vec![zero; BLOCK * self.columns],
            vec![zero; self.along_x.get_inplace_scratch_len()],
        )
    }
}

/// The smallest length of at least `n` whose only prime factors are 2, 3 and 5: the FFT is fast there.
#[must_use]
pub fn fast_length(n: usize) -> usize {
    let mut m = n.max(1);
    loop {
        let mut rest = m;
        for p in [2, 3, 5] {
            while rest.is_multiple_of(p) {
                rest /= p;
            }
        }
        if rest == 1 {
            return m;
        }
        m += 1;
    }
}

/// Signed index of entry `index` of an FFT of length `n`: 0, 1, …, −2, −1; the middle of an even n is −n/2.
#[must_use]
pub fn signed_index(index: usize, n: usize) -> i64 {
    if index < n.div_ceil(2) {
        index as i64
    } else {
        index as i64 - n as i64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every lattice wave alone, on sizes even, odd, prime and 1, against its exponential.
    #[test]
    fn one_wave_is_its_exponential() {
        for (rows, columns) in [(1, 1), (4, 6), (5, 7), (16, 3), (20, 18)] {
            let plan = Synthesis::<f64>::new(rows, columns);
            for a in 0..rows {
                let b = (3 * a) % columns;
                let mut spectrum = vec![Complex::new(0.0, 0.0); rows * columns];
                spectrum[b * rows + a] = Complex::new(1.0, 0.0);
                let (mut re, mut im) = (vec![0.0; rows * columns], vec![0.0; rows * columns]);
                plan.run(
                    &mut spectrum,
                    [rows, columns],
                    (&mut re, &mut im),
                    |_, _| (),
                );
                for (n, (&re, &im)) in re.iter().zip(&im).enumerate() {
                    let (i, j) = (n / columns, n % columns);
                    let (kx, ky) = (
                        signed_index(b, columns) as f64 / columns as f64,
                        signed_index(a, rows) as f64 / rows as f64,
                    );
                    let phase = std::f64::consts::TAU * (kx * j as f64 - ky * i as f64);
                    let (c, s) = (phase.cos() as f32, phase.sin() as f32);
                    // Two roundings to f32 near 1.
                    assert!((re - c).abs() < 2e-7 && (im - s).abs() < 2e-7);
                }
            }
        }
    }

    #[test]
    fn fast_lengths() {
        let lengths = [0, 1, 7, 11, 121, 512, 617].map(fast_length);
        assert_eq!(lengths, [1, 1, 8, 12, 125, 512, 625]);
    }

    #[test]
    fn signed_indices_are_symmetric() {
        let of = |n| (0..n).map(|i| signed_index(i, n)).collect::<Vec<_>>();
        assert_eq!(of(4), [0, 1, -2, -1]);
        assert_eq!(of(5), [0, 1, 2, -2, -1]);
    }
}
