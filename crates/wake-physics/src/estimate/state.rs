//! A point of the likelihood: a scene and the nuisance values.

use super::parameter::{Factors, Parameter};
use super::value::Value;
use crate::scene::Scene;

/// A scene with its factors.
#[derive(Debug, Clone)]
pub(super) struct State {
    pub(super) scene: Scene,
    pub(super) factors: Factors,
}

impl State {
    pub(super) fn of(scene: Scene) -> Self {
        Self {
            scene,
            factors: Factors::default(),
        }
    }

    /// A parameter's value; of factors the logarithm.
    pub(super) fn get(&self, parameter: Parameter) -> f64 {
        match parameter {
            Parameter::Gain => self.factors.gain.ln(),
            Parameter::Texture => self.factors.texture.ln(),
            Parameter::Size => Value::Size.of(&self.scene),
            Parameter::Value(value) => value.of(&self.scene),
        }
    }

    /// The state with one parameter moved, kept within what scenes may have.
    pub(super) fn moved(&self, parameter: Parameter, by: f64) -> Self {
        let mut state = self.clone();
        let at = self.get(parameter) + by;
        let scene = &mut state.scene;
        match parameter {
            Parameter::Gain => state.factors.gain = at.clamp(-20.0, 20.0).exp(),
            Parameter::Texture => state.factors.texture = at.clamp(-3.0, 3.0).exp(),
            Parameter::Size => Value::Size.set(scene, at.clamp(15.0, 450.0)),
            Parameter::Value(value) => {
                let at = match value {
                    Value::Speed => at.clamp(1.0, 25.0),
                    Value::WindSpeed => at.clamp(1.0, 25.0),
                    Value::Heading | Value::WindToward => at.rem_euclid(360.0),
                    _ => at,
                };
                value.set(scene, at);
            }
        }
        state
    }

    /// Step of the differences that derivatives of the mean are taken by: some tenths of what one image tells.
    pub(super) fn step(&self, parameter: Parameter) -> f64 {
        match parameter {
            Parameter::Value(Value::Speed) => 5e-4 * self.get(parameter),
            Parameter::Value(Value::Heading) => 0.05,
            Parameter::Size | Parameter::Value(Value::WindSpeed) => 0.01 * self.get(parameter),
            Parameter::Value(Value::WindToward) => 1.0,
            _ => 1e-2,
        }
    }

    /// Farthest that one step of a fit may go.
    pub(super) fn longest(&self, parameter: Parameter) -> f64 {
        match parameter {
            Parameter::Value(Value::Speed) => 0.03 * self.get(parameter),
            Parameter::Value(Value::Heading) => 2.0,
            Parameter::Value(Value::X | Value::Y) => 15.0,
            Parameter::Value(Value::WindToward) => 15.0,
            Parameter::Gain => 0.3,
            Parameter::Texture => 0.5,
            _ => 0.25 * self.get(parameter).abs(),
        }
    }
}
