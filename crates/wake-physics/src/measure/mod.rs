//! Heading and speed of the ship, wind, fetch and incidence, measured in one image.
//!
//! The measurements evaluate simulated and generated images by physics instead of by pixels. Each takes an image of intensity
//! before speckle and returns a value with a confidence; a quantity that the image does not show is not measurable.
//!
//! ```text
//! image ─► wake arms ─► heading ─► stationary waves ─► heading, speed
//!    └──► open sea ─► brightness, skew of the spectrum ─► wind speed, wind direction, incidence
//!                └──► contrast ─► fetch
//! ```
//!
//! Curves and brightness follow from physics. Windows, bands and confidence thresholds have no closed form: they were chosen on
//! 300 simulated scenes of the paper's ranges (ship 195 m, 256 × 256 pixels of 4 m, X band, R/V 78 s) that are not among the
//! scenes of the `evaluate` example, which reports the accuracy.

mod arms;
mod inversion;
mod median;
mod open_sea;
mod radial;
pub(crate) mod seams;
mod smooth;
mod spectrum;
mod stationary;
mod texture;
mod wake;

#[cfg(test)]
mod tests;

pub(crate) use inversion::mean_intensity;
pub use inversion::{fetch, incidence, mean_sigma0, wind_axis, wind_speed};
pub use median::median;
pub use open_sea::{OpenSea, open_sea};
pub use radial::{Binning, RadialSpectrum, radial_spectrum};
pub use smooth::smooth;
pub use texture::{Texture, amplitude_correlation, texture};
pub use wake::{WakeMeasurement, kelvin_wedge, measure_wake};

use serde::Serialize;

/// Data on the ship from another source (its echo, a chart, or the labels of the scene).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShipPlace {
    /// Midship (x, y) \[m\].
    pub position: [f64; 2],
    /// Length \[m\]: the arms start at the bow.
    pub length: f64,
    /// Depth of the water \[m\], may be infinite: with the speed it sets the opening of the arms.
    pub depth: f64,
}

/// A measured value and its confidence.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Measured {
    /// The value, in the unit of its measurement; NaN where there is none.
    pub value: f64,
    /// Confidence, at least 0; each measurement has its own unit.
    pub confidence: f64,
    /// Whether the confidence reaches the measurement's threshold.
    pub measurable: bool,
}

impl Measured {
    /// Result where nothing is measurable.
    pub(crate) const NOTHING: Self = Self {
        value: f64::NAN,
        confidence: 0.0,
        measurable: false,
    };

    /// A value that is measurable if its confidence is at least `threshold`.
    pub(crate) fn with_threshold(value: f64, confidence: f64, threshold: f64) -> Self {
        if !(value.is_finite() && confidence.is_finite()) {
            return Self::NOTHING;
        }
        Self {
            value,
            confidence,
            measurable: confidence >= threshold,
        }
    }

    /// The value, if it is measurable.
    #[must_use]
    pub fn measurable_value(&self) -> Option<f64> {
        self.measurable.then_some(self.value)
    }
}

/// Difference of two directions, −180 up to 180 \[deg\].
#[must_use]
pub fn angle_between(one: f64, other: f64) -> f64 {
    (one - other + 180.0).rem_euclid(360.0) - 180.0
}

/// Difference of two axes, directions that are the same when turned by 180°: −90 up to 90 \[deg\].
#[must_use]
pub fn axis_between(one: f64, other: f64) -> f64 {
    (one - other + 90.0).rem_euclid(180.0) - 90.0
}
