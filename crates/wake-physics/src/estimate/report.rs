//! What is told of an image.

use crate::raster::Field;
use crate::scene::Scene;
use serde::Serialize;

/// A value with its standard deviation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Fitted {
    /// The value.
    pub value: f64,
    /// Its standard deviation; infinite where the image does not tell.
    pub deviation: f64,
}

/// Everything read from one image.
#[derive(Debug, Clone)]
pub struct Estimate {
    /// Wakes: one, or none where the image shows none.
    pub wakes: Vec<Estimated>,
    /// The expected image of the estimate, in the unit of the image, and what it leaves of the image, relative.
    pub fit: Field,
    /// Relative residual I/μ − 1.
    pub residual: Field,
    /// The scene of the estimate.
    pub scene: Scene,
}

/// A wake with the ship and the sea that made it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Estimated {
    /// Bow (column, row) in the image, where the ship is and not where its echo appears.
    pub tip: [f64; 2],
    /// Midship (x, y) \[m\].
    pub position: [Fitted; 2],
    /// Where the ship moves to \[deg\].
    pub heading: Fitted,
    /// Speed through the water [m/s]: a current is not seen.
    pub speed: Fitted,
    /// Length \[m\], beam and draft in proportion to those of the scene that was given.
    pub length: Fitted,
    /// Wind speed [m/s].
    pub wind_speed: Fitted,
    /// Where the wind blows to \[deg\].
    pub wind_toward: Fitted,
    /// Factor on the image, and on the variance of its texture.
    pub nuisance: [Fitted; 2],
    /// Names of the values in the covariance.
    pub names: Vec<&'static str>,
    /// Covariance of all values, row after row.
    pub covariance: Vec<f64>,
    /// Velocity toward the radar by the displacement of the ship's echo [m/s], where there is an echo.
    pub radial_velocity: Option<Fitted>,
    /// ln likelihood, priors included.
    pub log_likelihood: f64,
    /// The same less that of the sea without a wake.
    pub above_sea: f64,
    /// Whether the image tells speed and heading: the wake stands out, no other mode is as likely, and the deviations are
    /// small.
    pub identifiable: bool,
    /// Other modes.
    pub alternatives: Vec<Alternative>,
    /// How well the model fits.
    pub goodness_of_fit: GoodnessOfFit,
}

/// Another ship or wind that may have made the image.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Alternative {
    /// Probability against the estimate and the other modes, 0 to 1.
    pub weight: f64,
    /// Speed [m/s].
    pub speed: f64,
    /// Heading \[deg\].
    pub heading: f64,
    /// Wind speed [m/s].
    pub wind_speed: f64,
    /// Where the wind blows to \[deg\].
    pub wind_toward: f64,
}

/// How far what is left differs from sea and speckle, in standard deviations.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GoodnessOfFit {
    /// Power that is left over its expectation, by ring of wavenumbers, the longest waves first.
    pub power: Vec<f64>,
    /// The largest difference of the power from 1.
    pub largest: f64,
    /// Gain and texture over their prior deviations.
    pub priors: [f64; 2],
    /// Whether nothing stands out.
    pub consistent: bool,
}
