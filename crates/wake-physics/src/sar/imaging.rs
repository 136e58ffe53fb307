//! Response of the radar to a source pixel: displacement and width of its power.

use crate::raster::{Field, Raster};
use crate::sar::AzimuthResolution;
use crate::sar::taps::Steps;
use std::f64::consts::PI;

/// Parameters of the radar for velocity bunching.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Imaging {
    /// Range over platform speed R/V \[s\], at least 0.
    pub range_to_velocity: f64,
    /// Incidence angle θ \[rad\], between 0 and π/2.
    pub incidence: f64,
    /// Azimuth resolution ρ' and its dependence on acceleration.
    pub resolution: AzimuthResolution,
}

/// Fields to be imaged, on a raster with a margin around the image, all finite.
///
/// An absent field means an absent effect, at no cost.
#[derive(Debug, Clone, Copy)]
pub struct Sources<'a> {
    /// The pixels of the fields.
    pub raster: Raster,
    /// Backscatter σ⁰ \[1\].
    pub sigma0: &'a Field,
    /// Velocity toward the radar `u_r` [m/s]: displaces in azimuth.
    pub radial_velocity: Option<&'a Field>,
    /// Acceleration toward the radar `a_r` [m/s²]: defocuses.
    pub radial_acceleration: Option<&'a Field>,
    /// Elevation ζ \[m\]: displaces in range.
    pub elevation: Option<&'a Field>,
}

/// Smallest variance of the azimuth response [pixel²]: a standard deviation of half a pixel, or a width at half power of
/// 1.2 pixels. A narrower response would fall between the pixels.
pub(crate) const SMALLEST_VARIANCE: f64 = 0.25;

/// Factors from velocity, acceleration and elevation to rows, widths and columns.
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
    /// Row and column in the image minus those in the sources.
    pub(super) offset: [i64; 2],
}

impl Imaging {
    /// Approximate number of pixels of a column over which the power of a source is spread in azimuth.
    ///
    /// - `acceleration` toward the radar [m/s²]; `spacing` of the pixels \[m\]; `tolerance` of the image
    pub(crate) fn taps(&self, acceleration: f64, spacing: f64, tolerance: f64) -> f64 {
        let pixel = Raster::image(1, 1, spacing);
        let response = Response::new(self, &pixel, &pixel);
        let steps = Steps::new(response.variance_at(0.0), tolerance);
        steps.taps(response.variance_at(acceleration) as f32) as f64
    }
}

impl Response {
    /// Response of sources on the pixels of an image.
    ///
    /// # Panics
    ///
    /// If the rasters have different spacings.
    pub(super) fn new(imaging: &Imaging, sources: &Raster, image: &Raster) -> Self {
        assert!(
            (sources.spacing - image.spacing).abs() <= 1e-9 * image.spacing,
            "sources and image differ in spacing"
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

    /// Variance of the azimuth response [pixel²] at an acceleration [m/s²].
    pub(super) fn variance_at(&self, acceleration: f64) -> f64 {
        (self.variance + self.variance_per_square * acceleration * acceleration)
            .max(SMALLEST_VARIANCE)
    }
}

impl Sources<'_> {
    /// Checks the sizes of the fields.
    ///
    /// # Panics
    ///
    /// If a field does not match the raster in size.
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
                "a field and its raster differ in size"
            );
        }
    }
}

/// Largest absolute value; 0 without a field.
pub(super) fn largest(field: Option<&Field>) -> f64 {
    let of = |f: &Field| f.values.iter().fold(0f32, |m, v| m.max(v.abs()));
    f64::from(field.map_or(0.0, of))
}
