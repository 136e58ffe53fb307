//! Velocity bunching: every source pixel is displaced by its velocity and widened by its acceleration.
//!
//! ```text
//! I(y, x) = Σ σ⁰ P(y − y' − (R/V) u_r; ρ') Λ(x − x' + ζ cot θ),     P(y; ρ) ∝ exp(−(π/ρ)² y²)
//! ```
//!
//! P is sampled at the pixels and normalised to sum 1; Λ is the linear (cloud-in-cell) weight in range, whose resolution is
//! the pixel, so that power is conserved. Sources displaced out of the image are lost, sources of the margin may be
//! displaced into it; nothing wraps around.
//!
//! # Validity
//!
//! A source pixel is a point: where ρ' is smaller than the distance between the images of neighbours, the image is grainy.
//! Coherence or many looks fill the gaps, otherwise a finer grid does.
//!
//! # References
//!
//! Alpers and Rufenach (1979), IEEE Trans. Antennas Propag. 27; Hasselmann et al. (1985), J. Geophys. Res. 90.

use crate::numeric::vectorized;
use crate::raster::{Field, Raster};
use crate::sar::imaging::{Imaging, Response, SMALLEST_VARIANCE, Sources, largest};
use crate::sar::taps::{LANES, Steps, gaussian};
use crate::workspace::Workspace;
use rayon::prelude::*;
use std::f64::consts::LOG2_E;
use std::ops::Range;

impl Imaging {
    /// Image before speckle, in units of σ⁰, on the raster `image`.
    ///
    /// - `tolerance`: largest sum of |error| in the response of any one source, relative to its power; thus the mean
    ///   |error| of the image is within `tolerance` of its mean. Rounding to `f32` adds about 1e-6.
    ///
    /// The result does not depend on the number of threads.
    ///
    /// # Panics
    ///
    /// If a field does not match its raster in size, or the rasters' spacings differ.
    #[must_use]
    pub fn image(&self, sources: &Sources<'_>, image: &Raster, tolerance: f64) -> Field {
        self.image_in(&mut Workspace::default(), sources, image, tolerance)
    }

    /// [`Self::image`] with buffers from a workspace.
    pub(crate) fn image_in(
        &self,
        workspace: &mut Workspace,
        sources: &Sources<'_>,
        image: &Raster,
        tolerance: f64,
    ) -> Field {
        sources.check();
        let sum = Sum::new(self, sources, image, tolerance);
        let width = sum.block_width();
        // Each block of columns, `[steps, columns]`, is contiguous.
        let mut steps = workspace.floats.take(sum.count * image.columns);
        steps
            .par_chunks_mut((sum.count * width).max(1))
            .enumerate()
            .for_each_init(Vec::new, |lines, (b, block)| {
                let columns = b * width..((b + 1) * width).min(image.columns);
                vectorized(
                    #[inline(always)]
                    || sum.block(columns, lines, block),
                );
            });
        let mut field = workspace.field(image);
        sum.fill(&mut field, &steps, width);
        workspace.floats.give(steps);
        field
    }
}

/// Accumulator of one image.
///
/// Columns are summed in blocks, each by one thread, with the sources of neighbouring columns that lean into it; the rows
/// of a block are steps of [`Steps`].
struct Sum<'a> {
    sources: &'a Sources<'a>,
    image: &'a Raster,
    response: Response,
    steps: Steps,
    /// Columns by which a source may be displaced, rounded up.
    lean: usize,
    /// Steps before row 0 of the image and after its last row.
    pad: usize,
    /// Number of steps.
    count: usize,
    filling_first: i64,
    filling: Vec<Vec<f32>>,
}

impl<'a> Sum<'a> {
    fn new(imaging: &Imaging, sources: &'a Sources<'a>, image: &'a Raster, tolerance: f64) -> Self {
        let response = Response::new(imaging, &sources.raster, image);
        let steps = Steps::new(response.variance_at(0.0), tolerance);
        let (filling_first, filling) = steps.filling_taps();
        let widest = response.variance_at(largest(sources.radial_acceleration));
        let lean = largest(sources.elevation) * response.columns_per_elevation;
        let pad = steps.taps(widest as f32) + filling_first.unsigned_abs() as usize + 1;
        Self {
            sources,
            image,
            response,
            lean: lean.ceil() as usize + usize::from(lean > 0.0),
            pad,
            count: image.rows.div_ceil(steps.step) + 2 * pad,
            steps,
            filling_first,
            filling,
        }
    }

    /// Columns per block: enough blocks for many threads, few sources processed twice.
    fn block_width(&self) -> usize {
        (self.image.columns / 16).clamp(8, 32).max(2 * self.lean)
    }

    /// Columns of the sources that can reach the given columns of the image.
    fn reaching(&self, columns: &Range<usize>) -> Range<usize> {
        let to_source = |column: usize, lean: i64| {
            let j = column as i64 + lean - self.response.offset[1];
            j.clamp(0, self.sources.raster.columns as i64) as usize
        };
        let lean = self.lean as i64;
        to_source(columns.start, -lean)..to_source(columns.end, lean)
    }

    /// Writes the steps of the given columns, `[steps, columns]`; `values` is a buffer.
    #[inline(always)]
    fn block(&self, columns: Range<usize>, values: &mut Vec<f32>, block: &mut [f32]) {
        let reaching = self.reaching(&columns);
        values.clear();
        values.resize(self.count * columns.len(), 0.0);
        let mut lines = Lines {
            values,
            count: self.count,
            columns: columns.len() as i32,
        };
        let first = reaching.start as i64 + self.response.offset[1] - columns.start as i64;
        let (mut taps, mut places) = (Taps::default(), Places::default());
        for i in 0..self.sources.raster.rows {
            let row = SourceRow::new(self.sources, i, &reaching);
            self.place_row(i, &row, &mut places);
            self.add_row(&row, &places, first as i32, &mut taps, &mut lines);
        }
        lines.transpose(block);
    }

    /// Computes where the sources of row `i` are imaged.
    #[inline(always)]
    fn place_row(&self, i: usize, row: &SourceRow<'_>, places: &mut Places) {
        let step = self.steps.step as f64;
        let place = (i as i64 + self.response.offset[0]) as f64 / step + self.pad as f64;
        let (start, fraction) = (place.floor() as i32, place.fract() as f32);
        let per_velocity = -(self.response.rows_per_velocity / step) as f32;
        let per_elevation = -self.response.columns_per_elevation as f32;
        places.resize(row.sigma0.len());
        let Places {
            steps,
            fractions,
            columns,
            shares,
        } = places;
        split(steps, fractions, fraction, per_velocity, row.velocity);
        steps.iter_mut().for_each(|step| *step += start);
        split(columns, shares, 0.0, per_elevation, row.elevation);
    }

    /// Adds the sources of one row; `first` is the column of the first in the block.
    #[inline(always)]
    fn add_row(
        &self,
        row: &SourceRow<'_>,
        places: &Places,
        first: i32,
        taps: &mut Taps,
        lines: &mut Lines<'_>,
    ) {
        for (j, &sigma0) in row.sigma0.iter().enumerate() {
            taps.set(self, places.fractions[j], value(row.acceleration, j));
            let from = i64::from(places.steps[j]) - taps.before as i64;
            let Ok(from) = usize::try_from(from) else {
                continue;
            };
            let share = places.shares[j];
            let power = sigma0 * taps.scale;
            let target = first + j as i32 + places.columns[j];
            let values = &taps.values[..taps.count];
            lines.add(target, from, values, power * (1.0 - share));
            if share > 0.0 {
                lines.add(target + 1, from, values, power * share);
            }
        }
    }

    /// Fills the rows between the steps, row by row.
    fn fill(&self, image: &mut Field, steps: &[f32], width: usize) {
        let columns = self.image.columns.max(1);
        image
            .values
            .par_chunks_mut(columns)
            .enumerate()
            .for_each(|(m, row)| {
                vectorized(
                    #[inline(always)]
                    || self.fill_row(m, row, steps, width),
                );
            });
    }

    #[inline(always)]
    fn fill_row(&self, m: usize, row: &mut [f32], steps: &[f32], width: usize) {
        row.fill(0.0);
        let blocks = steps.chunks((self.count * width).max(1));
        let weights = &self.filling[m % self.steps.step];
        let first = (m / self.steps.step + self.pad) as i64 + self.filling_first;
        for (out, block) in row.chunks_mut(width).zip(blocks) {
            let start = first as usize * out.len();
            let steps = block[start..].chunks_exact(out.len());
            for (&weight, step) in weights.iter().zip(steps).filter(|(w, _)| **w > 0.0) {
                for (out, &value) in out.iter_mut().zip(step) {
                    *out += weight * value;
                }
            }
        }
    }
}

/// Positions at which the sources of a row are imaged.
#[derive(Default)]
struct Places {
    /// Step at or before each source, and the fraction of a step beyond it, 0 to 1.
    steps: Vec<i32>,
    fractions: Vec<f32>,
    /// Columns by which each source leans, rounded down, and the share of the next column.
    columns: Vec<i32>,
    shares: Vec<f32>,
}

impl Places {
    fn resize(&mut self, sources: usize) {
        self.steps.resize(sources, 0);
        self.fractions.resize(sources, 0.0);
        self.columns.resize(sources, 0);
        self.shares.resize(sources, 0.0);
    }
}

/// Splits positions `start + factor·value` into the largest integers not above them and the remainders.
#[inline(always)]
fn split(whole: &mut [i32], rest: &mut [f32], start: f32, factor: f32, values: Option<&[f32]>) {
    let apart = |at: f32| (floor(at), at - floor(at) as f32);
    match values {
        None => {
            whole.fill(apart(start).0);
            rest.fill(apart(start).1);
        }
        Some(values) => {
            for ((whole, rest), &value) in whole.iter_mut().zip(rest).zip(values) {
                (*whole, *rest) = apart(start + factor * value);
            }
        }
    }
}

/// Largest integer not above x; [`f32::floor`] is a function call without SSE 4.1.
#[inline(always)]
fn floor(x: f32) -> i32 {
    let cut = x as i32;
    cut - i32::from(x < cut as f32)
}

/// One row of the sources, cut to the relevant columns.
struct SourceRow<'a> {
    sigma0: &'a [f32],
    velocity: Option<&'a [f32]>,
    acceleration: Option<&'a [f32]>,
    elevation: Option<&'a [f32]>,
}

impl<'a> SourceRow<'a> {
    fn new(sources: &Sources<'a>, row: usize, columns: &Range<usize>) -> Self {
        let start = row * sources.raster.columns;
        let range = start + columns.start..start + columns.end.max(columns.start);
        let cut = |field: &'a Field| &field.values[range.clone()];
        Self {
            sigma0: cut(sources.sigma0),
            velocity: sources.radial_velocity.map(cut),
            acceleration: sources.radial_acceleration.map(cut),
            elevation: sources.elevation.map(cut),
        }
    }
}

#[inline(always)]
fn value(row: Option<&[f32]>, column: usize) -> f32 {
    row.map_or(0.0, |row| row[column])
}

/// The taps of the last source, kept while the next source has the same fraction of a step and the same width.
#[derive(Default)]
struct Taps {
    key: Option<(f32, f32)>,
    values: Vec<f32>,
    count: usize,
    /// Taps before the step at or before the source.
    before: usize,
    /// Factor that normalises their sum to 1.
    scale: f32,
}

impl Taps {
    #[inline(always)]
    fn set(&mut self, sum: &Sum<'_>, fraction: f32, acceleration: f32) {
        if self.key == Some((fraction, acceleration)) {
            return;
        }
        let smallest = SMALLEST_VARIANCE as f32;
        let response = &sum.response;
        let variance = (response.variance as f32
            + response.variance_per_square as f32 * acceleration * acceleration)
            .max(smallest);
        self.count = sum.steps.taps(variance);
        if self.values.len() < self.count {
            self.values.resize(self.count, 0.0);
        }
        self.before = self.count / 2 - 1;
        let step = sum.steps.step as f32;
        let scale = 0.5 * LOG2_E as f32 * step * step / (variance - sum.steps.filling as f32);
        let centre = self.before as f32 + fraction;
        self.scale = 1.0 / gaussian(&mut self.values[..self.count], centre, scale);
        self.key = Some((fraction, acceleration));
    }
}

/// The columns of a block, each contiguous.
struct Lines<'a> {
    /// `[columns, count]`.
    values: &'a mut [f32],
    count: usize,
    columns: i32,
}

impl Lines<'_> {
    /// Adds `power × taps` to a column from step `from`; parts outside are lost.
    #[inline(always)]
    fn add(&mut self, column: i32, from: usize, taps: &[f32], power: f32) {
        if column < 0 || column >= self.columns || from + taps.len() > self.count {
            return;
        }
        let start = column as usize * self.count + from;
        let line = &mut self.values[start..start + taps.len()];
        let groups = line.as_chunks_mut::<LANES>().0;
        for (line, taps) in groups.iter_mut().zip(taps.as_chunks::<LANES>().0) {
            // Through copies, so that loads and stores of a group become one instruction each.
            let (mut sum, taps) = (*line, *taps);
            for (sum, tap) in sum.iter_mut().zip(taps) {
                *sum += power * tap;
            }
            *line = sum;
        }
    }

    /// Writes `[count, columns]`.
    #[inline(always)]
    fn transpose(&self, values: &mut [f32]) {
        let columns = self.columns as usize;
        for (j, line) in self.values.chunks_exact(self.count).enumerate() {
            for (n, &v) in line.iter().enumerate() {
                values[n * columns + j] = v;
            }
        }
    }
}

#[cfg(test)]
mod tests;
