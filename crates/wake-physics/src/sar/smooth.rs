//! Velocity bunching as a smooth function of its sources, with derivatives: the sum of `bunching` with rounded corners.
//!
//! ```text
//! I(y, x) = Σ σ⁰ P(y − y'; v) H(x − x'),      P(y; v) ∝ exp(−y²/2v)
//! ```
//!
//! P is sampled and normalised as in `bunching`, on steps that are chosen once. The range weight H is linear there and has
//! a corner at each pixel; here the corners are rounded over a thirty-second of a pixel on either side,
//!
//! ```text
//! H(x) = (a(x − 1) − 2 a(x) + a(x + 1))/2,    a(x) = |x|, and (3 + 6 t² − t⁴)/8 · d for t = |x|/d < 1
//! ```
//!
//! so that weights change by at most 3d/8 = 0.012 of the power and still sum to 1.

pub(crate) use super::imaging::SMALLEST_VARIANCE;
use super::imaging::{Imaging, Response};
use super::taps::Steps;
use crate::numeric::{Dual, vectorized};
use crate::raster::{Field, Raster};
use rayon::prelude::*;

/// Distance from a corner within which it is rounded [pixels].
const ROUNDED: f64 = 1.0 / 32.0;

/// Largest share of a source's power that the kernel may misplace.
const TOLERANCE: f64 = 1e-6;

/// Columns of a block without and with derivatives, so that its sums stay in the cache.
const BLOCK: [usize; 2] = [48, 24];

/// A source: its return, and where it is imaged.
pub(crate) struct Source<const N: usize> {
    /// σ⁰.
    pub(crate) power: Dual<N>,
    /// Displacement toward row 0 [rows].
    pub(crate) up: Dual<N>,
    /// Displacement toward column 0 [columns].
    pub(crate) left: Dual<N>,
    /// Variance in azimuth [rows²].
    pub(crate) variance: Dual<N>,
}

/// The imaging sum with its steps chosen.
#[derive(Debug)]
pub(crate) struct SmoothSum {
    sources: Raster,
    image: Raster,
    offset: [i64; 2],
    steps: Steps,
    filling_first: i64,
    filling: Vec<Vec<f32>>,
    /// Columns by which a source may be displaced, rounded up.
    lean: usize,
    /// Steps before row 0 of the image and after its last row.
    pad: usize,
    count: usize,
}

/// Factors from velocity, elevation and acceleration to displacements and widths.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Displacement {
    /// Rows toward row 0 per velocity toward the radar [s/m].
    pub(crate) rows_per_velocity: f64,
    /// Columns toward column 0 per elevation [1/m].
    pub(crate) columns_per_elevation: f64,
    /// Variance in azimuth without acceleration [rows²].
    pub(crate) variance: f64,
    /// Variance per squared acceleration [rows² s⁴/m²].
    pub(crate) variance_per_square: f64,
}

impl Displacement {
    pub(crate) fn new(imaging: &Imaging, sources: &Raster) -> Self {
        let response = Response::new(imaging, sources, sources);
        Self {
            rows_per_velocity: response.rows_per_velocity,
            columns_per_elevation: response.columns_per_elevation,
            variance: response.variance,
            variance_per_square: response.variance_per_square,
        }
    }
}

/// |x| with a rounded corner, and its slope.
#[inline(always)]
fn rounded(x: f64) -> [f64; 2] {
    let t = x / ROUNDED;
    if t.abs() >= 1.0 {
        return [x.abs(), x.signum()];
    }
    let square = t * t;
    [
        ROUNDED * (0.375 + 0.75 * square - 0.125 * square * square),
        t * (1.5 - 0.5 * square),
    ]
}

/// H and its slope at x.
#[inline(always)]
fn hat(x: f64) -> [f64; 2] {
    let [a, b, c] = [x - 1.0, x, x + 1.0].map(rounded);
    [0, 1].map(|n| 0.5 * (a[n] - 2.0 * b[n] + c[n]))
}

impl SmoothSum {
    /// Sum of sources imaged on the pixels of an image.
    ///
    /// - `narrowest`, `widest`: variances in azimuth [rows²]; `lean`: largest displacement in range [columns]
    pub(crate) fn new(
        [sources, image]: [&Raster; 2],
        [narrowest, widest]: [f64; 2],
        lean: f64,
    ) -> Self {
        let steps = Steps::new(narrowest.max(SMALLEST_VARIANCE), TOLERANCE);
        let (filling_first, filling) = steps.filling_taps();
        let pad = steps.taps(widest.max(SMALLEST_VARIANCE) as f32)
            + filling_first.unsigned_abs() as usize
            + 2;
        Self {
            sources: *sources,
            image: *image,
            offset: [
                image.origin_row - sources.origin_row,
                image.origin_column - sources.origin_column,
            ],
            lean: if lean > 0.0 {
                lean.ceil() as usize + 2
            } else {
                0
            },
            pad,
            count: image.rows.div_ceil(steps.step) + 2 * pad,
            steps,
            filling_first,
            filling,
        }
    }

    /// Computes the image and its derivatives by the variables with the indices `by`.
    ///
    /// - `source`: returns the source at a row and column
    pub(crate) fn image<const N: usize>(
        &self,
        by: &[usize],
        source: impl Fn(usize, usize) -> Source<N> + Sync,
    ) -> Vec<Field> {
        let parts = 1 + by.len();
        let columns = self.image.columns;
        let wide = BLOCK[usize::from(N > 0)];
        let blocks: Vec<Vec<f64>> = (0..columns.div_ceil(wide))
            .into_par_iter()
            .map(|b| {
                let range = b * wide..((b + 1) * wide).min(columns);
                let mut lines = vec![0.0; range.len() * parts * self.count];
                vectorized(
                    #[inline(always)]
                    || self.block(by, range.start, range.len(), &source, &mut lines),
                );
                lines
            })
            .collect();
        let mut fields = vec![Field::constant(&self.image, 0.0); parts];
        for (part, field) in fields.iter_mut().enumerate() {
            let rows = field.values.par_chunks_mut(columns.max(1)).enumerate();
            rows.for_each(|(m, row)| {
                let weights = &self.filling[m % self.steps.step];
                let first = (m / self.steps.step + self.pad) as i64 + self.filling_first;
                for (j, value) in row.iter_mut().enumerate() {
                    let line = ((j % wide) * parts + part) * self.count + first as usize;
                    let steps = &blocks[j / wide][line..][..weights.len()];
                    let sum: f64 = steps
                        .iter()
                        .zip(weights)
                        .map(|(s, &w)| s * f64::from(w))
                        .sum();
                    *value = sum as f32;
                }
            });
        }
        fields
    }

    /// Adds all sources that reach the given columns (the first column and their number).
    #[inline(always)]
    fn block<const N: usize>(
        &self,
        by: &[usize],
        first: usize,
        width: usize,
        source: &impl Fn(usize, usize) -> Source<N>,
        lines: &mut [f64],
    ) {
        let to_source = |column: i64| {
            let column = column - self.offset[1];
            column.clamp(0, self.sources.columns as i64) as usize
        };
        let lean = self.lean as i64;
        let reaching = to_source(first as i64 - lean)..to_source((first + width) as i64 + lean);
        let mut taps = Taps::default();
        for i in 0..self.sources.rows {
            for j in reaching.clone() {
                let source = source(i, j);
                let column = j as i64 + self.offset[1] - first as i64;
                self.add(by, [i as i64, column], &source, &mut taps, lines);
            }
        }
    }

    #[inline(always)]
    fn add<const N: usize>(
        &self,
        by: &[usize],
        [row, column]: [i64; 2],
        source: &Source<N>,
        taps: &mut Taps,
        lines: &mut [f64],
    ) {
        let step = self.steps.step as f64;
        let from_top = (row + self.offset[0]) as f64;
        let centre = (from_top - source.up.value) / step + self.pad as f64;
        let variance = source.variance.value;
        let set = match N {
            0 => taps.set::<false>(&self.steps, centre, variance, self.count),
            _ => taps.set::<true>(&self.steps, centre, variance, self.count),
        };
        let Some(start) = set else {
            return;
        };
        let parts = 1 + by.len();
        let width = lines.len() / (parts * self.count);
        let leaning = self.lean > 0;
        let at = -source.left.value;
        let nearest = if leaning { at.round() as i64 } else { 0 };
        let around = if leaning { -1..=1 } else { 0..=0 };
        for d in around {
            let target = column + nearest + d;
            let [weight, slope] = match leaning {
                true => hat((nearest + d) as f64 - at),
                false => [1.0, 0.0],
            };
            if target < 0 || target >= width as i64 || (weight == 0.0 && slope == 0.0) {
                continue;
            }
            let base = target as usize * parts * self.count + start;
            let power = source.power.value;
            let count = taps.count;
            let line = &mut lines[base..base + count];
            add_scaled(line, &taps.values[0], weight * power);
            for (n, &p) in by.iter().enumerate() {
                let line = &mut lines[base + (n + 1) * self.count..][..count];
                // The hat moves by d(target − at) = d left.
                let by_power = weight * source.power.by[p] + power * slope * source.left.by[p];
                let by_centre = -weight * power * source.up.by[p] / step;
                let by_variance = weight * power * source.variance.by[p];
                add_three(line, taps, [by_power, by_centre, by_variance]);
            }
        }
    }
}

/// Response of one source on the steps, and its derivatives by position and variance.
#[derive(Default)]
struct Taps {
    values: [Vec<f64>; 3],
    count: usize,
}

impl Taps {
    /// Returns the first step, or `None` for a source beyond the steps.
    ///
    /// - `BY`: whether to compute derivatives
    #[inline(always)]
    fn set<const BY: bool>(
        &mut self,
        steps: &Steps,
        centre: f64,
        variance: f64,
        most: usize,
    ) -> Option<usize> {
        let variance = variance.max(SMALLEST_VARIANCE);
        let count = steps.taps(variance as f32);
        let start = centre.floor() - (count / 2 - 1) as f64;
        if !(start >= 0.0 && start as usize + count <= most) {
            return None;
        }
        for values in &mut self.values {
            values.resize(count, 0.0);
        }
        self.count = count;
        let step = steps.step as f64;
        let narrow = (variance - steps.filling) / (step * step);
        let scale = 0.5 / narrow;
        let offset = start - centre;
        let [values, places, widths] = &mut self.values;
        let mut sums = [0.0; 3];
        for (n, value) in values.iter_mut().enumerate() {
            let d = n as f64 + offset;
            *value = crate::numeric::vector::exp(-d * d * scale);
        }
        if !BY {
            let norm = 1.0 / values.iter().sum::<f64>();
            values.iter_mut().for_each(|value| *value *= norm);
            return Some(start as usize);
        }
        for n in 0..count {
            let (d, value) = (n as f64 + offset, values[n]);
            places[n] = value * d / narrow;
            widths[n] = value * d * d * scale / (narrow * step * step);
        }
        for n in 0..count {
            sums[0] += values[n];
            sums[1] += places[n];
            sums[2] += widths[n];
        }
        // Normalises the response to sum 1.
        let norm = 1.0 / sums[0];
        let [by_place, by_width] = [sums[1] * norm, sums[2] * norm];
        for n in 0..count {
            places[n] = (places[n] - by_place * values[n]) * norm;
            widths[n] = (widths[n] - by_width * values[n]) * norm;
            values[n] *= norm;
        }
        Some(start as usize)
    }
}

#[inline(always)]
fn add_scaled(line: &mut [f64], taps: &[f64], factor: f64) {
    for (sum, tap) in line.iter_mut().zip(taps) {
        *sum += factor * tap;
    }
}

#[inline(always)]
fn add_three(line: &mut [f64], taps: &Taps, [a, b, c]: [f64; 3]) {
    let [values, places, widths] = &taps.values;
    let each = line.iter_mut().zip(values).zip(places).zip(widths);
    for (((sum, value), place), width) in each {
        *sum += a * value + b * place + c * width;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_of_range_sum_to_one_and_their_slopes_to_nothing() {
        for n in 0..200 {
            let at = 0.01 * f64::from(n) - 1.0;
            let nearest = at.round();
            let each = [-1.0, 0.0, 1.0].map(|d| hat(nearest + d - at));
            let sum = |k: usize| each.iter().map(|h| h[k]).sum::<f64>();
            assert!((sum(0) - 1.0).abs() < 1e-12 && sum(1).abs() < 1e-12, "{at}");
            let linear = (1.0 - (nearest - at).abs()).max(0.0);
            assert!((each[1][0] - linear).abs() < 0.375 * ROUNDED + 1e-12);
        }
    }
}
