//! Spreading: each wave adds its kernel to the lattice points around its wavenumber.

use super::kernel::{Kernel, WIDEST};
use crate::fft::Real;
use crate::numeric::vectorized;
use num_complex::Complex;
use rayon::prelude::*;

/// Lines of the transposed lattice that one task owns.
const LINES: usize = 16;

/// Footprints per parallel task.
const TOGETHER: usize = 256;

/// Number of footprints from which they are sorted in parallel. Chosen: the two sorts order equal keys differently, so sums
/// differ by rounding, and ships on straight courses have fewer waves.
const MANY: usize = 1 << 19;

/// Lattice points and weights of each wave and its mirror image (wavenumber −k).
///
/// Sorted by line, so that a task finds the waves that touch its own lines.
#[derive(Debug)]
pub(crate) struct Footprints<T> {
    width: usize,
    lattice: [usize; 2],
    /// (first column, first row, wave, mirrored), by column.
    places: Vec<Place>,
    /// Weights along x then along y, `2·width` for each place.
    weights: Vec<T>,
}

/// Content of a lattice before waves are added.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Before {
    /// Arbitrary: it is cleared first.
    Nothing,
    /// Other waves.
    Waves,
}

#[derive(Debug, Clone, Copy)]
struct Place {
    column: u32,
    row: u32,
    wave: u32,
    mirrored: bool,
}

impl<T: Real> Footprints<T> {
    /// - `waves`: wavenumbers in lattice steps (along y, along x)
    pub(crate) fn new(waves: &[[f64; 2]], kernel: &Kernel, lattice: [usize; 2]) -> Self {
        let width = kernel.width;
        let place = |n: usize| {
            let (wave, mirrored) = (n / 2, n % 2 == 1);
            let [row, column] = [0, 1].map(|axis| {
                let g = signed(waves[wave][axis], mirrored);
                first_point(g, width).rem_euclid(lattice[axis] as i64) as u32
            });
            Place {
                column,
                row,
                wave: wave as u32,
                mirrored,
            }
        };
        let all = (0..2 * waves.len()).into_par_iter().with_min_len(TOGETHER);
        let mut places: Vec<Place> = all.map(place).collect();
        let key = |place: &Place| (place.column, place.row);
        if places.len() < MANY {
            places.sort_unstable_by_key(key);
        } else {
            places.par_sort_unstable_by_key(key);
        }
        let mut weights = vec![T::zero(); 2 * width * places.len()];
        weights
            .par_chunks_mut(2 * width * TOGETHER)
            .zip(places.par_chunks(TOGETHER))
            .for_each(|(weights, places)| {
                vectorized(
                    #[inline(always)]
                    || {
                        for (out, place) in weights.chunks_exact_mut(2 * width).zip(places) {
                            let [along_y, along_x] =
                                waves[place.wave as usize].map(|g| signed(g, place.mirrored));
                            let (x, y) = out.split_at_mut(width);
                            fill(x, along_x, kernel);
                            fill(y, along_y, kernel);
                        }
                    },
                );
            });
        Self {
            width,
            lattice,
            places,
            weights,
        }
    }

    /// Adds all waves to the transposed lattice `[columns, rows]`.
    ///
    /// `strengths` holds for each wave the strengths at its wavenumber k and at −k.
    pub(crate) fn spread(
        &self,
        strengths: &[[Complex<T>; 2]],
        lattice: &mut [Complex<T>],
        before: Before,
    ) {
        let rows = self.lattice[0];
        lattice
            .par_chunks_mut(LINES * rows)
            .enumerate()
            .for_each(|(bin, lines)| {
                vectorized(
                    #[inline(always)]
                    || {
                        if before == Before::Nothing {
                            lines.fill(Complex::new(T::zero(), T::zero()));
                        }
                        self.spread_lines(bin, strengths, lines);
                    },
                );
            });
    }

    /// Adds all waves that touch the lines of a task.
    #[inline(always)]
    fn spread_lines(&self, bin: usize, strengths: &[[Complex<T>; 2]], lines: &mut [Complex<T>]) {
        let rows = self.lattice[0];
        let first = bin * LINES;
        let last = first + lines.len() / rows;
        // Kernels that begin in the bin or up to width − 1 columns before it, with wrap-around.
        let before = first as i64 - self.width as i64 + 1;
        self.add(
            self.range(before.max(0), last as i64),
            first,
            strengths,
            lines,
        );
        if before < 0 {
            let wrapped = before + self.lattice[1] as i64;
            let from = wrapped.max(last as i64);
            self.add(
                self.range(from, self.lattice[1] as i64),
                first,
                strengths,
                lines,
            );
        }
    }

    /// Places whose first column lies in [from, to).
    fn range(&self, from: i64, to: i64) -> std::ops::Range<usize> {
        let start = self.places.partition_point(|p| i64::from(p.column) < from);
        let end = self.places.partition_point(|p| i64::from(p.column) < to);
        start..end.max(start)
    }

    #[inline(always)]
    fn add(
        &self,
        places: std::ops::Range<usize>,
        first: usize,
        strengths: &[[Complex<T>; 2]],
        lines: &mut [Complex<T>],
    ) {
        let [rows, columns] = self.lattice;
        let w = self.width;
        for index in places {
            let place = self.places[index];
            let strength = strengths[place.wave as usize][usize::from(place.mirrored)];
            let (along_x, along_y) = self.weights[2 * w * index..2 * w * (index + 1)].split_at(w);
            for (dx, &weight) in along_x.iter().enumerate() {
                let column = (place.column as usize + dx) % columns;
                let Some(line) = column.checked_sub(first).filter(|l| l * rows < lines.len())
                else {
                    continue;
                };
                let line = &mut lines[line * rows..(line + 1) * rows];
                add_wrapped(line, place.row as usize, strength * weight, along_y);
            }
        }
    }
}

/// Adds `strength` times the weights to a line from index `start`, with wrap-around.
#[inline(always)]
fn add_wrapped<T: Real>(
    line: &mut [Complex<T>],
    start: usize,
    strength: Complex<T>,
    weights: &[T],
) {
    let until_end = weights.len().min(line.len() - start);
    let (here, beyond) = weights.split_at(until_end);
    for (v, &w) in line[start..].iter_mut().zip(here) {
        *v = *v + strength * w;
    }
    for (v, &w) in line.iter_mut().zip(beyond) {
        *v = *v + strength * w;
    }
}

fn signed(g: f64, mirrored: bool) -> f64 {
    if mirrored { -g } else { g }
}

/// The first of `width` lattice points around g.
fn first_point(g: f64, width: usize) -> i64 {
    (g - 0.5 * width as f64).ceil() as i64
}

/// Kernel weights around g, with the sign (−1)^index that moves the field's origin to the middle.
#[inline(always)]
fn fill<T: Real>(out: &mut [T], g: f64, kernel: &Kernel) {
    let first = first_point(g, kernel.width);
    let mut values = [0.0; WIDEST];
    let values = &mut values[..kernel.width];
    kernel.values(first as f64 - g, values);
    let mut sign = if first.rem_euclid(2) == 0 { 1.0 } else { -1.0 };
    for (v, value) in out.iter_mut().zip(values) {
        *v = <T as Real>::from_f64(sign * *value);
        sign = -sign;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Spreads enough waves to be sorted in parallel, and the same waves in two parts that are not.
    #[test]
    fn many_waves_are_spread_as_few_are() {
        let kernel = Kernel::new(1e-3, 1.5);
        let lattice = [48, 64];
        let count = MANY / 2 + 100;
        let turn = |n: usize, by: f64| (n as f64 * by).fract() - 0.5;
        let waves: Vec<[f64; 2]> = (0..count)
            .map(|n| [40.0 * turn(n, 0.618_034), 50.0 * turn(n, 0.754_878)])
            .collect();
        let strengths: Vec<[Complex<f64>; 2]> = (0..count)
            .map(|n| [0.3, 0.9].map(|by| Complex::new(turn(n, by * 0.4142), turn(n, by * 0.7321))))
            .collect();
        let sum = |ends: &[usize]| {
            let mut sums = vec![Complex::new(0.0, 0.0); lattice[0] * lattice[1]];
            for part in ends.windows(2).map(|ends| ends[0]..ends[1]) {
                let footprints = Footprints::<f64>::new(&waves[part.clone()], &kernel, lattice);
                footprints.spread(&strengths[part], &mut sums, Before::Waves);
            }
            sums
        };
        let whole = sum(&[0, count]);
        let parts = sum(&[0, count / 2, count]);
        let largest = whole.iter().map(|v| v.norm()).fold(0.0, f64::max);
        for (a, b) in whole.iter().zip(&parts) {
            assert!((a - b).norm() < 1e-10 * largest, "{a} {b}");
        }
    }
}
