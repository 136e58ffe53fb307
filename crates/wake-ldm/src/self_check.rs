//! Comparison of a device with the reference backend, by small models of every kind.

use std::sync::Mutex;

use burn::module::Module;
use burn::tensor::{Device, Int, Tensor, TensorData};
use wake_nn::Result;
use wake_nn::noise::{NoiseSource, normal_batch};
use wake_nn::self_check::{self, Stage};

use crate::stable_diffusion::autoencoder::AutoencoderKlConfig;
use crate::stable_diffusion::text::ClipTextConfig;
use crate::unet::{UNetConfig, UNetInput};

/// Runs small models of every kind on a device and on the CPU (flex), and compares.
///
/// Takes about a second, on GPUs more, because kernels are compiled. Samplers and pipelines run it by themselves when
/// they are made on a device that is no CPU, once for each device.
///
/// # Errors
///
/// [`wake_nn::Error::WrongNumbers`] with the model that differs, by how much, and the allowed difference.
pub fn self_check(device: &Device) -> Result<()> {
    self_check::compare_stages(device, [text(device), unet(device), autoencoder(device)])
}

/// Checks a device that is no CPU when something is made on it, once a process.
///
/// # Errors
///
/// As [`self_check`]; a device that failed is checked again the next time.
pub(crate) fn check_once(device: &Device) -> Result<()> {
    static CHECKED: Mutex<Vec<Device>> = Mutex::new(Vec::new());
    self_check::check_once(&CHECKED, device, self_check)
}

fn text(device: &Device) -> Stage {
    let cpu = Device::flex();
    let config = ClipTextConfig::new()
        .with_vocab_size(100)
        .with_hidden_size(64)
        .with_intermediate_size(128)
        .with_layers(2)
        .with_heads(4);
    let model = config.init(&cpu);
    let ids: Vec<i32> = (0..77).map(|i| i * 7 % 100).collect();
    let ids = |device: &Device| -> Tensor<2, Int> {
        Tensor::from_data(TensorData::new(ids.clone(), [1, 77]), device)
    };
    let reference = model.forward(ids(&cpu)).last_hidden_state;
    let found = model
        .to_device(device)
        .forward(ids(device))
        .last_hidden_state;
    Stage::new("text encoder", reference, found)
}

fn unet(device: &Device) -> Stage {
    let cpu = Device::flex();
    let config = UNetConfig::small(4, Some(64), None);
    let model = config.init(&cpu);
    let input = |device: &Device| UNetInput {
        sample: normal_batch(
            &[NoiseSource::new(1), NoiseSource::new(2)],
            0,
            [4, 16, 16],
            device,
        ),
        timesteps: Tensor::from_data([20.0, 980.0], device),
        context: Some(
            normal_batch(
                &[NoiseSource::new(3), NoiseSource::new(4)],
                0,
                [1, 9, 64],
                device,
            )
            .reshape([2, 9, 64]),
        ),
        condition: None,
    };
    let reference = model.forward(input(&cpu));
    let found = model.to_device(device).forward(input(device));
    Stage::new("U-Net", reference, found)
}

fn autoencoder(device: &Device) -> Stage {
    let cpu = Device::flex();
    let model = AutoencoderKlConfig::small(4, 2).init(&cpu);
    let image = |device: &Device| normal_batch(&[NoiseSource::new(5)], 0, [1, 32, 32], device);
    let reference = model.decode(model.encode(image(&cpu)).mode());
    let model = model.to_device(device);
    let found = model.decode(model.encode(image(device)).mode());
    Stage::new("autoencoder", reference, found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reference_backend_agrees_with_itself() {
        self_check(&Device::flex()).expect("flex against flex");
    }
}
