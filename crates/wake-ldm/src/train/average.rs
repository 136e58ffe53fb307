//! Averaged weights, which make better images than the last ones.

use burn::tensor::Tensor;

/// An exponential moving average of the weights.
///
/// ```text
/// a ← d a + (1 − d) w,    d = min(decay, 1 − (1 + step)^(−2/3))
/// ```
///
/// The decay starts low, so that the first weights, which know nothing, are soon forgotten.
///
/// # References
///
/// Karras et al. (2024), "Analyzing and Improving the Training Dynamics of Diffusion Models", section 3. The start
/// is the one of diffusers' `EMAModel`.
#[derive(Debug, Clone)]
pub struct Average {
    values: Vec<Tensor<1>>,
    decay: f64,
}

impl Average {
    /// An average that begins with the given weights.
    pub fn new(values: Vec<Tensor<1>>, decay: f64) -> Self {
        Self { values, decay }
    }

    /// The averaged weights.
    pub fn values(&self) -> &[Tensor<1>] {
        &self.values
    }

    /// The decay after `step` steps.
    pub fn decay(&self, step: usize) -> f64 {
        self.decay.min(1.0 - (1.0 + step as f64).powf(-2.0 / 3.0))
    }

    /// Takes in the weights after step number `step`, counted from 1.
    pub fn update(&mut self, weights: &[Tensor<1>], step: usize) {
        let decay = self.decay(step);
        for (average, weight) in self.values.iter_mut().zip(weights) {
            *average = average.clone() * decay + weight.clone() * (1.0 - decay);
        }
    }
}

#[cfg(all(test, feature = "flex"))]
mod tests {
    use super::*;
    use burn::tensor::Device;

    #[test]
    fn the_average_of_a_ramp_is_the_closed_form() {
        let tensor = |x: f64| Tensor::<1>::from_floats([x as f32], &Device::flex());
        let mut average = Average::new(vec![tensor(0.0)], 0.5);
        // From step 2 on the decay is 1 − 3^(−2/3) = 0.519 or more, so 0.5: weights 0, 1, …, n leave the
        // lag d/(1 − d) = 1 once the start is forgotten.
        for step in 1..=40 {
            average.update(&[tensor(step as f64)], step);
        }
        let lag = 40.0 - average.values()[0].clone().into_scalar::<f32>();
        assert!((lag - 1.0).abs() < 1e-5, "{lag}");
        assert!((average.decay(1) - (1.0 - 2f64.powf(-2.0 / 3.0))).abs() < 1e-15);
    }
}
