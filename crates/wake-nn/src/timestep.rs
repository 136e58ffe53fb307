//! Embedding of a diffusion step, or of any vector of numbers, for the U-Net.

use burn::module::Module;
use burn::nn::{Linear, LinearConfig};
use burn::tensor::{Device, Tensor};

use super::activation::silu;

/// Sinusoidal embedding of the step number, with periods from 2π to 2π · 10⁴.
///
/// ```text
/// ω_i = 10000^(−i / (n/2 − s)),   e(t) = [cos(t ω_0…), sin(t ω_0…)]
/// ```
///
/// - `channels`: n; if it is odd, the last channel is 0
/// - `frequency_shift`: s, 0 in Stable Diffusion
/// - `cos_first`: whether the cosines come before the sines
///
/// The frequencies are rounded as torch rounds them, since t ω reaches 999.
///
/// # Shapes
///
/// `timesteps`: `[batch]`; result: `[batch, channels]`.
///
/// # References
///
/// Vaswani et al. (2017), "Attention Is All You Need", section 3.5.
pub fn sinusoidal_embedding(
    timesteps: Tensor<1>,
    channels: usize,
    cos_first: bool,
    frequency_shift: f64,
) -> Tensor<2> {
    let half = channels / 2;
    let frequencies = Tensor::<1>::from_floats(
        frequencies(half, frequency_shift).as_slice(),
        &timesteps.device(),
    );
    let angles = timesteps.unsqueeze_dim::<2>(1) * frequencies.unsqueeze::<2>();
    let (cos, sin) = (angles.clone().cos(), angles.sin());
    let mut waves = if cos_first {
        vec![cos, sin]
    } else {
        vec![sin, cos]
    };
    if !channels.is_multiple_of(2) {
        let [batch, _] = waves[0].dims();
        waves.push(Tensor::zeros([batch, 1], &waves[0].device()));
    }
    Tensor::cat(waves, 1)
}

#[expect(
    clippy::cast_precision_loss,
    reason = "channel counts are far below 2²⁴"
)]
fn frequencies(half: usize, shift: f64) -> Vec<f32> {
    let rate = -(10_000.0_f64.ln()) as f32;
    let range = (half as f64 - shift) as f32;
    (0..half).map(|i| (rate * i as f32 / range).exp()).collect()
}

/// Two linear layers around a SiLU.
#[derive(Module, Debug)]
pub struct TimestepEmbedding {
    linear_1: Linear,
    linear_2: Linear,
}

impl TimestepEmbedding {
    /// Layers with random weights.
    pub fn new(channels_in: usize, channels_out: usize, device: &Device) -> Self {
        Self {
            linear_1: LinearConfig::new(channels_in, channels_out).init(device),
            linear_2: LinearConfig::new(channels_out, channels_out).init(device),
        }
    }

    /// Embeds a batch of vectors.
    ///
    /// # Shapes
    ///
    /// `[batch, channels_in]` to `[batch, channels_out]`.
    pub fn forward(&self, x: Tensor<2>) -> Tensor<2> {
        self.linear_2.forward(silu(self.linear_1.forward(x)))
    }
}

#[cfg(all(test, feature = "flex"))]
mod tests {
    use super::*;

    /// Diffusers' `get_timestep_embedding` pads odd widths with a zero on the right.
    #[test]
    fn an_odd_width_ends_with_a_zero() {
        let steps = || Tensor::<1>::from_floats([3.0, 700.0], &Device::flex());
        for cos_first in [true, false] {
            let odd = sinusoidal_embedding(steps(), 7, cos_first, 0.0);
            assert_eq!(odd.dims(), [2, 7]);
            let even = sinusoidal_embedding(steps(), 6, cos_first, 0.0);
            let same = (odd.clone().narrow(1, 0, 6) - even).abs().max();
            assert!(same.into_scalar::<f32>() < f32::MIN_POSITIVE);
            let last = odd.narrow(1, 6, 1).abs().max().into_scalar::<f32>();
            assert!(last < f32::MIN_POSITIVE);
        }
    }
}
