//! Where the power of one source pixel goes, in pixels of the image: shared by the fast sum and its oracle.

use crate::raster::{Field, Raster};
use crate::sar::bunching::{Imaging, Sources};
use std::f64::consts::PI;

/// Smallest variance of the azimuth response [pixel²]: half a pixel of standard deviation, a width at half
/// power of 1.2 pixels. A narrower response would fall between the pixels.
pub(super) const SMALLEST_VARIANCE: f64 = 0.25;

/// Velocity, acceleration and elevation to rows, columns and widths.
#[derive(Debug, Clone, Copy)]
pub(super) struct Response {
    /// Rows towards row 0 per velocity toward the radar [s/m].
    pub(super) rows_per_velocity: f64,
    /// Columns towards column 0 per elevation [1/m].
    pub(super) columns_per_elevation: f64,
    /// Variance in azimuth without acceleration [pixel²].
    pub(super) variance: f64,
    /// Variance per squared acceleration [pixel² s⁴/m²].
    pub(super) variance_per_square: f64,
    /// Row and column of the image less those of the sources.
    pub(super) offset: [i64; 2],
}

impl Response {
    /// # Panics
    ///
    /// If the rasters have different spacings.
    pub(super) fn new(imaging: &Imaging, sources: &Raster, image: &Raster) -> Self {
        assert!(
            (sources.spacing - image.spacing).abs() <= 1e-9 * image.spacing,
            "sources and image of different spacing"
        );
        let h = image.spacing;
        let resolution = &imaging.resolution;
        // ρ is √2π standard deviations.
        let variance = |rho: f64| rho * rho / (2.0 * PI * PI * h * h);
        Self {
            rows_per_velocity: imaging.range_to_velocity / h,
            columns_per_elevation: 1.0 / (imaging.incidence.tan() * h),
            variance: variance(resolution.at(0.0)),
            variance_per_square: variance(resolution.defocus),
            offset: [
                image.origin_row - sources.origin_row,
                image.origin_column - sources.origin_column,
            ],
        }
    }

    /// Variance of the response in azimuth [pixel²] at an acceleration [m/s²].
    pub(super) fn variance_at(&self, acceleration: f64) -> f64 {
        (self.variance + self.variance_per_square * acceleration * acceleration)
            .max(SMALLEST_VARIANCE)
    }
}

impl Sources<'_> {
    /// # Panics
    ///
    /// If a field is not of the raster's size.
    pub(super) fn check(&self) {
        let fields = [
            Some(self.sigma0),
            self.radial_velocity,
            self.radial_acceleration,
            self.elevation,
        ];
        for field in fields.into_iter().flatten() {
            assert_eq!(
                (field.rows, field.columns, field.values.len()),
                (self.raster.rows, self.raster.columns, self.raster.len()),
                "a field of another size than its raster"
            );
        }
    }
}

/// Largest absolute value; 0 without a field.
pub(super) fn largest(field: Option<&Field>) -> f64 {
    let of = |f: &Field| f.values.iter().fold(0f32, |m, v| m.max(v.abs()));
    f64::from(field.map_or(0.0, of))
}

/// Standard deviations z beyond which a Gaussian's two tails, cut off and given back to the rest, change it by
/// at most `error`: 2·2Q(z) ≤ error, with the bound Q(z) ≤ exp(−z²/2)/(z√(2π)).
pub(super) fn reach(error: f64) -> f64 {
    (0..8).fold(3.0, |z: f64, _| {
        let ratio = 4.0 / (error * z * (2.0 * PI).sqrt());
        (2.0 * ratio.ln()).max(1.0).sqrt()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reach_is_that_of_the_normal_tail() {
        // Two-sided tails 2Q(z) of the normal distribution: 0.0027 at 3, 5.733e-7 at 5 (tables). The bound used
        // is larger than Q by at most 1/z² of it.
        for (z, tails) in [(3.0, 2.6998e-3), (5.0, 5.733e-7)] {
            let found = reach(2.0 * tails);
            assert!(found >= z && found < z + 0.04, "{found}");
        }
    }
}
