//! What is known of an image besides its radar.

use super::fit::Priors;

/// What is known of an image besides its radar.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Where the wake is, if a detector found it.
    pub detection: Option<Detection>,
    /// What is known of the nuisance values; a gain of infinite deviation stands for an image that is not calibrated.
    pub priors: Priors,
    /// Starts that are followed.
    pub starts: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            detection: None,
            priors: Priors::default(),
            starts: 3,
        }
    }
}

/// A wake that was found before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detection {
    /// Midship (x, y) \[m\], to within `within`.
    pub position: [f64; 2],
    /// Distance within which the ship is looked for \[m\].
    pub within: f64,
    /// Heading \[deg\] to within 5°, if known.
    pub heading: Option<f64>,
}
