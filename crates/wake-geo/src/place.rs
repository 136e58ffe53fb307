//! Places of pixels on Earth.

/// Place of a pixel; values that the product lacks are `None`.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Place {
    /// Geodetic latitude on WGS84, north positive \[degrees\].
    pub latitude: f64,
    /// Longitude on WGS84, east positive, in [−180, 180) \[degrees\].
    pub longitude: f64,
    /// Height above the ellipsoid \[m\].
    pub height: Option<f64>,
    /// Incidence angle at the ground, from the vertical \[degrees\].
    pub incidence: Option<f64>,
    /// Two-way slant range time \[s\].
    pub slant_range_time: Option<f64>,
}

/// Directions and spacings of the pixels around a place, on the WGS84 ellipsoid.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct PixelAxes {
    /// Direction of increasing line, clockwise from true north, in [0, 360) \[degrees\].
    pub line_azimuth: f64,
    /// Direction of increasing pixel, clockwise from true north, in [0, 360) \[degrees\].
    pub pixel_azimuth: f64,
    /// Distance between neighbouring lines \[m\].
    pub line_spacing: f64,
    /// Distance between neighbouring pixels of a line \[m\].
    pub pixel_spacing: f64,
}

/// Wraps a longitude to [−180, 180) \[degrees\].
pub(crate) fn wrapped(longitude: f64) -> f64 {
    match (-180.0..180.0).contains(&longitude) {
        true => longitude,
        false => (longitude + 180.0).rem_euclid(360.0) - 180.0,
    }
}
