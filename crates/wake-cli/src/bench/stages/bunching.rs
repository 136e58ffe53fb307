//! Stage of imaging a moving sea: scattered kernels against the dense integral.

use super::oracle::{RUNS, at_pixels, pixels};
use super::surface::{INCIDENCE, fields};
use crate::bench::row::{Row, median_seconds, seconds};
use rayon::prelude::*;
use wake_physics::Raster;
use wake_physics::reference::DirectImage;
use wake_physics::sar::{AzimuthResolution, Imaging, Sources};
use wake_physics::waves::Quantity;

/// Scattered kernels against the dense bunching integral.
pub(crate) fn bunching(raster: &Raster, tolerance: f64) -> Row {
    let source_raster = raster.with_margin(64, 4);
    let quantities = [
        Quantity::VelocityX,
        Quantity::VelocityZ,
        Quantity::RadialAcceleration,
        Quantity::Elevation,
        Quantity::SlopeX,
    ];
    let f = fields(&source_raster, &quantities);
    let (sin, cos) = (INCIDENCE.sin() as f32, INCIDENCE.cos() as f32);
    let mut velocity = f[1].clone();
    for (v, x) in velocity.values.iter_mut().zip(&f[0].values) {
        *v = *v * cos - x * sin;
    }
    let mut sigma0 = f[4].clone();
    for s in &mut sigma0.values {
        *s = 0.03 * (5.0 * *s).exp();
    }
    let sources = Sources {
        raster: source_raster,
        sigma0: &sigma0,
        radial_velocity: Some(&velocity),
        radial_acceleration: Some(&f[2]),
        elevation: Some(&f[3]),
    };
    let imaging = Imaging {
        range_to_velocity: 78.0,
        incidence: INCIDENCE,
        resolution: AzimuthResolution::of_moving_sea(0.0312, 78.0, 3.0, 1, 0.2),
    };
    let (fast_seconds, image) = median_seconds(RUNS, || imaging.image(&sources, raster, tolerance));
    let (pixels, _) = pixels(raster);
    let direct = DirectImage::new(&imaging, &sources, raster);
    let (oracle, exact) = seconds(|| {
        pixels
            .par_iter()
            .map(|&[i, j]| direct.at(i, j))
            .collect::<Vec<f64>>()
    });
    let (fast, place) = ((fast_seconds, &image), (raster, Some(tolerance)));
    at_pixels("bunching", place, fast, (oracle, &exact), &pixels)
}
