//! Pixels of the oracles, and rows of their results.

use crate::bench::row::{Errors, Row};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use wake_physics::{Field, Raster};

/// Runs of a fast method, and of a short matrix product.
pub(crate) const RUNS: usize = 5;
/// Pixels of an oracle if the whole raster takes too long.
const SAMPLE: usize = 4_096;
/// Pixels of the quadrature of σ⁰, which takes a millisecond each.
pub(crate) const QUADRATURES: usize = 1_024;
/// Largest raster, as pixels along a side, on which the oracles run on all pixels.
pub(crate) const WHOLE: usize = 128;

/// Pixels of the oracle, and the ratio of all pixels to these.
pub(crate) fn pixels(raster: &Raster) -> (Vec<[usize; 2]>, f64) {
    if raster.rows <= WHOLE {
        let all = (0..raster.len()).map(|n| [n / raster.columns, n % raster.columns]);
        return (all.collect(), 1.0);
    }
    (sample(raster, SAMPLE), raster.len() as f64 / SAMPLE as f64)
}

/// Random pixels of a raster.
pub(crate) fn sample(raster: &Raster, count: usize) -> Vec<[usize; 2]> {
    let mut random = StdRng::seed_from_u64(1);
    let mut one = || [raster.rows, raster.columns].map(|n| random.random_range(0..n));
    (0..count).map(|_| one()).collect()
}

/// A row without a matrix product.
pub(crate) fn row(
    stage: &'static str,
    raster: &Raster,
    tolerance: Option<f64>,
    fast_seconds: f64,
    (oracle_seconds, pixels): (f64, usize),
    errors: Errors,
) -> Row {
    Row {
        stage,
        size: raster.rows,
        tolerance,
        fast_seconds,
        oracle_seconds,
        pixels,
        matrix_product_seconds: None,
        ratio: oracle_seconds / fast_seconds,
        max_error: errors.max,
        rms_error: errors.rms,
    }
}

/// A row that compares a field with exact values at some of its pixels, relative to its mean.
pub(crate) fn at_pixels(
    stage: &'static str,
    (raster, tolerance): (&Raster, Option<f64>),
    (fast_seconds, fast): (f64, &Field),
    (seconds, exact): (f64, &[f64]),
    pixels: &[[usize; 2]],
) -> Row {
    let values = pixels.iter().map(|&[i, j]| f64::from(fast.at(i, j)));
    let errors = Errors::of(values, exact, fast.mean());
    let scale = raster.len() as f64 / pixels.len() as f64;
    let oracle = (seconds * scale, pixels.len());
    row(stage, raster, tolerance, fast_seconds, oracle, errors)
}
