//! Reference for velocity bunching: every pixel is summed over all sources, exactly, in double precision; O(N³).

use crate::raster::{Field, Raster};
use crate::sar::geometry::{azimuth_displacement, layover};
use crate::sar::imaging::{Imaging, Sources};
use rayon::prelude::*;
use std::f64::consts::{PI, SQRT_2};

/// Smallest standard deviation of an azimuth response \[pixels\], as in the fast sum.
const SMALLEST_DEVIATION: f64 = 0.5;

/// The bunching integral as a sum over all sources, ready to be evaluated at any pixel.
///
/// Positions are computed in metres from the formulas of the geometry, and widths from the resolution, sharing nothing with
/// [`Imaging::image`]. There is no cut-off, no step and no tolerance.
#[derive(Debug)]
pub struct DirectImage {
    raster: Raster,
    /// For every column of the image, the sources imaged in it.
    columns: Vec<Vec<Source>>,
}

/// A source as it contributes to one column.
#[derive(Debug, Clone, Copy)]
struct Source {
    /// Row at which it is imaged, fractional.
    row: f64,
    /// 1/(2 variance) [1/row²].
    rate: f64,
    /// Power over the sum of its weights.
    power: f64,
}

impl DirectImage {
    /// Computes where all sources are imaged.
    ///
    /// # Panics
    ///
    /// As [`Imaging::image`].
    #[must_use]
    pub fn new(imaging: &Imaging, sources: &Sources<'_>, image: &Raster) -> Self {
        sources.check();
        let mut columns = vec![Vec::new(); image.columns];
        for i in 0..sources.raster.rows {
            for j in 0..sources.raster.columns {
                let (column, source) = place(imaging, sources, image, i, j);
                let left = column.floor();
                let shares = [(left, 1.0 - (column - left)), (left + 1.0, column - left)];
                for (at, share) in shares {
                    if share > 0.0 && at >= 0.0 && at < image.columns as f64 {
                        let power = source.power * share;
                        columns[at as usize].push(Source { power, ..source });
                    }
                }
            }
        }
        Self {
            raster: *image,
            columns,
        }
    }

    /// Intensity of one pixel.
    ///
    /// # Panics
    ///
    /// If the column lies outside the image.
    #[must_use]
    pub fn at(&self, row: usize, column: usize) -> f64 {
        let weight = |s: &Source| s.power * (-(row as f64 - s.row).powi(2) * s.rate).exp();
        self.columns[column].iter().map(weight).sum()
    }

    /// Computes the whole image.
    #[must_use]
    pub fn image(&self) -> Field {
        Field::from_fn(&self.raster, |i, j| self.at(i, j) as f32)
    }
}

/// Standard deviations of a response beyond which a source is ignored: exp(−7²/2) = 2e-11 of its peak.
const REACH: f64 = 7.0;
/// Allowed error of source positions due to errors of their fields \[pixels\]: ten thousand times the displacement by a
/// field error of 1e-6 of its root mean square.
const SLACK: f64 = 0.01;

/// The source pixels `[row, column]` that reach any of the given pixels of the image, each once.
///
/// # Panics
///
/// As [`Imaging::image`].
pub(crate) fn reaching(
    imaging: &Imaging,
    sources: &Sources<'_>,
    image: &Raster,
    pixels: &[[usize; 2]],
) -> Vec<[usize; 2]> {
    sources.check();
    let reaches = |&[i, j]: &[usize; 2]| {
        let (column, source) = place(imaging, sources, image, i, j);
        let rows = REACH * (0.5 / source.rate).sqrt() + SLACK;
        pixels.iter().any(|&[row, at]| {
            (column - at as f64).abs() < 1.0 + SLACK && (source.row - row as f64).abs() < rows
        })
    };
    let columns = sources.raster.columns;
    (0..sources.raster.len())
        .into_par_iter()
        .map(|n| [n / columns, n % columns])
        .filter(reaches)
        .collect()
}

/// Column (fractional) and response of the source pixel `[i, j]`.
fn place(
    imaging: &Imaging,
    sources: &Sources<'_>,
    image: &Raster,
    i: usize,
    j: usize,
) -> (f64, Source) {
    let at = |field: Option<&Field>| field.map_or(0.0, |f| f64::from(f.at(i, j)));
    let x = sources.raster.x(j) + layover(at(sources.elevation), imaging.incidence);
    let displaced = azimuth_displacement(imaging.range_to_velocity, at(sources.radial_velocity));
    let [column, row] = image.pixel(x, sources.raster.y(i) + displaced);
    let resolution = imaging.resolution.at(at(sources.radial_acceleration));
    let deviation = resolution / (SQRT_2 * PI) / image.spacing;
    let variance = deviation.max(SMALLEST_DEVIATION).powi(2);
    let source = Source {
        row,
        rate: 1.0 / (2.0 * variance),
        power: f64::from(sources.sigma0.at(i, j)) / weight_sum(row, variance),
    };
    (column, source)
}

/// Sum over all integers m of exp(−(m − t)²/2v), by Poisson's formula; exact for v ≥ 1/4 after two terms.
///
/// ```text
/// √(2πv) · (1 + 2 Σ_k exp(−2π²k²v) cos 2πkt)
/// ```
pub(super) fn weight_sum(place: f64, variance: f64) -> f64 {
    let term = |k: f64| (-2.0 * (PI * k).powi(2) * variance).exp() * (2.0 * PI * k * place).cos();
    (2.0 * PI * variance).sqrt() * (1.0 + 2.0 * (term(1.0) + term(2.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poisson_sum_is_the_sum() {
        for variance in [0.25, 0.4, 1.0, 30.0] {
            for i in 0..8 {
                let t = 0.125 * f64::from(i);
                let sum: f64 = (-200..200)
                    .map(|m| (-(f64::from(m) - t).powi(2) / (2.0 * variance)).exp())
                    .sum();
                // The first omitted term is exp(−2π²·9/4) = 5e-20.
                assert!((weight_sum(t, variance) / sum - 1.0).abs() < 1e-14);
            }
        }
    }
}
