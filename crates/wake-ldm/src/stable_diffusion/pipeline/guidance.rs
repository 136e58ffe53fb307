//! Classifier-free guidance, which makes a prediction follow the prompt more closely.

use burn::tensor::Tensor;

/// Guidance scale, and the share of the added contrast that is removed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Guidance {
    pub(super) scale: f64,
    pub(super) rescale: f64,
}

impl Guidance {
    /// Combines the predictions of a batch `[negative…, prompt…]` to one per image.
    pub(super) fn combine(self, both: Tensor<4>) -> Tensor<4> {
        let images = both.dims()[0] / 2;
        let negative = both.clone().narrow(0, 0, images);
        let prompt = both.narrow(0, images, images);
        let guided = negative.clone() + (prompt.clone() - negative) * self.scale;
        if self.rescale > 0.0 {
            self.rescaled(guided, prompt)
        } else {
            guided
        }
    }

    /// Mixes the prediction with a copy rescaled to the standard deviation of the prediction without guidance.
    fn rescaled(self, guided: Tensor<4>, prompt: Tensor<4>) -> Tensor<4> {
        // A constant prediction has nothing to scale: 0/tiny = 0 and not 0/0.
        let ratio = deviation(prompt) / deviation(guided.clone()).clamp_min(f32::MIN_POSITIVE);
        guided * (ratio * self.rescale + (1.0 - self.rescale))
    }
}

/// Standard deviation of each image (with n − 1), `[images, 1, 1, 1]`.
fn deviation(x: Tensor<4>) -> Tensor<4> {
    let [images, channels, rows, columns] = x.dims();
    let flat: Tensor<2> = x.reshape([images, channels * rows * columns]);
    flat.var(1).sqrt().reshape([images, 1, 1, 1])
}

#[cfg(all(test, feature = "flex"))]
mod tests {
    use super::*;
    use burn::tensor::Device;
    use wake_nn::noise::{NoiseSource, normal_batch};

    fn batch(seeds: [u64; 2]) -> Tensor<4> {
        normal_batch(&seeds.map(NoiseSource::new), 0, [2, 3, 5], &Device::flex())
    }

    fn numbers(x: Tensor<4>) -> Vec<f32> {
        x.into_data().try_to_vec().expect("f32 numbers")
    }

    #[test]
    fn scale_one_is_the_prompt_alone_and_zero_the_negative() {
        let both = batch([1, 2]);
        let of = |scale| {
            numbers(
                Guidance {
                    scale,
                    rescale: 0.0,
                }
                .combine(both.clone()),
            )
        };
        let halves = [1, 0].map(|i| numbers(both.clone().narrow(0, i, 1)));
        for (ours, expected) in [of(1.0), of(0.0)].iter().zip(&halves) {
            for (a, b) in ours.iter().zip(expected) {
                assert!((a - b).abs() < 1e-6);
            }
        }
    }

    /// With full rescaling, every image has the standard deviation of its own unguided prediction.
    #[test]
    fn full_rescaling_restores_the_deviation() {
        let both = batch([3, 4]);
        let prompt = both.clone().narrow(0, 1, 1);
        let guided = Guidance {
            scale: 9.0,
            rescale: 1.0,
        }
        .combine(both);
        let [a, b] = [guided, prompt].map(|x| numbers(deviation(x))[0]);
        assert!((a / b - 1.0).abs() < 1e-5, "{a} {b}");
    }

    #[test]
    fn constant_predictions_stay_finite() {
        let both = Tensor::<4>::zeros([2, 1, 2, 2], &Device::flex());
        let guided = Guidance {
            scale: 30.0,
            rescale: 0.7,
        }
        .combine(both);
        assert!(numbers(guided).iter().all(|x| x.is_finite()));
    }
}
