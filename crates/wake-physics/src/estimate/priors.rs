//! Prior knowledge of the nuisance values.

use super::matrix::Matrix;
use super::parameter::Parameter;
use super::value::Value;

/// Prior standard deviations of the nuisance values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Priors {
    /// Standard deviation of the logarithm of the factor on the image: calibration of the radar and error of the mean image.
    /// Infinite for an image that is not calibrated.
    pub gain: f64,
    /// Standard deviation of the logarithm of the factor on the texture's variance: uncertainty of the theory of the sea.
    pub texture: f64,
}

impl Default for Priors {
    /// 3 % of the brightness and 20 % of the variance (chosen).
    fn default() -> Self {
        Self {
            gain: 0.03,
            texture: 0.2,
        }
    }
}

impl Priors {
    pub(super) fn precision(&self, parameter: Parameter) -> f64 {
        match parameter {
            Parameter::Gain => self.gain.powi(-2),
            Parameter::Texture => self.texture.powi(-2),
            _ => 0.0,
        }
    }

    pub(super) fn matrix(&self, parameters: &[Parameter]) -> Matrix {
        let mut matrix = Matrix::zero(parameters.len());
        for (n, &parameter) in parameters.iter().enumerate() {
            matrix.add(n, n, self.precision(parameter));
        }
        matrix
    }
}

/// Values by which derivatives are needed.
pub(super) fn values_of(parameters: &[Parameter]) -> Vec<Value> {
    let mut values: Vec<Value> = parameters
        .iter()
        .flat_map(|p| p.values())
        .copied()
        .collect();
    values.sort_unstable();
    values.dedup();
    values
}
