//! Meaning of a model's prediction, and clipping of the clean image.

use burn::tensor::Tensor;

use crate::options::Options;
use wake_nn::{Error, Result, check_range};

/// Amplitudes of clean image and noise in a noisy image.
///
/// ```text
/// x = α x₀ + σ n
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseLevel {
    /// Factor α of the clean image.
    pub signal: f64,
    /// Factor σ of the standard normal noise.
    pub noise: f64,
}

impl NoiseLevel {
    /// Mixes an image with noise: α x₀ + σ n.
    pub fn mix(self, clean: Tensor<4>, noise: Tensor<4>) -> Tensor<4> {
        clean * self.signal + noise * self.noise
    }

    /// Target of v-prediction, α n − σ x₀.
    ///
    /// # References
    ///
    /// Salimans & Ho (2022), "Progressive Distillation for Fast Sampling of Diffusion Models",
    /// appendix D.
    pub fn velocity(self, clean: Tensor<4>, noise: Tensor<4>) -> Tensor<4> {
        noise * self.signal - clean * self.noise
    }
}

/// Quantity that a model was trained to predict from x = α x₀ + σ n.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Prediction {
    /// The noise n.
    Epsilon,
    /// The clean image x₀.
    Sample,
    /// v = α n − σ x₀ (for α² + σ² = 1).
    Velocity,
    /// The direction of a straight path, n − x₀.
    Flow,
}

impl Prediction {
    /// Predictions for models of curved paths, α² + σ² = 1.
    pub(super) const CURVED: [Self; 3] = [Self::Epsilon, Self::Sample, Self::Velocity];

    /// Clean image of a prediction.
    ///
    /// ```text
    /// ε: (x − σ ε)/α     v: (α x/s − σ v)/s, s² = α² + σ²     flow: x − σ v
    /// ```
    pub fn denoised(
        self,
        level: NoiseLevel,
        sample: Tensor<4>,
        prediction: Tensor<4>,
    ) -> Tensor<4> {
        let NoiseLevel { signal, noise } = level;
        match self {
            Self::Epsilon => (sample - prediction * noise) / signal,
            Self::Sample => prediction,
            Self::Velocity => {
                let scale = signal.hypot(noise);
                sample * (signal / scale / scale) - prediction * (noise / scale)
            }
            Self::Flow => sample - prediction * noise,
        }
    }

    /// Noise of a prediction.
    ///
    /// ```text
    /// x₀: (x − α x₀)/σ     v: (α v + σ x/s)/s     flow: x + (1 − σ) v
    /// ```
    pub fn noise(self, level: NoiseLevel, sample: Tensor<4>, prediction: Tensor<4>) -> Tensor<4> {
        let NoiseLevel { signal, noise } = level;
        match self {
            Self::Epsilon => prediction,
            Self::Sample => (sample - prediction * signal) / noise,
            Self::Velocity => {
                let scale = signal.hypot(noise);
                prediction * (signal / scale) + sample * (noise / scale / scale)
            }
            Self::Flow => sample + prediction * (1.0 - noise),
        }
    }

    /// Reads `prediction_type`, of which a method may support only some values.
    pub(super) fn take(options: &mut Options, known: &[Self]) -> Result<Self> {
        let known: Vec<_> = known.iter().map(|kind| (kind.name(), *kind)).collect();
        options.choice("prediction_type", "epsilon", &known)
    }

    /// Name in diffusers.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Epsilon => "epsilon",
            Self::Sample => "sample",
            Self::Velocity => "v_prediction",
            Self::Flow => "flow_prediction",
        }
    }

    /// Rejects a noise level without signal if the clean image would be divided by it.
    pub(super) fn check_signal(self, signal: f64) -> Result<()> {
        if self != Self::Epsilon || signal > 0.0 {
            return Ok(());
        }
        Err(Error::InvalidOption {
            option: "prediction_type".to_owned(),
            value: "epsilon".to_owned(),
            expected: "v_prediction or sample, because the schedule has no signal left at its end \
                       (rescale_betas_zero_snr)"
                .to_owned(),
        })
    }
}

/// Clipping of the predicted clean image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Clipping {
    /// No clipping, as latent images need it.
    Off,
    /// Clipping to ± a number.
    Range(f64),
    /// Clipping of each image to a quantile of its absolute values, and division by that.
    ///
    /// # References
    ///
    /// Saharia et al. (2022), "Photorealistic Text-to-Image Diffusion Models with Deep Language
    /// Understanding", section 2.3.
    Dynamic {
        /// Quantile, in [0, 1].
        ratio: f64,
        /// Largest limit; the smallest is 1.
        max: f64,
    },
}

impl Clipping {
    /// Clips the images of a batch.
    pub fn apply(self, denoised: Tensor<4>) -> Tensor<4> {
        match self {
            Self::Off => denoised,
            Self::Range(range) => denoised.clamp(-range, range),
            Self::Dynamic { ratio, max } => {
                let limit = quantile(denoised.clone().abs(), ratio).clamp(1.0, max);
                denoised
                    .max_pair(limit.clone().neg())
                    .min_pair(limit.clone())
                    / limit
            }
        }
    }

    /// Reads `clip_sample`, `thresholding` and their numbers.
    pub(super) fn take(options: &mut Options, clip_by_default: bool) -> Result<Self> {
        let range = Self::take_range(options, clip_by_default)?;
        Ok(match Self::take_dynamic(options)? {
            Self::Off => range,
            dynamic => dynamic,
        })
    }

    /// Reads `clip_sample` and its range.
    pub(super) fn take_range(options: &mut Options, clip_by_default: bool) -> Result<Self> {
        let range = options.f64("clip_sample_range", 1.0)?;
        check_range("clip_sample_range", range, 0.0, f64::MAX)?;
        let clip = options.bool("clip_sample", clip_by_default)?;
        Ok(if clip { Self::Range(range) } else { Self::Off })
    }

    /// Reads `thresholding` and its numbers.
    pub(super) fn take_dynamic(options: &mut Options) -> Result<Self> {
        let ratio = options.f64("dynamic_thresholding_ratio", 0.995)?;
        let max = options.f64("sample_max_value", 1.0)?;
        check_range("dynamic_thresholding_ratio", ratio, 0.0, 1.0)?;
        check_range("sample_max_value", max, 1.0, f64::MAX)?;
        let on = options.bool("thresholding", false)?;
        Ok(if on {
            Self::Dynamic { ratio, max }
        } else {
            Self::Off
        })
    }
}

/// Quantile of each image, interpolated linearly between its elements, as `[batch, 1, 1, 1]`.
fn quantile(x: Tensor<4>, ratio: f64) -> Tensor<4> {
    let [batch, channels, rows, columns] = x.dims();
    let count = channels * rows * columns;
    let sorted: Tensor<2> = x.reshape([batch, count]).sort(1);
    let rank = ratio * (count - 1) as f64;
    let below = rank.floor() as usize;
    let above = (below + 1).min(count - 1);
    let weight = rank - below as f64;
    let mixed =
        sorted.clone().narrow(1, below, 1) * (1.0 - weight) + sorted.narrow(1, above, 1) * weight;
    mixed.reshape([batch, 1, 1, 1])
}

#[cfg(all(test, feature = "flex"))]
mod tests {
    use super::*;
    use burn::tensor::Device;

    /// For a mixture x = α x₀ + σ n, each prediction as defined gives back the image and the noise, on curved paths of any
    /// length s and on the straight path.
    #[test]
    fn predictions_stand_for_the_image_and_the_noise_of_a_mixture() {
        let device = Device::flex();
        let of = |values: [f32; 4]| Tensor::<1>::from_floats(values, &device).reshape([1, 1, 2, 2]);
        let (clean, noise) = (of([0.5, -1.0, 2.0, 0.0]), of([1.5, 0.25, -0.75, 1.0]));
        for (signal, sigma) in [(0.8, 0.6), (0.28, 0.96), (1.0, 0.75), (1.0, 2.4)] {
            let curved = NoiseLevel {
                signal,
                noise: sigma,
            };
            // v of Salimans and Ho for the mixture scaled to α² + σ² = 1.
            let velocity = curved.velocity(clean.clone(), noise.clone()) / signal.hypot(sigma);
            let straight = NoiseLevel {
                signal: 0.375,
                noise: 0.625,
            };
            for (kind, level, prediction) in [
                (Prediction::Epsilon, curved, noise.clone()),
                (Prediction::Sample, curved, clean.clone()),
                (Prediction::Velocity, curved, velocity),
                (Prediction::Flow, straight, noise.clone() - clean.clone()),
            ] {
                let mixture = level.mix(clean.clone(), noise.clone());
                let found = [
                    kind.denoised(level, mixture.clone(), prediction.clone()) - clean.clone(),
                    kind.noise(level, mixture, prediction) - noise.clone(),
                ];
                for difference in found {
                    // A few roundings of numbers up to 4, divided by an α or σ of at least 0.28.
                    let largest: f32 = difference.abs().max().into_scalar();
                    assert!(largest < 1e-5, "{kind:?} {level:?}: {largest:e}");
                }
            }
        }
    }
}
