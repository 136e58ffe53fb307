//! Parameters estimated from an image: scene values, the size of the ship, and nuisance values of the image.

use super::value::Value;
use serde::Serialize;

/// An unknown of the likelihood.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Parameter {
    /// Length of the ship \[m\], its beam and draft in proportion.
    Size,
    /// Logarithm of a factor on the image, for calibration and for errors of the mean image.
    Gain,
    /// Logarithm of a factor on the variance of the sea's texture.
    Texture,
    /// A value of the scene.
    #[serde(untagged)]
    Value(Value),
}

impl Parameter {
    /// Parameters that are estimated from a wake in an image.
    pub const OF_WAKE: [Self; 9] = [
        Self::Value(Value::Speed),
        Self::Value(Value::Heading),
        Self::Value(Value::X),
        Self::Value(Value::Y),
        Self::Size,
        Self::Value(Value::WindSpeed),
        Self::Value(Value::WindToward),
        Self::Gain,
        Self::Texture,
    ];

    /// Name in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Value(Value::Speed) => "speed",
            Self::Value(Value::Heading) => "heading",
            Self::Value(Value::X) => "x",
            Self::Value(Value::Y) => "y",
            Self::Value(Value::Length | Value::Size) | Self::Size => "length",
            Self::Value(Value::Beam) => "beam",
            Self::Value(Value::Draft) => "draft",
            Self::Value(Value::WindSpeed) => "wind_speed",
            Self::Value(Value::WindToward) => "wind_toward",
            Self::Value(Value::Incidence) => "incidence",
            Self::Gain => "gain",
            Self::Texture => "texture",
        }
    }

    /// Unit; empty for the logarithms of factors.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::Value(Value::Speed | Value::WindSpeed) => "m/s",
            Self::Value(Value::Heading | Value::WindToward | Value::Incidence) => "deg",
            Self::Value(_) | Self::Size => "m",
            Self::Gain | Self::Texture => "",
        }
    }

    /// Whether the parameter belongs to the ship.
    #[must_use]
    pub fn is_of_ship(self) -> bool {
        match self {
            Self::Value(value) => value.is_of_ship(),
            Self::Size => true,
            Self::Gain | Self::Texture => false,
        }
    }

    /// Whether the parameter is a factor on the image, not a value of the scene.
    #[must_use]
    pub fn is_nuisance(self) -> bool {
        matches!(self, Self::Gain | Self::Texture)
    }

    /// Scene values that the parameter changes.
    pub(super) fn values(self) -> &'static [Value] {
        match self {
            Self::Value(value) => match Value::ALL.iter().position(|v| *v == value) {
                Some(n) => &Value::ALL[n..=n],
                None => &[],
            },
            Self::Size => &[Value::Size],
            Self::Gain | Self::Texture => &[],
        }
    }
}

/// Factors on the image of a scene: nuisance values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Factors {
    /// Factor on the mean image \[1\], above 0: its logarithm is [`Parameter::Gain`].
    pub gain: f64,
    /// Factor on the variance of the sea's texture \[1\], at least 0: its logarithm is [`Parameter::Texture`].
    pub texture: f64,
}

impl Default for Factors {
    /// Factors of 1.
    fn default() -> Self {
        Self {
            gain: 1.0,
            texture: 1.0,
        }
    }
}
