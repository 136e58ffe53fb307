//! FFTs: the only module that calls them, with their sign, order and normalisation.
//!
//! # Sign and normalisation
//!
//! A synthesis adds plane waves without normalisation:
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

mod low_pass;

pub(crate) use low_pass::{Band, Filtered, LowPass, Point, Window};

use crate::workspace::{Shelf, Workspace};
use num_complex::{Complex, Complex32};
use rayon::prelude::*;
use rustfft::{Fft, FftNum, FftPlanner};
use std::ops::Range;
use std::sync::Arc;

/// Rows transposed at once in the second pass.
const BLOCK: usize = 16;

/// The two precisions of a transform; fields are `f32` in either case.
pub(crate) trait Real: FftNum + Default {
    /// Rounds to `f32`.
    fn to_f32(self) -> f32;
    /// Rounds from `f64`.
    fn from_f64(value: f64) -> Self;
    /// Buffers for spectra and the planned FFTs in this precision.
    fn of(workspace: &mut Workspace) -> (&mut Shelf<Complex<Self>>, &mut FftPlanner<Self>);
}

impl Real for f32 {
    fn to_f32(self) -> f32 {
        self
    }
    fn from_f64(value: f64) -> Self {
        value as Self
    }
    fn of(workspace: &mut Workspace) -> (&mut Shelf<Complex<Self>>, &mut FftPlanner<Self>) {
        (&mut workspace.spectra.0, &mut workspace.planners.0)
    }
}

impl Real for f64 {
    fn to_f32(self) -> f32 {
        self as f32
    }
    fn from_f64(value: f64) -> Self {
        value
    }
    fn of(workspace: &mut Workspace) -> (&mut Shelf<Complex<Self>>, &mut FftPlanner<Self>) {
        (&mut workspace.spectra.1, &mut workspace.planners.1)
    }
}

/// Sum of plane waves on a lattice of wavenumbers, evaluated on a raster by two passes of one-dimensional FFTs.
pub(crate) struct Synthesis<T> {
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
    pub(crate) fn new(rows: usize, columns: usize) -> Self {
        Self::planned(&mut FftPlanner::new(), rows, columns)
    }

    /// [`Self::new`] with a planner that caches its plans.
    pub(crate) fn planned(planner: &mut FftPlanner<T>, rows: usize, columns: usize) -> Self {
        Self {
            rows,
            columns,
            // Row 0 has the largest y: y falls as the row index grows, so this direction is "forward".
            along_y: planner.plan_fft_forward(rows),
            along_x: planner.plan_fft_inverse(columns),
        }
    }

    /// Sums `spectrum` (transposed, see the module page; overwritten) and keeps the first `keep[0]` rows and `keep[1]`
    /// columns. `finish` may change each row, given its index, before its real part is written to `re` and its imaginary
    /// part to `im`: two real fields from one transform.
    ///
    /// # Shapes
    ///
    /// - `spectrum`: `[columns, rows]`
    /// - `re`, `im`: `keep`, row after row
    ///
    /// # Panics
    ///
    /// If a length does not match, or more is kept than there is.
    pub(crate) fn run<F>(
        &self,
        spectrum: &mut [Complex<T>],
        keep: [usize; 2],
        out: [&mut [f32]; 2],
        finish: F,
    ) where
        F: Fn(usize, &mut [Complex<T>]) + Sync,
    {
        self.run_window(spectrum, [0, 0], keep, out, finish);
    }

    /// As [`Self::run`], but keeps `keep` rows and columns beginning with row `start[0]` and column `start[1]`.
    ///
    /// # Panics
    ///
    /// If a length does not match, or more is kept than there is.
    pub(crate) fn run_window<F>(
        &self,
        spectrum: &mut [Complex<T>],
        start: [usize; 2],
        keep: [usize; 2],
        [re, im]: [&mut [f32]; 2],
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
            start[0] + keep_rows <= self.rows && start[1] + keep_columns <= self.columns,
            "more kept than there is"
        );
        assert!(
            re.len() == keep_rows * keep_columns && im.len() == re.len(),
            "output of another size"
        );
        let zero = Complex::new(T::zero(), T::zero());
        spectrum.par_chunks_mut(self.rows).for_each_init(
            || vec![zero; self.along_y.get_inplace_scratch_len()],
            |scratch, line| {
                // Narrow-band waves leave many lines empty.
                if line.iter().any(|&v| v != zero) {
                    self.along_y.process_with_scratch(line, scratch);
                }
            },
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
                    self.gather(spectrum, start[0] + rows.start..start[0] + rows.end, block);
                    let lines = block.chunks_exact_mut(self.columns);
                    let out = re.chunks_mut(keep_columns).zip(im.chunks_mut(keep_columns));
                    for ((i, row), (re, im)) in rows.zip(lines).zip(out) {
                        self.along_x.process_with_scratch(row, scratch);
                        let kept = &mut row[start[1]..start[1] + keep_columns];
                        finish(i, kept);
                        split(kept, re, im);
                    }
                },
            );
    }

    /// Length of the buffer that [`Self::run_real`] needs for this many rows.
    #[must_use]
    pub(crate) fn half_len(&self, rows: usize) -> usize {
        2 * rows * self.columns.div_ceil(2)
    }

    /// Sums two real fields at once, each from its half spectrum, and keeps the given rows and the first `columns` columns.
    ///
    /// A real field has S[−b, −a] = conj S[b, a], so `fill(b, first, second)` is called only for the lines b = 0, 1, …
    /// below columns/2 and must overwrite both with the `rows` values of the line. Line 0 must itself have this symmetry;
    /// the Nyquist line of an even number of columns is 0.
    ///
    /// # Shapes
    ///
    /// - `half`: a buffer of [`Self::half_len`] values with any content
    /// - `first`, `second`: `[rows, columns]`, row after row
    ///
    /// # Panics
    ///
    /// If a length does not match, or more is kept than there is.
    pub(crate) fn run_real<F>(
        &self,
        half: &mut [Complex<T>],
        rows: Range<usize>,
        keep_columns: usize,
        [first, second]: [&mut [f32]; 2],
        fill: F,
    ) where
        F: Fn(usize, &mut [Complex<T>], &mut [Complex<T>]) + Sync,
    {
        let keep_rows = rows.len();
        assert_eq!(
            half.len(),
            self.half_len(keep_rows),
            "workspace of another size"
        );
        assert!(
            rows.end <= self.rows && keep_columns <= self.columns,
            "more kept than there is"
        );
        assert!(
            first.len() == keep_rows * keep_columns && second.len() == first.len(),
            "output of another size"
        );
        let zero = Complex::new(T::zero(), T::zero());
        half.par_chunks_mut((2 * keep_rows).max(1))
            .enumerate()
            .for_each_init(
                || {
                    let scratch = vec![zero; self.along_y.get_inplace_scratch_len()];
                    (vec![zero; 2 * self.rows], scratch)
                },
                |(lines, scratch), (b, kept)| {
                    let (one, two) = lines.split_at_mut(self.rows);
                    fill(b, one, two);
                    self.along_y.process_with_scratch(lines, scratch);
                    let (one, two) = kept.split_at_mut(keep_rows);
                    one.copy_from_slice(&lines[rows.clone()]);
                    two.copy_from_slice(&lines[self.rows..][rows.clone()]);
                },
            );
        let half = &*half;
        let block_len = BLOCK * keep_columns.max(1);
        first
            .par_chunks_mut(block_len)
            .zip(second.par_chunks_mut(block_len))
            .enumerate()
            .for_each_init(
                || self.row_buffers(),
                |(block, scratch), (n, (first, second))| {
                    let rows = n * BLOCK..((n + 1) * BLOCK).min(keep_rows);
                    let block = &mut block[..rows.len() * self.columns];
                    self.gather_real(half, keep_rows, rows, block);
                    self.along_x.process_with_scratch(block, scratch);
                    let rows = block.chunks_exact(self.columns);
                    let out = first
                        .chunks_mut(keep_columns)
                        .zip(second.chunks_mut(keep_columns));
                    for (row, (re, im)) in rows.zip(out) {
                        split(&row[..keep_columns], re, im);
                    }
                },
            );
    }

    /// Transposes some rows of two half spectra into rows of the full spectrum of `first + i second`.
    fn gather_real(
        &self,
        half: &[Complex<T>],
        kept: usize,
        rows: Range<usize>,
        block: &mut [Complex<T>],
    ) {
        for (j, lines) in half.chunks_exact(2 * kept).enumerate() {
            let (one, two) = lines.split_at(kept);
            let pairs = one[rows.clone()].iter().zip(&two[rows.clone()]);
            for ((one, two), row) in pairs.zip(block.chunks_exact_mut(self.columns)) {
                row[j] = Complex::new(one.re - two.im, one.im + two.re);
                if j > 0 {
                    row[self.columns - j] = Complex::new(one.re + two.im, two.re - one.im);
                }
            }
        }
        if self.columns.is_multiple_of(2) {
            for row in block.chunks_exact_mut(self.columns) {
                row[self.columns / 2] = Complex::new(T::zero(), T::zero());
            }
        }
    }

    /// Transposes some rows into a block; reading several rows at once touches each cache line only once.
    fn gather(&self, spectrum: &[Complex<T>], rows: Range<usize>, block: &mut [Complex<T>]) {
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

/// Sum of waves around a circle by one FFT.
#[derive(Clone)]
pub(crate) struct Circle(Arc<dyn Fft<f64>>);

impl Circle {
    pub(crate) fn planner() -> FftPlanner<f64> {
        FftPlanner::new()
    }

    /// A circle of `count` points, at least 1.
    pub(crate) fn planned(planner: &mut FftPlanner<f64>, count: usize) -> Self {
        Self(planner.plan_fft_inverse(count))
    }

    /// Number of points.
    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }

    /// Replaces the coefficients cₘ by the values Σₘ cₘ e^{2πi mj/n} at the points j.
    pub(crate) fn sum(&self, coefficients: &mut [Complex<f64>]) {
        self.0.process(coefficients);
    }
}

/// Separates real and imaginary parts.
fn split<T: Real>(row: &[Complex<T>], re: &mut [f32], im: &mut [f32]) {
    for ((v, re), im) in row.iter().zip(re).zip(im) {
        *re = v.re.to_f32();
        *im = v.im.to_f32();
    }
}

/// Real and imaginary parts of a sum of plane waves on a periodic lattice, in single precision.
///
/// ```text
/// f[i, j] = Σ_b Σ_a S[b, a] · exp(2πi (b·j/columns − a·i/rows))
/// ```
///
/// # Shapes
///
/// - `waves` S: `[columns, rows]` of the period; overwritten
/// - `period`, `size`: rows and columns; `size` is at most the period
/// - returns arrays `[rows, columns]` of the given size, row after row
///
/// # Panics
///
/// If the number of waves is not rows × columns, or the size is larger than the period.
#[must_use]
pub fn lattice_sum(waves: &mut [Complex32], period: [usize; 2], size: [usize; 2]) -> [Vec<f32>; 2] {
    let [mut re, mut im] = [(); 2].map(|()| vec![0.0; size[0] * size[1]]);
    let synthesis = Synthesis::new(period[0], period[1]);
    synthesis.run(waves, size, [&mut re, &mut im], |_, _| {});
    [re, im]
}

/// Smallest length of at least `n` whose only prime factors are 2, 3 and 5, for which the FFT is fast.
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

/// Signed index of entry `index` of an FFT of length `n`: 0, 1, …, −2, −1; for even n the middle one is −n/2.
#[must_use]
pub(crate) fn signed_index(index: usize, n: usize) -> i64 {
    if index < n.div_ceil(2) {
        index as i64
    } else {
        index as i64 - n as i64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each lattice wave alone, on even, odd, prime and unit sizes, against its exponential.
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
                    [&mut re, &mut im],
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

    /// Two real fields from half spectra against the full transform of the same waves.
    #[test]
    fn half_spectra_are_the_full_ones() {
        for (rows, columns) in [(1, 1), (4, 6), (5, 7), (16, 3), (20, 18), (40, 1)] {
            let plan = Synthesis::<f64>::new(rows, columns);
            let wave = |b: usize, a: usize, shift: f64| {
                let angle = 0.7 * (a * a) as f64 + 1.3 * b as f64 + shift;
                Complex::new(angle.sin(), (2.0 * angle).cos())
            };
            // Line 0 is made symmetric: the entry with the larger index is the conjugate of its partner.
            let value = |b: usize, a: usize, shift| match (b, (rows - a) % rows) {
                (0, partner) if partner == a => Complex::new(wave(0, a, shift).re, 0.0),
                (0, partner) if partner < a => wave(0, partner, shift).conj(),
                _ => wave(b, a, shift),
            };
            let mut full = vec![Complex::new(0.0, 0.0); rows * columns];
            for b in 0..columns.div_ceil(2) {
                for a in 0..rows {
                    let (one, two) = (value(b, a, 0.1), value(b, a, 0.9));
                    let i = Complex::new(0.0, 1.0);
                    let mirror = (columns - b) % columns * rows + (rows - a) % rows;
                    full[b * rows + a] = one + i * two;
                    full[mirror] = one.conj() + i * two.conj();
                }
            }
            let n = rows * columns;
            let (mut re, mut im) = (vec![0.0; n], vec![0.0; n]);
            plan.run(&mut full, [rows, columns], [&mut re, &mut im], |_, _| ());
            // Keeps only the last rows and the first columns, in a buffer with arbitrary content.
            let keep = [rows.div_ceil(2), columns.div_ceil(2)];
            let from = rows - keep[0];
            let mut half = vec![Complex::new(f64::NAN, 1.0); plan.half_len(keep[0])];
            let (mut first, mut second) =
                (vec![0.0; keep[0] * keep[1]], vec![0.0; keep[0] * keep[1]]);
            let out = [&mut first[..], &mut second[..]];
            plan.run_real(&mut half, from..rows, keep[1], out, |b, one, two| {
                for a in 0..rows {
                    one[a] = value(b, a, 0.1);
                    two[a] = value(b, a, 0.9);
                }
            });
            for i in 0..keep[0] {
                for j in 0..keep[1] {
                    let (kept, all) = (i * keep[1] + j, (from + i) * columns + j);
                    // Sums of up to 400 unit waves, rounded to f32.
                    assert!((first[kept] - re[all]).abs() < 1e-4);
                    assert!((second[kept] - im[all]).abs() < 1e-4);
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
