//! How the waves of one length spread.

use std::f64::consts::PI;

/// The spreading of the waves of one length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Spread {
    /// D(δ) = level · cos^{2s}(δ/2).
    Cos2s { level: f64, exponent: f64 },
    /// D(δ) = (1 + Δ cos 2δ)/(2π).
    Even { anisotropy: f64 },
}

impl Spread {
    /// D(δ) [1/rad] from cos δ, δ the angle to the wind.
    pub(crate) fn density(self, cos_angle: f64) -> f64 {
        match self {
            Self::Cos2s { level, exponent } => {
                level * (0.5 * (1.0 + cos_angle)).max(0.0).powf(exponent)
            }
            Self::Even { anisotropy } => {
                (1.0 + anisotropy * (2.0 * cos_angle * cos_angle - 1.0)) / (2.0 * PI)
            }
        }
    }
}
