//! What is known of an image besides its radar.

use super::priors::Priors;

/// What is known of an image besides its radar.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Where the wake is, if a detector found it.
    pub detection: Option<Detection>,
    /// What is known of the nuisance values; a gain of infinite deviation stands for an image that is not calibrated.
    pub priors: Priors,
    /// Simulated images of the calibration, at least 4.
    pub simulations: usize,
}

impl Default for Options {
    /// A calibrated image, nothing known of the wake, 16 simulations.
    fn default() -> Self {
        Self {
            detection: None,
            priors: Priors::default(),
            simulations: 16,
        }
    }
}

/// A wake that was found before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detection {
    /// Midship (x, y) \[m\].
    pub position: [f64; 2],
    /// Distance from it within which the ship is looked for \[m\].
    pub within: f64,
    /// Heading \[deg\] to within 15°, if known.
    pub heading: Option<f64>,
}
