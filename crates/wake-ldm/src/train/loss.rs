//! Noise levels and weights of the losses.

use crate::noise::NoiseSource;
use crate::scheduler::Prediction;

/// Stream that noise levels are drawn from.
const LEVEL_STREAM: u32 = 2000;

/// The noise level of the image at a position of a run.
///
/// ```text
/// σ = 1/(1 + e^(−n)),  n normal
/// ```
///
/// # References
///
/// Esser et al. (2024), "Scaling Rectified Flow Transformers", section 3.1 (logit-normal).
pub fn noise_level(random: NoiseSource, position: u64) -> f64 {
    let [a, b] = [0, 1].map(|i| random.uniform(LEVEL_STREAM, 2 * position + i));
    let normal = (-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos();
    1.0 / (1.0 + (-normal).exp())
}

/// Weights of the squared error at each signal-to-noise ratio, for a model that predicts noise or velocity.
///
/// ```text
/// noise:     min(SNR, γ)/SNR
/// velocity:  min(SNR, γ)/(SNR + 1)
/// ```
///
/// # References
///
/// Hang et al. (2023), "Efficient Diffusion Training via Min-SNR Weighting Strategy", section 3.4.
pub fn min_snr_weights(snr: &[f64], gamma: f64, prediction: Prediction) -> Vec<f64> {
    let weight = |&snr: &f64| match prediction {
        Prediction::Velocity => snr.min(gamma) / (snr + 1.0),
        _ if snr <= gamma => 1.0,
        _ => gamma / snr,
    };
    snr.iter().map(weight).collect()
}
