//! Pixels and their positions: the raster on which every stage works, and fields on it.

use crate::numeric::vectorized;
use rayon::prelude::*;

/// Values per parallel task.
const CHUNK: usize = 1 << 14;

/// Number of partial sums computed in parallel lanes.
const LANES: usize = 8;

/// A grid of square pixels over the sea.
///
/// Row 0 is the largest azimuth y, column 0 the smallest ground range x; the pixel
/// `[origin_row, origin_column]` is the origin:
///
/// ```text
/// x(j) = (j − origin_column)·spacing        y(i) = (origin_row − i)·spacing
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Raster {
    /// Number of rows, along azimuth, at least 1.
    pub rows: usize,
    /// Number of columns, along ground range, at least 1.
    pub columns: usize,
    /// Pixel size \[m\], above 0.
    pub spacing: f64,
    /// Row of the origin; may lie outside the raster.
    pub origin_row: i64,
    /// Column of the origin; may lie outside the raster.
    pub origin_column: i64,
}

impl Raster {
    /// The raster of an image: the origin is the pixel `[rows/2, columns/2]`.
    #[must_use]
    pub fn image(rows: usize, columns: usize, spacing: f64) -> Self {
        Self {
            rows,
            columns,
            spacing,
            origin_row: (rows / 2) as i64,
            origin_column: (columns / 2) as i64,
        }
    }

    /// The raster extended by `rows` above and below and `columns` left and right.
    #[must_use]
    pub fn with_margin(&self, rows: usize, columns: usize) -> Self {
        Self {
            rows: self.rows + 2 * rows,
            columns: self.columns + 2 * columns,
            spacing: self.spacing,
            origin_row: self.origin_row + rows as i64,
            origin_column: self.origin_column + columns as i64,
        }
    }

    /// The raster of the given rows.
    pub(crate) fn strip(&self, rows: &std::ops::Range<usize>) -> Self {
        Self {
            rows: rows.len(),
            origin_row: self.origin_row - rows.start as i64,
            ..*self
        }
    }

    /// Raster with `divisions` times finer pixels that covers these pixels. The centre of each pixel is the centre of a
    /// finer one; where half a finer pixel would be left at the edge, there is a whole one.
    pub(crate) fn divided(&self, divisions: usize) -> Self {
        let half = divisions / 2;
        let size = |n: usize| n.saturating_sub(1) * divisions + 1 + 2 * half;
        Self {
            rows: size(self.rows),
            columns: size(self.columns),
            spacing: self.spacing / divisions as f64,
            origin_row: self.origin_row * divisions as i64 + half as i64,
            origin_column: self.origin_column * divisions as i64 + half as i64,
        }
    }

    /// Rows and columns of every `step`-th pixel from the first, plus one more for interpolation.
    pub(crate) fn every(&self, step: usize) -> [usize; 2] {
        [self.rows, self.columns].map(|n| n.div_ceil(step) + 1)
    }

    /// Number of pixels.
    #[must_use]
    pub fn len(&self) -> usize {
        self.rows * self.columns
    }

    /// Whether there is no pixel.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Ground range of a column \[m\].
    #[must_use]
    pub fn x(&self, column: usize) -> f64 {
        (column as i64 - self.origin_column) as f64 * self.spacing
    }

    /// Azimuth of a row \[m\].
    #[must_use]
    pub fn y(&self, row: usize) -> f64 {
        (self.origin_row - row as i64) as f64 * self.spacing
    }

    /// Fractional pixel coordinates (column, row) of the point (x, y) \[m\].
    #[must_use]
    pub fn pixel(&self, x: f64, y: f64) -> [f64; 2] {
        [
            self.origin_column as f64 + x / self.spacing,
            self.origin_row as f64 - y / self.spacing,
        ]
    }

    /// Largest wavenumber that pixels resolve, π/spacing [rad/m]; "resolved" means |k| at most this.
    #[must_use]
    pub(crate) fn nyquist_wavenumber(&self) -> f64 {
        std::f64::consts::PI / self.spacing
    }
}

/// One value per pixel, row after row; empty by default.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Field {
    /// Number of rows.
    pub rows: usize,
    /// Number of columns.
    pub columns: usize,
    /// The values `[rows, columns]`, row after row.
    pub values: Vec<f32>,
}

impl Field {
    /// A field with the same value everywhere.
    #[must_use]
    pub fn constant(raster: &Raster, value: f32) -> Self {
        Self {
            rows: raster.rows,
            columns: raster.columns,
            values: vec![value; raster.len()],
        }
    }

    /// A field from a function of (row, column), computed row by row in parallel.
    #[must_use]
    pub fn from_fn(raster: &Raster, value: impl Fn(usize, usize) -> f32 + Sync) -> Self {
        let mut field = Self::constant(raster, 0.0);
        field.fill_from_fn(value);
        field
    }

    /// Overwrites the values with a function of (row, column), row by row in parallel.
    pub(crate) fn fill_from_fn(&mut self, value: impl Fn(usize, usize) -> f32 + Sync) {
        self.values
            .par_chunks_mut(self.columns.max(1))
            .enumerate()
            .for_each(|(i, row)| {
                for (j, v) in row.iter_mut().enumerate() {
                    *v = value(i, j);
                }
            });
    }

    /// The value at `[row, column]`.
    ///
    /// # Panics
    ///
    /// If the pixel lies outside the field.
    #[must_use]
    pub fn at(&self, row: usize, column: usize) -> f32 {
        self.values[row * self.columns + column]
    }

    /// Changes every pixel using a smooth field that is given at every `step`-th pixel of a whole raster and interpolated
    /// linearly; this field is the strip of that raster from row `first`.
    ///
    /// # Panics
    ///
    /// If the coarse field has fewer values than [`Raster::every`] pixels.
    pub(crate) fn change_with(
        &mut self,
        coarse: &Self,
        step: usize,
        first: usize,
        change: impl Fn(&mut f32, f32) + Sync,
    ) {
        let to_the_right: Vec<f32> = (0..step).map(|k| k as f32 / step as f32).collect();
        let rows = self.values.par_chunks_mut(self.columns.max(1));
        rows.enumerate().for_each_init(
            || vec![0.0f32; coarse.columns],
            |line, (i, row)| {
                let i = first + i;
                let down = (i % step) as f32 / step as f32;
                let [above, below] = [0, 1]
                    .map(|n| &coarse.values[(i / step + n) * coarse.columns..][..coarse.columns]);
                for (value, (a, b)) in line.iter_mut().zip(above.iter().zip(below)) {
                    *value = a + down * (b - a);
                }
                for (row, ends) in row.chunks_mut(step).zip(line.windows(2)) {
                    for (value, right) in row.iter_mut().zip(&to_the_right) {
                        change(value, ends[0] + right * (ends[1] - ends[0]));
                    }
                }
            },
        );
    }

    /// Adds a·b, value by value.
    ///
    /// # Panics
    ///
    /// If the fields differ in size.
    pub(crate) fn add_product(&mut self, a: &Self, b: &Self) {
        assert!(
            a.values.len() == self.values.len() && b.values.len() == self.values.len(),
            "fields of different sizes"
        );
        let factors = a.values.par_chunks(CHUNK).zip(b.values.par_chunks(CHUNK));
        let sums = self.values.par_chunks_mut(CHUNK).zip(factors);
        sums.for_each(|(sums, (a, b))| {
            vectorized(
                #[inline(always)]
                || {
                    for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
                        *sum += a * b;
                    }
                },
            );
        });
    }

    /// The middle of the field, without `rows` above and below and `columns` left and right.
    ///
    /// # Panics
    ///
    /// If the margins are larger than the field.
    #[must_use]
    pub fn crop(mut self, rows: usize, columns: usize) -> Self {
        let (height, width) = (self.rows - 2 * rows, self.columns - 2 * columns);
        // In place: rows move toward the start and never overwrite rows still to be moved.
        for i in 0..height {
            let start = (i + rows) * self.columns + columns;
            self.values.copy_within(start..start + width, i * width);
        }
        self.values.truncate(height * width);
        Self {
            rows: height,
            columns: width,
            values: self.values,
        }
    }

    /// Mean of the values, summed in double precision.
    #[must_use]
    pub fn mean(&self) -> f64 {
        self.sum_of(|v| v) / self.values.len().max(1) as f64
    }

    /// Root mean square of the values.
    #[must_use]
    pub fn rms(&self) -> f64 {
        (self.sum_of(|v| v * v) / self.values.len().max(1) as f64).sqrt()
    }

    /// Sum of a function of the values, in an order independent of the number of threads.
    fn sum_of(&self, term: impl Fn(f64) -> f64 + Sync) -> f64 {
        let of_chunk = |chunk: &[f32]| {
            vectorized(
                #[inline(always)]
                || {
                    let mut sums = [0.0; LANES];
                    let (groups, rest) = chunk.as_chunks::<LANES>();
                    for group in groups {
                        for (sum, &v) in sums.iter_mut().zip(group) {
                            *sum += term(f64::from(v));
                        }
                    }
                    let rest: f64 = rest.iter().map(|&v| term(f64::from(v))).sum();
                    sums.iter().sum::<f64>() + rest
                },
            )
        };
        let parts: Vec<f64> = self.values.par_chunks(CHUNK).map(of_chunk).collect();
        parts.iter().sum()
    }

    /// Largest and root mean square absolute difference from another field.
    ///
    /// # Panics
    ///
    /// If the sizes differ.
    #[must_use]
    pub fn difference(&self, other: &Self) -> (f64, f64) {
        assert_eq!(
            (self.rows, self.columns),
            (other.rows, other.columns),
            "the fields differ in size"
        );
        let (mut max, mut sum) = (0.0f64, 0.0);
        for (&a, &b) in self.values.iter().zip(&other.values) {
            let d = (f64::from(a) - f64::from(b)).abs();
            max = max.max(d);
            sum += d * d;
        }
        (max, (sum / self.values.len().max(1) as f64).sqrt())
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "values that must be the same bits")]
mod tests {
    use super::*;

    /// A plane is interpolated exactly up to rounding.
    #[test]
    fn interpolation_is_exact_for_a_plane() {
        let r = Raster::image(13, 10, 1.0);
        for step in [1, 3, 4] {
            let [rows, columns] = r.every(step);
            let coarse = Field::from_fn(&Raster::image(rows, columns, 1.0), |i, j| {
                (step * (3 * i + 2 * j)) as f32
            });
            let mut field = Field::constant(&r, 1.0);
            field.change_with(&coarse, step, 0, |value, plane| *value += plane);
            for i in 0..13 {
                for j in 0..10 {
                    let expected = (3 * i + 2 * j) as f32 + 1.0;
                    assert!((field.at(i, j) - expected).abs() < 1e-4, "{step} {i} {j}");
                }
            }
        }
    }

    #[test]
    fn origin_is_the_middle_pixel() {
        for (rows, columns) in [(1, 1), (4, 6), (5, 7)] {
            let r = Raster::image(rows, columns, 2.5);
            assert_eq!(r.x(columns / 2), 0.0);
            assert_eq!(r.y(rows / 2), 0.0);
            assert_eq!(r.pixel(0.0, 0.0), [(columns / 2) as f64, (rows / 2) as f64]);
        }
    }

    #[test]
    fn up_is_azimuth_and_right_is_range() {
        let r = Raster::image(8, 8, 2.0);
        assert!(r.y(0) > r.y(7));
        assert!(r.x(7) > r.x(0));
        assert_eq!(r.pixel(r.x(6), r.y(3)), [6.0, 3.0]);
    }

    #[test]
    fn a_margin_moves_no_pixel_and_crop_takes_it_away() {
        let r = Raster::image(3, 5, 1.5);
        let wide = r.with_margin(2, 1);
        assert_eq!(wide.x(1), r.x(0));
        assert_eq!(wide.y(2), r.y(0));
        let inner = Field::from_fn(&r, |i, j| (10.0 * r.y(i) + r.x(j)) as f32);
        let outer = Field::from_fn(&wide, |i, j| (10.0 * wide.y(i) + wide.x(j)) as f32);
        assert_eq!(outer.crop(2, 1), inner);
    }
}
