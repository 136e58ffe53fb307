//! Comparison of a device with the reference backend on small models of every kind.

use std::sync::Mutex;

use burn::tensor::{Device, Int, Tensor, TensorData};
use wake_nn::Result;
use wake_nn::noise::{NoiseSource, normal_batch};
use wake_nn::self_check::{self, Stage, seeded};

use crate::stable_diffusion::autoencoder::AutoencoderKlConfig;
use crate::stable_diffusion::text::ClipTextConfig;
use crate::unet::{UNetConfig, UNetInput};

/// Results of the flex backend.
const REFERENCE: &[u8] = include_bytes!("../assets/self_check.safetensors");

/// Runs a small Stable Diffusion model of every kind on a device and compares the results with results of the CPU backend flex.
///
/// Takes about a second, longer on GPUs, because kernels are compiled. Pipelines run it automatically when
/// they are made on a device that is not a CPU, once per device.
///
/// # Errors
///
/// [`wake_nn::Error::WrongNumbers`] with the model that differs, the difference and the allowed difference.
pub fn self_check(device: &Device) -> Result<()> {
    self_check::compare(device, REFERENCE, stages(device))
}

/// Checks a device that is not a CPU when something is made on it, once per process.
///
/// # Errors
///
/// As [`self_check`]; a device that failed is checked again the next time.
pub(crate) fn check_once(device: &Device) -> Result<()> {
    static CHECKED: Mutex<Vec<Device>> = Mutex::new(Vec::new());
    self_check::check_once(&CHECKED, device, self_check)
}

fn stages(device: &Device) -> [Stage; 3] {
    [text(device), unet(device), autoencoder(device)]
}

fn text(device: &Device) -> Stage {
    let config = ClipTextConfig::new()
        .with_vocab_size(100)
        .with_hidden_size(64)
        .with_intermediate_size(128)
        .with_layers(2)
        .with_heads(4);
    let model = seeded(config.init(device), 6);
    let ids: Vec<i32> = (0..77).map(|i| i * 7 % 100).collect();
    let ids: Tensor<2, Int> = Tensor::from_data(TensorData::new(ids, [1, 77]), device);
    Stage::new("text encoder", model.forward(ids).last_hidden_state)
}

fn unet(device: &Device) -> Stage {
    let model = seeded(UNetConfig::small(4, Some(64), None).init(device), 7);
    let noise =
        |seeds: [u64; 2], shape| normal_batch(&seeds.map(NoiseSource::new), 0, shape, device);
    let input = UNetInput {
        sample: noise([1, 2], [4, 16, 16]),
        timesteps: Tensor::from_data([20.0, 980.0], device),
        context: Some(noise([3, 4], [1, 9, 64]).reshape([2, 9, 64])),
        condition: None,
    };
    Stage::new("U-Net", model.forward(input))
}

fn autoencoder(device: &Device) -> Stage {
    let model = seeded(AutoencoderKlConfig::small(4, 2).init(device), 8);
    let image = normal_batch(&[NoiseSource::new(5)], 0, [1, 32, 32], device);
    Stage::new("autoencoder", model.decode(model.encode(image).mode()))
}

#[cfg(all(test, feature = "flex"))]
mod tests {
    use super::*;

    /// With `DRAW=1` this rewrites the file.
    #[test]
    fn the_file_has_what_flex_computes() {
        let device = Device::flex();
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/self_check.safetensors");
        self_check::draw(path.as_ref(), &stages(&device));
        self_check(&device).expect("flex against flex");
    }
}
