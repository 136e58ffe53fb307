//! What is estimated: scene values, the size of the ship, and nuisance values of the image.

use super::value::Value;
use crate::scene::Scene;
use serde::Serialize;

/// An unknown of the likelihood.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Parameter {
    /// Length of the ship \[m\], its beam and draft in proportion.
    Size,
    /// Logarithm of a factor on the image: calibration, and what the mean image is wrong by.
    Gain,
    /// Logarithm of a factor on the variance of the sea's texture.
    Texture,
    /// A value of the scene.
    #[serde(untagged)]
    Value(Value),
}

impl Parameter {
    /// What a wake in an image is asked for.
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

    /// Its name in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Value(Value::Speed) => "speed",
            Self::Value(Value::Heading) => "heading",
            Self::Value(Value::X) => "x",
            Self::Value(Value::Y) => "y",
            Self::Value(Value::Length) | Self::Size => "length",
            Self::Value(Value::Beam) => "beam",
            Self::Value(Value::Draft) => "draft",
            Self::Value(Value::WindSpeed) => "wind_speed",
            Self::Value(Value::WindToward) => "wind_toward",
            Self::Value(Value::Incidence) => "incidence",
            Self::Gain => "gain",
            Self::Texture => "texture",
        }
    }

    /// Scene values that it changes.
    pub(super) fn values(self) -> &'static [Value] {
        match self {
            Self::Value(value) => match Value::ALL.iter().position(|v| *v == value) {
                Some(n) => &Value::ALL[n..=n],
                None => &[],
            },
            Self::Size => &[Value::Length, Value::Beam, Value::Draft],
            Self::Gain | Self::Texture => &[],
        }
    }
}

/// A point in the space of the unknowns.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct State {
    pub(super) scene: Scene,
    /// Logarithm of the factor on the image.
    pub(super) gain: f64,
    /// Logarithm of the factor on the variance of the texture.
    pub(super) texture: f64,
}

impl State {
    pub(super) fn of(scene: &Scene) -> Self {
        Self {
            scene: scene.clone(),
            gain: 0.0,
            texture: 0.0,
        }
    }

    pub(super) fn get(&self, parameter: Parameter) -> f64 {
        match parameter {
            Parameter::Value(value) => value.of(&self.scene),
            Parameter::Size => Value::Length.of(&self.scene),
            Parameter::Gain => self.gain,
            Parameter::Texture => self.texture,
        }
    }

    /// Moves a parameter as far as ranges of scenes and reason allow.
    pub(super) fn advance(&mut self, parameter: Parameter, by: f64) {
        let at = self.get(parameter) + by;
        match parameter {
            Parameter::Gain => self.gain = at,
            Parameter::Texture => self.texture = at.clamp(-3.0, 3.0),
            Parameter::Size => {
                let factor = at.clamp(8.0, 480.0) / self.get(parameter);
                for value in parameter.values() {
                    let scaled = factor * value.of(&self.scene);
                    value.set(&mut self.scene, scaled);
                }
            }
            Parameter::Value(value) => {
                let at = match value {
                    Value::Speed => at.clamp(1.0, 25.0),
                    Value::Heading | Value::WindToward => at.rem_euclid(360.0),
                    Value::WindSpeed => at.clamp(0.5, 25.0),
                    Value::Incidence => at.clamp(6.0, 74.0),
                    _ => at,
                };
                value.set(&mut self.scene, at);
            }
        }
    }
}
