//! Comparison of a device with the reference backend, by gradients of a small model.

use std::sync::Mutex;

use burn::tensor::{Device, Tensor};
use wake_nn::Result;
use wake_nn::noise::{NoiseSource, normal_batch};
use wake_nn::self_check::{self, Stage, seeded};

use super::tensors::gradients;
use wake_ldm::unet::{UNetConfig, UNetInput};

/// Gradients computed by flex.
const REFERENCE: &[u8] = include_bytes!("../assets/self_check.safetensors");

/// Computes the gradients of a small U-Net on a device and compares them with gradients of the CPU backend flex.
///
/// Runs do this automatically, once for each device other than a CPU.
///
/// # Errors
///
/// [`wake_nn::Error::WrongNumbers`] with the largest difference and the allowed one.
pub fn self_check(device: &Device) -> Result<()> {
    self_check::compare(device, REFERENCE, [training_step(device)])
}

/// Checks a device other than a CPU when a run begins on it, once per process.
pub(crate) fn check_once(device: &Device) -> Result<()> {
    static CHECKED: Mutex<Vec<Device>> = Mutex::new(Vec::new());
    self_check::check_once(&CHECKED, device, self_check)
}

/// The gradients of all weights.
fn training_step(device: &Device) -> Stage {
    let device = device.clone().inner().autodiff();
    let config = UNetConfig::small(2, Some(8), None)
        .with_block_out_channels(vec![8, 16])
        .with_down_attention(vec![false, true])
        .with_up_attention(vec![true, false])
        .with_heads(vec![1, 2])
        .with_norm_groups(4);
    let model = seeded(config.init(&device), 9);
    let noise = |seed, shape| normal_batch(&[NoiseSource::new(seed)], 0, shape, &device);
    let found = model.forward(UNetInput {
        sample: noise(1, [2, 16, 16]),
        timesteps: Tensor::from_data([300.0], &device),
        context: Some(noise(2, [1, 5, 8]).reshape([1, 5, 8])),
        condition: None,
    });
    let loss = (found - noise(3, [2, 16, 16])).square().mean();
    Stage::new(
        "training step",
        Tensor::cat(gradients(&model, loss.backward()), 0),
    )
}

#[cfg(all(test, feature = "flex"))]
mod tests {
    use super::*;

    /// Writes the file anew if `DRAW=1` is set.
    #[test]
    fn the_file_has_what_flex_computes() {
        let device = Device::flex();
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/self_check.safetensors");
        self_check::draw(path.as_ref(), &[training_step(&device)]);
        self_check(&device).expect("flex against flex");
    }
}
