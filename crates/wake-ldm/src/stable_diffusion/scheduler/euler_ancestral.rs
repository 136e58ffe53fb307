//! Euler's method with fresh noise at every step.

use burn::tensor::Tensor;

use super::betas::DEFAULTS;
use super::prediction::Prediction;
use super::required;
use super::sigma_sampler::{Call, SigmaConfig, SigmaMethod};
use crate::options::Options;
use wake_nn::Result;

/// Steps below the next level, and adds noise to return to it.
///
/// ```text
/// σ_up² = σ'² (σ² − σ'²)/σ²        σ_down² = σ'² − σ_up²
/// ```
///
/// # References
///
/// Song et al. (2021), "Denoising Diffusion Implicit Models", Eq. 16 with η = 1, written in σ.
#[derive(Debug, Clone)]
pub(super) struct EulerAncestral;

impl SigmaMethod for EulerAncestral {
    fn take(options: &mut Options) -> Result<SigmaConfig<Self>> {
        let known = [Prediction::Epsilon, Prediction::Velocity];
        SigmaConfig::take_common(options, &DEFAULTS, &known, Self)
    }

    fn needs_noise(&self) -> bool {
        true
    }

    fn advance(&mut self, call: Call<'_>) -> Tensor<4> {
        let (sigma, next) = call.ends();
        let (up, down) = ancestral_step(sigma, next);
        // Down along the slope, then up with noise.
        call.sample + call.slope * (down - sigma) + required(call.noise) * up
    }
}

/// Levels `σ_up` and `σ_down` of a step from σ to σ'.
fn ancestral_step(sigma: f64, next: f64) -> (f64, f64) {
    let up = (next * next * (sigma * sigma - next * next) / (sigma * sigma))
        .max(0.0)
        .sqrt();
    (up, (next * next - up * up).max(0.0).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_and_remainder_add_up_to_the_next_level() {
        for (sigma, next) in [(14.6, 9.1), (1.0, 1.0), (0.03, 0.0), (4096.0, 20.0)] {
            let (up, down) = ancestral_step(sigma, next);
            assert!((up.hypot(down) - next).abs() < 1e-12 * (1.0 + next));
            assert!(up >= 0.0 && down >= 0.0 && down <= next);
        }
    }
}
