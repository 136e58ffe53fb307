//! Noise levels and weights of the losses.

use crate::noise::NoiseSource;
use crate::scheduler::Prediction;

/// Streams of random numbers of a training step.
const LEVEL_STREAM: u32 = 2000;
const KIND_STREAM: u32 = 2001;

/// Part of the images whose noise level is drawn near 1, where the image's mean is decided.
const NEAR_NOISE: f64 = 0.3;

/// What is drawn for one image of one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlowDraw {
    /// Noise level σ, between 0 and 1.
    pub sigma: f64,
    /// Whether the model sees the numbers.
    pub numbers: bool,
    /// Whether the model sees the words.
    pub words: bool,
}

impl FlowDraw {
    /// The draw of image number `position` of a run.
    ///
    /// ```text
    /// σ = 1/(1 + e^(−n)),  n normal          70 %
    /// σ uniform in 0.8…1                     30 %
    /// ```
    ///
    /// Words and numbers: both in 55 % of the images, one of them in 20 % each, none in 5 %.
    ///
    /// # References
    ///
    /// Esser et al. (2024), "Scaling Rectified Flow Transformers", section 3.1 (logit-normal); Ho & Salimans
    /// (2022), "Classifier-Free Diffusion Guidance" (leaving conditions out).
    pub fn new(random: NoiseSource, position: u64) -> Self {
        let [a, b, c] = [0, 1, 2].map(|i| random.uniform(LEVEL_STREAM, 3 * position + i));
        let sigma = if random.uniform(KIND_STREAM, 2 * position) < NEAR_NOISE {
            0.8 + 0.2 * a
        } else {
            let normal = (-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos();
            1.0 / (1.0 + (-normal).exp())
        };
        Self {
            sigma,
            numbers: c < 0.75,
            words: c < 0.55 || (0.75..0.95).contains(&c),
        }
    }
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
