//! Smoothing with three running means, which together are close to a Gaussian.

use crate::raster::Field;
use rayon::prelude::*;

/// Number of running means in a row; their variances add.
const PASSES: usize = 3;

/// Smooths with a near-Gaussian of standard deviation `std` \[pixels\]; beyond the border the outermost pixel repeats.
///
/// A running mean over 2h + 1 pixels has variance h(h + 1)/3; three of them come within a few per cent of a Gaussian.
#[must_use]
pub fn smooth(field: &Field, std: f64) -> Field {
    let half = half_width(std);
    let mut field = field.clone();
    for _ in 0..2 {
        field
            .values
            .par_chunks_mut(field.columns.max(1))
            .for_each_init(Vec::new, |scratch, row| {
                for _ in 0..PASSES {
                    running_mean(row, half, scratch);
                }
            });
        field = transposed(&field);
    }
    field
}

/// Half-width whose three passes have about the variance `std²`.
fn half_width(std: f64) -> usize {
    let variance = std * std / PASSES as f64;
    (0.5 * ((1.0 + 12.0 * variance).sqrt() - 1.0)).round() as usize
}

fn running_mean(row: &mut [f32], half: usize, scratch: &mut Vec<f32>) {
    let (Some(&first), Some(&last)) = (row.first(), row.last()) else {
        return;
    };
    scratch.clear();
    scratch.extend(std::iter::repeat_n(first, half));
    scratch.extend_from_slice(row);
    scratch.extend(std::iter::repeat_n(last, half));
    let width = 2 * half + 1;
    let mut sum: f64 = scratch[..width].iter().map(|&v| f64::from(v)).sum();
    for (j, value) in row.iter_mut().enumerate() {
        *value = (sum / width as f64) as f32;
        if let Some(&next) = scratch.get(j + width) {
            sum += f64::from(next) - f64::from(scratch[j]);
        }
    }
}

fn transposed(field: &Field) -> Field {
    let (rows, columns) = (field.rows, field.columns);
    let mut values = Vec::with_capacity(field.values.len());
    for j in 0..columns {
        values.extend((0..rows).map(|i| field.values[i * columns + j]));
    }
    Field {
        rows: columns,
        columns: rows,
        values,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::Raster;

    /// The response to a point has the sum 1 and the requested variance along both axes.
    #[test]
    fn a_point_becomes_a_bell_of_the_right_width() {
        let raster = Raster::image(81, 121, 1.0);
        let point = Field::from_fn(&raster, |i, j| f32::from(u8::from(i == 40 && j == 60)));
        for std in [1.5, 3.0, 6.0] {
            let bell = smooth(&point, std);
            let moment = |weight: &dyn Fn(usize, usize) -> f64| {
                let weighted = (0..81 * 121).map(|n| {
                    let (i, j) = (n / 121, n % 121);
                    weight(i, j) * f64::from(bell.at(i, j))
                });
                weighted.sum::<f64>()
            };
            let square = |a: usize, b: usize| (a as f64 - b as f64).powi(2);
            assert!((moment(&|_, _| 1.0) - 1.0).abs() < 1e-5);
            // The half-width is a whole number: h(h + 1) is off by at most h + 1/2 of about 2·std² …
            let exact = {
                let half = half_width(std) as f64;
                half * (half + 1.0)
            };
            for variance in [moment(&|i, _| square(i, 40)), moment(&|_, j| square(j, 60))] {
                assert!((variance / exact - 1.0).abs() < 1e-3, "{std}: {variance}");
            }
            // … so that the width is right to h + 1/2 of the variance.
            assert!((exact - std * std).abs() <= half_width(std) as f64 + 0.75);
        }
    }

    #[test]
    fn a_constant_stays_and_small_fields_pass() {
        for (rows, columns) in [(1, 1), (1, 7), (5, 2), (30, 30)] {
            let field = Field::constant(&Raster::image(rows, columns, 1.0), 2.5);
            let same = smooth(&field, 4.0);
            assert_eq!((same.rows, same.columns), (rows, columns));
            assert!(same.values.iter().all(|v| (v - 2.5).abs() < 1e-6));
        }
    }
}
