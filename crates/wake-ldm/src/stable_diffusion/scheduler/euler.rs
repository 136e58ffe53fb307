//! Euler's method in the noise level σ.

use burn::tensor::Tensor;

use super::betas::DEFAULTS;
use super::prediction::Prediction;
use super::sigma_sampler::{Call, SigmaConfig, SigmaMethod};
use super::sigmas::{SigmaOptions, SigmaPath, Spread, round, take_final_zero};
use crate::options::Options;
use wake_nn::Result;

/// Follows dx/dσ = (x − x₀)/σ in straight lines.
///
/// # References
///
/// Karras et al. (2022), "Elucidating the Design Space of Diffusion-Based Generative Models",
/// algorithm 2 without churn.
#[derive(Debug, Clone)]
pub(super) struct Euler {
    /// Whether the model's input is ln σ / 4 instead of the training step.
    continuous: bool,
}

impl SigmaMethod for Euler {
    fn take(options: &mut Options) -> Result<SigmaConfig<Self>> {
        let continuous = options.choice(
            "timestep_type",
            "discrete",
            &[("discrete", false), ("continuous", true)],
        )?;
        let method = Self { continuous };
        let mut config = SigmaConfig::take_common(options, &DEFAULTS, &Prediction::CURVED, method)?;
        config.method.continuous &= config.prediction == Prediction::Velocity;
        config.sigmas = SigmaOptions::take(options, &[Spread::Karras, Spread::Exponential])?;
        config.sigmas.log_linear = options.choice(
            "interpolation_type",
            "linear",
            &[("linear", false), ("log_linear", true)],
        )?;
        config.end_at_zero = take_final_zero(options)?;
        Ok(config)
    }

    fn visited(&self, mut path: SigmaPath) -> SigmaPath {
        if self.continuous {
            let levels = path.sigmas.iter().take(path.timesteps.len());
            path.timesteps = levels.map(|sigma| round(0.25 * sigma.ln())).collect();
        }
        path
    }

    fn advance(&mut self, call: Call<'_>) -> Tensor<4> {
        let (sigma, next) = call.ends();
        call.sample + call.slope * (next - sigma)
    }
}

#[cfg(test)]
mod tests {
    use crate::stable_diffusion::scheduler::SchedulerConfig;
    use std::path::Path;

    /// Continuous steps are ln σ / 4, in f32, for models that predict v; models that predict the noise keep their training steps.
    #[test]
    fn continuous_steps_are_logarithms_of_the_level() {
        let steps = |prediction: &str, kind: &str| {
            let text = format!(
                r#"{{"_class_name": "EulerDiscreteScheduler", "prediction_type": "{prediction}", "timestep_type": "{kind}"}}"#
            );
            let config = SchedulerConfig::from_json(&text, Path::new("scheduler_config.json"));
            let scheduler = config.unwrap().scheduler(7).unwrap();
            let level = |i: usize| scheduler.noise_level(i);
            let sigmas: Vec<f64> = (0..7).map(|i| level(i).noise / level(i).signal).collect();
            (scheduler.timesteps().to_vec(), sigmas)
        };
        let (continuous, sigmas) = steps("v_prediction", "continuous");
        assert_eq!(continuous.len(), 7);
        for (step, sigma) in continuous.iter().zip(&sigmas) {
            let expected = 0.25 * sigma.ln();
            assert!(
                (step - expected).abs() < 1e-6 * expected.abs().max(1.0),
                "{step} {expected}"
            );
        }
        let discrete = steps("v_prediction", "discrete").0;
        assert!(discrete[0] > 900.0 && discrete != continuous);
        assert_eq!(steps("epsilon", "continuous").0, discrete);
    }
}
