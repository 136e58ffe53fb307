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
    /// The wake; `None` where none stands out of sea and speckle.
    pub wake: Option<Wake>,
    /// ln likelihood of the best ship less that of the sea alone.
    pub above_sea: f64,
    /// The expected image of the estimate, in the unit of the image.
    pub expected: Field,
    /// The scene of the estimate; without a ship where no wake stands out.
    pub scene: Scene,
}

/// A wake with the ship and the sea that made it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Wake {
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
    /// Logarithm of the factor on the image, and of that on the variance of its texture.
    pub nuisance: [Fitted; 2],
    /// Names of the values in the covariance.
    pub names: Vec<&'static str>,
    /// Covariance of all values, row after row.
    pub covariance: Vec<f64>,
    /// ln likelihood, priors included, but for a constant.
    pub log_likelihood: f64,
    /// Whether the image tells speed and heading: deviations are small, no other mode is as likely, and the fit converged.
    pub identifiable: bool,
    /// Other modes.
    pub alternatives: Vec<Alternative>,
    /// How well the scene explains the image.
    pub goodness_of_fit: GoodnessOfFit,
}

/// Another ship or wind that may have made the image.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Alternative {
    /// Probability beside the estimate and the other modes, 0 to 1.
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

/// How far the residual is from that of simulated images of the scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GoodnessOfFit {
    /// Power of the residual by ring of wavenumbers, the longest waves first, less that of simulated images, in their standard
    /// deviations.
    pub rings: Vec<f64>,
    /// The largest of them, with its sign.
    pub largest: f64,
    /// Gain and texture over their prior deviations.
    pub priors: [f64; 2],
    /// Whether nothing stands out.
    pub consistent: bool,
}
