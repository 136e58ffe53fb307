//! Does a device compute what the reference backend computes?

use burn::module::Module;
use burn::tensor::{Device, Int, Tensor, TensorData};

use crate::error::{Error, Result};
use crate::noise::{NoiseSource, normal_batch};
use crate::stable_diffusion::autoencoder::AutoencoderKlConfig;
use crate::stable_diffusion::text::ClipTextConfig;
use crate::unet::{UNetConfig, UNetInput};

/// Allowed difference, relative to the largest value: what half-precision fragments in a GPU's matrix
/// products explain, and faults do not.
const ALLOWED: f64 = 1e-3;

/// Runs small models of every kind on a device and on the CPU (flex), and compares.
///
/// Drivers and kernels with faults exist: black images and silent garbage have been reported for GPUs.
/// Takes about a second, on GPUs more, because kernels are compiled.
///
/// # Errors
///
/// [`Error::WrongNumbers`] with the model that came out differently, by how much, and what is allowed.
pub fn self_check(device: &Device) -> Result<()> {
    for (stage, reference, found) in [text(device), unet(device), autoencoder(device)] {
        compare(device, stage, &reference, &found)?;
    }
    Ok(())
}

/// What a stage gives on the reference backend and on the device.
type Outcome = (&'static str, Vec<f32>, Vec<f32>);

fn text(device: &Device) -> Outcome {
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
    let reference = numbers(model.forward(ids(&cpu)).last_hidden_state);
    let found = model
        .to_device(device)
        .forward(ids(device))
        .last_hidden_state;
    ("text encoder", reference, numbers(found))
}

fn unet(device: &Device) -> Outcome {
    let cpu = Device::flex();
    let config = UNetConfig::small(4, 64, None);
    let model = config.init(&cpu);
    let input = |device: &Device| UNetInput {
        sample: normal_batch(
            &[NoiseSource::new(1), NoiseSource::new(2)],
            0,
            [4, 16, 16],
            device,
        ),
        timesteps: Tensor::from_data([20.0, 980.0], device),
        context: normal_batch(
            &[NoiseSource::new(3), NoiseSource::new(4)],
            0,
            [1, 9, 64],
            device,
        )
        .reshape([2, 9, 64]),
        condition: None,
    };
    let reference = numbers(model.forward(input(&cpu)));
    (
        "U-Net",
        reference,
        numbers(model.to_device(device).forward(input(device))),
    )
}

fn autoencoder(device: &Device) -> Outcome {
    let cpu = Device::flex();
    let model = AutoencoderKlConfig::small(4, 2).init(&cpu);
    let image = |device: &Device| normal_batch(&[NoiseSource::new(5)], 0, [1, 32, 32], device);
    let reference = numbers(model.decode(model.encode(image(&cpu)).mode()));
    let model = model.to_device(device);
    (
        "autoencoder",
        reference,
        numbers(model.decode(model.encode(image(device)).mode())),
    )
}

fn numbers<const D: usize>(x: Tensor<D>) -> Vec<f32> {
    x.into_data().iter::<f32>().collect()
}

/// The error for numbers that differ by more than is allowed, or are none.
fn compare(device: &Device, stage: &'static str, reference: &[f32], found: &[f32]) -> Result<()> {
    let largest = reference
        .iter()
        .fold(f32::MIN_POSITIVE, |largest, x| largest.max(x.abs()));
    let farther = |far: f64, (a, b): (&f32, &f32)| {
        let difference = f64::from((a - b).abs() / largest);
        if difference.is_nan() {
            f64::INFINITY
        } else {
            far.max(difference)
        }
    };
    let difference = reference.iter().zip(found).fold(0.0, farther);
    if difference <= ALLOWED && reference.len() == found.len() {
        return Ok(());
    }
    Err(Error::WrongNumbers {
        device: format!("{device:?}"),
        stage,
        difference,
        allowed: ALLOWED,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reference_backend_agrees_with_itself() {
        self_check(&Device::flex()).expect("flex against flex");
    }

    #[test]
    fn wrong_numbers_and_none_are_found() {
        let cpu = Device::flex();
        let good = [1.0, -2.0, 3.0];
        assert!(compare(&cpu, "test", &good, &good).is_ok());
        for bad in [[1.0, -2.0, 3.01], [0.0; 3], [f32::NAN, -2.0, 3.0]] {
            let error = compare(&cpu, "test", &good, &bad);
            assert!(matches!(
                error,
                Err(Error::WrongNumbers { stage: "test", .. })
            ));
        }
        assert!(compare(&cpu, "test", &good, &good[..2]).is_err());
    }
}
