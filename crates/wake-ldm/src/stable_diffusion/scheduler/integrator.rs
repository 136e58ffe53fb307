//! Options and history shared by the exponential integrators.

use burn::tensor::Tensor;

use super::prediction::{Clipping, Prediction};
use super::sigmas::Spread;
use super::{NoiseLevel, StepInput};
use crate::options::Options;
use wake_nn::Result;

/// Options of every exponential integrator.
#[derive(Debug, Clone)]
pub(super) struct IntegratorOptions {
    pub(super) prediction: Prediction,
    pub(super) clipping: Clipping,
    /// Whether the equation is solved in terms of the clean image; otherwise in terms of the noise.
    pub(super) data: bool,
    pub(super) order: usize,
    pub(super) lower_order_final: bool,
}

impl IntegratorOptions {
    /// Reads the options of a method of orders 1 to `most`.
    pub(super) fn take(
        options: &mut Options,
        spread: Spread,
        data: bool,
        most: usize,
    ) -> Result<Self> {
        options.only("use_dynamic_shifting", &[false])?;
        Ok(Self {
            prediction: take_prediction(options, spread, data)?,
            clipping: Clipping::take_dynamic(options)?,
            data,
            order: take_order(options, most)?,
            lower_order_final: options.bool("lower_order_final", true)?,
        })
    }

    /// Clipped clean image of a prediction, and the quantity that the history keeps.
    pub(super) fn convert(&self, level: NoiseLevel, input: &StepInput) -> [Tensor<4>; 2] {
        let denoised = input.denoised(level, self.prediction, self.clipping);
        let kept = if self.data {
            denoised.clone()
        } else if self.clipping == Clipping::Off {
            input.direction(level, self.prediction)
        } else {
            Prediction::Sample.noise(level, input.sample.clone(), denoised.clone())
        };
        [denoised, kept]
    }
}

fn take_prediction(options: &mut Options, spread: Spread, data: bool) -> Result<Prediction> {
    match (spread, data) {
        (Spread::Flow, true) => Prediction::take(options, &[Prediction::Flow]),
        (Spread::Flow, false) => {
            let supported = "false if the noise is integrated (dpmsolver, or predict_x0 false)";
            Err(options.unsupported("use_flow_sigmas", &true.into(), supported))
        }
        _ => Prediction::take(options, &Prediction::CURVED),
    }
}

fn take_order(options: &mut Options, most: usize) -> Result<usize> {
    let order = options.usize("solver_order", 2)?;
    if (1..=most).contains(&order) {
        return Ok(order);
    }
    Err(options.unsupported("solver_order", &order.into(), &format!("1 to {most}")))
}
