//! Separable low-pass filter of a complex field, sampled at every n-th pixel.

use super::fast_length;
use crate::numeric::vector::vectorized;
use num_complex::Complex32;
use rayon::prelude::*;
use rustfft::{Fft, FftPlanner};
use std::f64::consts::TAU;
use std::ops::Range;
use std::sync::Arc;

/// Rows processed at once: as many as share the cache lines of a transposed column.
const BLOCK: usize = 16;

/// Weights of one axis of a filter at the frequencies −h…h of an FFT; their number is odd.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Band(pub(crate) Vec<f32>);

impl Band {
    /// Highest frequency h, in frequency steps of the FFT.
    #[must_use]
    pub(crate) fn highest(&self) -> usize {
        self.0.len() / 2
    }
}

/// A filtered field before its last transform.
pub(crate) struct Filtered {
    lines: Vec<Complex32>,
    window: Window,
}

/// Filters fields of one size and keeps every `step`-th pixel of a window.
///
/// ```text
/// G[i, j] = 1/(MN) Σ_ab W_y[a] W_x[b] Ê[a, b] e^{2πi(a r_i/M + b c_j/N)},   r_i = first row + step·i, c_j likewise
/// Ê[a, b] = Σ_rc E[r, c] e^{−2πi(a r/M + b c/N)}
/// ```
///
/// The field is continued by zeros to the M × N pixels of the FFT and periodically beyond. Only the frequencies of the
/// band are computed after the first pass, and only the kept pixels by the last.
pub(crate) struct LowPass {
    /// Rows and columns of the FFT, M and N.
    sizes: [usize; 2],
    step: usize,
    /// Bands of rows and of columns.
    bands: [Band; 2],
    /// Forward and inverse transform of each axis.
    transforms: [[Arc<dyn Fft<f32>>; 2]; 2],
}

/// The pixels that are kept: first row and column, and number of rows and columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Window {
    /// First row and column in the field.
    pub(crate) start: [usize; 2],
    /// Number of rows and columns kept.
    pub(crate) keep: [usize; 2],
}

/// A delta function at a position between the pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Point {
    /// Row and column in the field, fractional.
    pub(crate) place: [f64; 2],
    /// Complex amplitude.
    pub(crate) amplitude: Complex32,
}

impl std::fmt::Debug for LowPass {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("LowPass")
            .field("sizes", &self.sizes)
            .field("step", &self.step)
            .finish_non_exhaustive()
    }
}

impl LowPass {
    /// Rows and columns of the FFT for a field of `size` pixels of which every `step`-th is kept.
    #[must_use]
    pub(crate) fn sizes(size: [usize; 2], step: usize) -> [usize; 2] {
        size.map(|n| step * fast_length(n.div_ceil(step)))
    }

    /// Plans a filter.
    ///
    /// - `sizes`: as returned by [`Self::sizes`]
    /// - `bands`: of rows and of columns
    ///
    /// # Panics
    ///
    /// If a size is not a multiple of the step, or a band is wider than the FFT.
    #[must_use]
    pub(crate) fn new(sizes: [usize; 2], step: usize, bands: [Band; 2]) -> Self {
        let mut planner = FftPlanner::new();
        for (size, band) in sizes.iter().zip(&bands) {
            assert!(
                step > 0 && size.is_multiple_of(step) && band.0.len() <= *size,
                "{size} values of an FFT for a step of {step} and a band of {}",
                band.0.len()
            );
        }
        Self {
            sizes,
            step,
            bands,
            transforms: sizes.map(|n| {
                [
                    planner.plan_fft_forward(n),
                    planner.plan_fft_inverse(n / step),
                ]
            }),
        }
    }

    /// Filters a field of `rows` rows, written one by one by `fill`, together with points between its pixels. Returns the
    /// kept rows of its band, for [`Self::kept_rows`].
    ///
    /// - `fill(row, values)`: `values` has as many columns as the FFT, all zero
    ///
    /// # Panics
    ///
    /// If there are more rows than the FFT has.
    pub(crate) fn filtered(
        &self,
        rows: usize,
        fill: impl Fn(usize, &mut [Complex32]) + Sync,
        points: &[Point],
        window: &Window,
    ) -> Filtered {
        assert!(rows <= self.sizes[0], "more rows than planned");
        if window.keep.contains(&0) {
            return Filtered {
                lines: Vec::new(),
                window: *window,
            };
        }
        let blocks = self.rows_to_band(rows, fill);
        Filtered {
            lines: self.columns_of_band(&blocks, points, window),
            window: *window,
        }
    }

    /// First pass: transforms each row and keeps its band; returns `[block][band][BLOCK]`.
    fn rows_to_band(
        &self,
        rows: usize,
        fill: impl Fn(usize, &mut [Complex32]) + Sync,
    ) -> Vec<Complex32> {
        let columns = self.sizes[1];
        let transform = &self.transforms[1][0];
        let band = &self.bands[1];
        let count = band.0.len();
        let mut blocks = vec![Complex32::ZERO; rows.div_ceil(BLOCK) * count * BLOCK];
        blocks
            .par_chunks_mut(count * BLOCK)
            .enumerate()
            .for_each_init(
                || (vec![Complex32::ZERO; columns], scratch(transform)),
                |(row, scratch), (n, block)| {
                    for i in 0..BLOCK.min(rows - n * BLOCK) {
                        row.fill(Complex32::ZERO);
                        fill(n * BLOCK + i, row);
                        transform.process_with_scratch(row, scratch);
                        let [below, above] = entries(count, columns);
                        let values = row[below].iter().chain(&row[above]);
                        for ((b, &weight), value) in band.0.iter().enumerate().zip(values) {
                            block[b * BLOCK + i] = value * weight;
                        }
                    }
                },
            );
        blocks
    }

    /// Second pass: filters the columns of the band and samples them; returns `[band][keep_rows]`.
    fn columns_of_band(
        &self,
        blocks: &[Complex32],
        points: &[Point],
        window: &Window,
    ) -> Vec<Complex32> {
        let rows = self.sizes[0];
        let [analysis, synthesis] = &self.transforms[0];
        let count = self.bands[1].0.len();
        let keep = window.keep[0];
        let shift = self.shifts(0, window.start[0]);
        let points: Vec<_> = points.par_iter().map(|p| self.spectrum(p)).collect();
        let mut lines = vec![Complex32::ZERO; count * keep];
        lines.par_chunks_mut(keep).enumerate().for_each_init(
            || {
                let short = vec![Complex32::ZERO; rows / self.step];
                let scratch = [scratch(analysis), scratch(synthesis)];
                let sums = [(); 2].map(|()| vec![0.0; self.bands[0].0.len()]);
                (vec![Complex32::ZERO; rows], sums, short, scratch)
            },
            |(line, sums, short, scratch), (b, kept)| {
                line.fill(Complex32::ZERO);
                for (rows, block) in line
                    .chunks_mut(BLOCK)
                    .zip(blocks.chunks_exact(count * BLOCK))
                {
                    let values = &block[b * BLOCK..][..rows.len()];
                    rows.copy_from_slice(values);
                }
                analysis.process_with_scratch(line, &mut scratch[0]);
                self.add_points(b, &points, line, sums);
                fold(line, &shift, short);
                synthesis.process_with_scratch(short, &mut scratch[1]);
                for (kept, value) in kept.iter_mut().zip(&*short) {
                    *kept = *value;
                }
            },
        );
        lines
    }

    /// Last pass: sums the band of each kept row.
    ///
    /// `take` receives each row and the matching row of `out`.
    ///
    /// # Shapes
    ///
    /// - `out`: `[keep[0], keep[1]]`, row after row
    ///
    /// # Panics
    ///
    /// If `out` has a different length.
    pub(crate) fn kept_rows<T: Send>(
        &self,
        Filtered { lines, window }: &Filtered,
        out: &mut [T],
        take: impl Fn(&[Complex32], &mut [T]) + Sync,
    ) {
        let [keep_rows, keep_columns] = window.keep;
        assert_eq!(
            out.len(),
            keep_rows * keep_columns,
            "output of another size"
        );
        if out.is_empty() {
            return;
        }
        let short = self.sizes[1] / self.step;
        let synthesis = &self.transforms[1][1];
        let shift = self.shifts(1, window.start[1]);
        out.par_chunks_mut(BLOCK * keep_columns)
            .enumerate()
            .for_each_init(
                || (vec![Complex32::ZERO; BLOCK * short], scratch(synthesis)),
                |(block, scratch), (n, out)| {
                    let count = BLOCK.min(keep_rows - n * BLOCK);
                    let block = &mut block[..count * short];
                    block.fill(Complex32::ZERO);
                    for (line, &(_, at, factor)) in lines.chunks_exact(keep_rows).zip(&shift) {
                        let values = &line[n * BLOCK..][..count];
                        for (row, value) in block.chunks_exact_mut(short).zip(values) {
                            row[at] += value * factor;
                        }
                    }
                    synthesis.process_with_scratch(block, scratch);
                    let rows = block.chunks_exact(short);
                    for (row, out) in rows.zip(out.chunks_exact_mut(keep_columns)) {
                        take(&row[..keep_columns], out);
                    }
                },
            );
    }

    /// For each frequency of an axis: its index in the FFT and in the short FFT, and a factor 1/size that moves the first
    /// kept pixel to index 0; for rows with the weight, which the columns already have.
    fn shifts(&self, axis: usize, start: usize) -> Vec<(usize, usize, Complex32)> {
        let (size, band) = (self.sizes[axis], &self.bands[axis]);
        let count = band.0.len();
        let frequencies = 0..count;
        frequencies
            .map(|b| {
                let at = place(b, count, size);
                // Whole turns are dropped in integer arithmetic, which is exact for any size.
                let turns = (at * start % size) as f64 / size as f64;
                let (sin, cos) = (TAU * turns).sin_cos();
                let weight = if axis == 0 { f64::from(band.0[b]) } else { 1.0 } / size as f64;
                let factor = Complex32::new((weight * cos) as f32, (weight * sin) as f32);
                (at, at % (size / self.step), factor)
            })
            .collect()
    }

    /// Spectrum of a point: factors by row frequency, and by column frequency with amplitude and weights.
    fn spectrum(&self, point: &Point) -> PointSpectrum {
        let turns = |axis: usize| {
            let (band, size) = (&self.bands[axis], self.sizes[axis] as f64);
            let highest = band.highest() as f64;
            (0..band.0.len()).map(move |b| {
                let turn = -TAU * ((b as f64 - highest) * point.place[axis] / size).fract();
                let (sin, cos) = turn.sin_cos();
                Complex32::new(cos as f32, sin as f32)
            })
        };
        let columns = turns(1).zip(&self.bands[1].0);
        PointSpectrum {
            rows: turns(0).map(|t| (t.re, t.im)).unzip(),
            columns: columns.map(|(t, &w)| point.amplitude * w * t).collect(),
        }
    }

    /// Adds the spectra of the points to line `b` of the band.
    ///
    /// - `sums`: buffers for the real and the imaginary parts of the band
    fn add_points(
        &self,
        b: usize,
        points: &[PointSpectrum],
        line: &mut [Complex32],
        sums: &mut [Vec<f32>; 2],
    ) {
        if points.is_empty() {
            return;
        }
        let [below, above] = entries(self.bands[0].0.len(), self.sizes[0]);
        let [re, im] = sums;
        let places = || below.clone().chain(above.clone());
        for ((re, im), at) in re.iter_mut().zip(im.iter_mut()).zip(places()) {
            (*re, *im) = (line[at].re, line[at].im);
        }
        vectorized(
            #[inline(always)]
            || {
                for PointSpectrum { rows, columns } in points {
                    add_multiple(re, im, columns[b], rows);
                }
            },
        );
        for ((re, im), at) in re.iter().zip(im.iter()).zip(places()) {
            line[at] = Complex32::new(*re, *im);
        }
    }
}

/// Adds a multiple of complex values, with separate real and imaginary parts so that the loop vectorises.
#[inline(always)]
fn add_multiple(
    sum_re: &mut [f32],
    sum_im: &mut [f32],
    factor: Complex32,
    (re, im): &(Vec<f32>, Vec<f32>),
) {
    let sums = sum_re.iter_mut().zip(sum_im);
    for ((sum_re, sum_im), (re, im)) in sums.zip(re.iter().zip(im)) {
        *sum_re += factor.re * re - factor.im * im;
        *sum_im += factor.re * im + factor.im * re;
    }
}

/// Factors of a point at the frequencies of the row band and of the column band.
struct PointSpectrum {
    /// Real parts and imaginary parts.
    rows: (Vec<f32>, Vec<f32>),
    columns: Vec<Complex32>,
}

/// Index ranges of a band of `count` frequencies in an FFT of `size` values: negative frequencies, then the others.
fn entries(count: usize, size: usize) -> [Range<usize>; 2] {
    let below = count / 2;
    [size - below..size, 0..count - below]
}

/// Index in an FFT of `size` values of entry `entry` of a band of `count`.
fn place(entry: usize, count: usize, size: usize) -> usize {
    (entry + size - count / 2) % size
}

fn scratch(transform: &Arc<dyn Fft<f32>>) -> Vec<Complex32> {
    vec![Complex32::ZERO; transform.get_inplace_scratch_len()]
}

/// Adds the weighted frequencies of a line at the indices to which sampling aliases them.
fn fold(line: &[Complex32], shift: &[(usize, usize, Complex32)], short: &mut [Complex32]) {
    short.fill(Complex32::ZERO);
    for &(from, to, factor) in shift {
        short[to] += line[from] * factor;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_complex::Complex64;

    /// The defining sum, frequency by frequency, with points as e^{−2πi(a r/M + b c/N)}.
    fn direct(
        plan: &LowPass,
        field: &[Complex32],
        columns: usize,
        points: &[Point],
        window: &Window,
    ) -> Vec<Complex64> {
        let wide = |v: Complex32| Complex64::new(v.re.into(), v.im.into());
        let wave = |turns: f64| Complex64::from_polar(1.0, TAU * turns);
        let [m, n] = plan.sizes.map(|size| size as f64);
        let mut out = Vec::new();
        let deltas: Vec<([f64; 2], Complex64)> = field
            .iter()
            .enumerate()
            .map(|(at, &v)| ([(at / columns) as f64, (at % columns) as f64], wide(v)))
            .chain(points.iter().map(|p| (p.place, wide(p.amplitude))))
            .collect();
        for i in 0..window.keep[0] {
            for j in 0..window.keep[1] {
                let [row, column] =
                    [(0, i), (1, j)].map(|(axis, at)| (window.start[axis] + plan.step * at) as f64);
                let kernel = |axis: usize, size: f64, distance: f64| -> Complex64 {
                    let band = &plan.bands[axis];
                    let terms = band.0.iter().enumerate().map(|(b, &w)| {
                        let frequency = b as f64 - band.highest() as f64;
                        f64::from(w) * wave(frequency * distance / size)
                    });
                    terms.sum::<Complex64>() / size
                };
                out.push(
                    deltas
                        .iter()
                        .map(|([r, c], v)| v * kernel(0, m, row - r) * kernel(1, n, column - c))
                        .sum(),
                );
            }
        }
        out
    }

    #[test]
    fn the_filter_is_its_definition() {
        for (size, step, bands) in [
            ([18, 15], 1, [7, 5]),
            ([37, 20], 2, [9, 11]),
            // Wider than the kept pixels can represent: aliased.
            ([20, 33], 3, [13, 25]),
            ([1, 1], 1, [1, 1]),
        ] {
            let sizes = LowPass::sizes(size, step);
            let band =
                |count: usize, tilt: f32| Band((0..count).map(|n| 1.0 + tilt * n as f32).collect());
            let plan = LowPass::new(sizes, step, [band(bands[0], 0.1), band(bands[1], -0.03)]);
            let value = |n: usize| {
                let x = n as f32;
                Complex32::new((1.7 * x + 0.3 * x * x).sin(), (0.9 * x * x).cos())
            };
            let field: Vec<_> = (0..size[0] * size[1]).map(value).collect();
            let points = [
                Point {
                    place: [0.3 * size[0] as f64, 0.77 * size[1] as f64],
                    amplitude: Complex32::new(2.0, -5.0),
                },
                Point {
                    place: [1.25, 0.5],
                    amplitude: Complex32::new(-1.0, 0.4),
                },
            ];
            let window = Window {
                start: size.map(|n| n / 5),
                keep: size.map(|n| ((n - n / 5) / step).max(1)),
            };
            let mut out = vec![Complex32::ZERO; window.keep[0] * window.keep[1]];
            let fill = |i: usize, row: &mut [Complex32]| {
                row[..size[1]].copy_from_slice(&field[i * size[1]..][..size[1]]);
            };
            let filtered = plan.filtered(size[0], fill, &points, &window);
            plan.kept_rows(&filtered, &mut out, |from, to| to.copy_from_slice(from));
            let expected = direct(&plan, &field, size[1], &points, &window);
            let rms = (expected.iter().map(Complex64::norm_sqr).sum::<f64>()
                / expected.len() as f64)
                .sqrt();
            for (found, expected) in out.iter().zip(expected) {
                let found = Complex64::new(found.re.into(), found.im.into());
                // About twenty f32 roundings of values up to the largest.
                assert!((found - expected).norm() < 4e-6 * rms.max(1.0), "{size:?}");
            }
        }
    }
}
