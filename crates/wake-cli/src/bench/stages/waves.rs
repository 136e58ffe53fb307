//! Stages that sum plane waves: sea, swell and wake.

use super::oracle::{RUNS, WHOLE, pixels, row};
use super::surface::{TRANSFER, spectrum, wake};
use crate::bench::row::{Errors, Row, median_seconds, seconds};
use wake_physics::surface::Surface;
use wake_physics::swell::Swell;
use wake_physics::waves::{PlaneWaves, Quantity, harmonic_sum};
use wake_physics::{Field, Raster, reference};

/// Number of waves of sea and of wake in the harmonic sum: chosen.
const WAVES: usize = 10_000;
/// Rows of the matrix product on a large raster, whose time is scaled up.
const PRODUCT_ROWS: usize = 48;

/// The six fields of elevation, slope and velocity.
const QUANTITIES: [Quantity; 6] = [
    Quantity::Elevation,
    Quantity::SlopeX,
    Quantity::SlopeY,
    Quantity::VelocityX,
    Quantity::VelocityY,
    Quantity::VelocityZ,
];

/// Sea by FFT with its strongest waves, against the harmonic sum.
pub(crate) fn sea(raster: &Raster, tolerance: f64) -> Row {
    let surface = Surface::new(&spectrum(), 7, 0.0, raster).strongest(WAVES);
    let fast = || surface.fields(&TRANSFER, &QUANTITIES, tolerance);
    sum("sea", raster, tolerance, &surface.modes(), fast)
}

/// Swell by the non-uniform FFT, including its random draw, against the harmonic sum.
pub(crate) fn swell(raster: &Raster, tolerance: f64) -> Row {
    let swell = Swell {
        height: 2.0,
        wavelength: 200.0,
        toward: 1.0,
    };
    let draw = || swell.waves(7, 0.0, f64::INFINITY, std::f64::consts::PI / raster.spacing);
    let fast = || reference::synthesize(&draw(), &TRANSFER, &QUANTITIES, raster, tolerance);
    sum("swell", raster, tolerance, &draw(), fast)
}

/// Wake by the non-uniform FFT, including its nodes and amplitudes, against the harmonic sum.
pub(crate) fn kelvin(raster: &Raster, tolerance: f64) -> Row {
    let wake = wake();
    let waves = wake.waves(&wake.plan(raster, tolerance)).strongest(WAVES);
    let fast = || {
        let waves = wake.waves(&wake.plan(raster, tolerance)).strongest(WAVES);
        reference::synthesize(&waves, &TRANSFER, &QUANTITIES, raster, tolerance)
    };
    sum("kelvin", raster, tolerance, &waves, fast)
}

/// A sum of plane waves against the harmonic sum and the matrix product.
fn sum(
    stage: &'static str,
    raster: &Raster,
    tolerance: f64,
    waves: &PlaneWaves,
    fast: impl Fn() -> Vec<Field>,
) -> Row {
    let (fast_seconds, fields) = median_seconds(RUNS, fast);
    let (pixels, scale) = pixels(raster);
    let (oracle, exact) = seconds(|| harmonic_sum(waves, &TRANSFER, &QUANTITIES, raster, &pixels));
    let errors = fields
        .iter()
        .zip(&exact)
        .fold(Errors::default(), |worst, (field, exact)| {
            let values = pixels.iter().map(|&[i, j]| f64::from(field.at(i, j)));
            worst.worst(Errors::of(values, exact, field.rms()))
        });
    let (matrix_product_seconds, _) = product(raster, waves);
    Row {
        matrix_product_seconds: Some(matrix_product_seconds),
        ..row(
            stage,
            raster,
            Some(tolerance),
            fast_seconds,
            (oracle * scale, pixels.len()),
            errors,
        )
    }
}

/// Seconds of the matrix product, scaled up from some rows of a large raster, and its fields.
fn product(raster: &Raster, waves: &PlaneWaves) -> (f64, Vec<Field>) {
    let whole = raster.rows <= WHOLE;
    let rows = if whole { raster.rows } else { PRODUCT_ROWS };
    let part = Raster { rows, ..*raster };
    let (seconds, fields) = median_seconds(1, || {
        reference::matrix_product(waves, &TRANSFER, &QUANTITIES, &part)
    });
    (seconds * raster.rows as f64 / rows as f64, fields)
}
