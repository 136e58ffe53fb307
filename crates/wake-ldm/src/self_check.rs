//! Does a device compute what the reference backend computes?

use std::sync::{Mutex, PoisonError};

use burn::module::Module;
use burn::tensor::{Device, Int, Tensor, TensorData};

use crate::device::is_cpu;
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
/// Takes about a second, on GPUs more, because kernels are compiled. Samplers and pipelines run it by themselves when
/// they are made on a device that is no CPU, once for each device.
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

/// Checks a device that is no CPU when something is made on it, once in a process.
///
/// # Errors
///
/// As [`self_check`]; a device that failed is checked again the next time.
pub(crate) fn check_once(device: &Device) -> Result<()> {
    static CHECKED: Mutex<Vec<Device>> = Mutex::new(Vec::new());
    let device = &device.clone().inner();
    if is_cpu(device) {
        return Ok(());
    }
    once(&CHECKED, device, self_check)
}

/// Runs a check on a device unless the list has it, and puts it there if it is good.
fn once(
    checked: &Mutex<Vec<Device>>,
    device: &Device,
    check: impl Fn(&Device) -> Result<()>,
) -> Result<()> {
    let mut checked = checked.lock().unwrap_or_else(PoisonError::into_inner);
    if !checked.contains(device) {
        check(device)?;
        checked.push(device.clone());
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
    use std::cell::Cell;

    use super::*;

    #[test]
    fn the_reference_backend_agrees_with_itself() {
        self_check(&Device::flex()).expect("flex against flex");
    }

    #[test]
    fn a_device_is_checked_until_it_is_good_and_then_no_more() {
        let (list, calls) = (Mutex::new(Vec::new()), Cell::new(0));
        let good_from_the_second = |device: &Device| {
            calls.set(calls.get() + 1);
            let found = if calls.get() < 2 { [2.0] } else { [1.0] };
            compare(device, "test", &[1.0], &found)
        };
        let again = || once(&list, &Device::flex(), good_from_the_second);
        assert!(again().is_err() && again().is_ok() && again().is_ok());
        assert_eq!(calls.get(), 2);
        assert!(check_once(&Device::flex()).is_ok());
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
