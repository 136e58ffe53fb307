//! Comparison of a device with the reference backend.
//!
//! Drivers and kernels with faults exist: black images and silent garbage have been reported for GPUs.

use std::sync::{Mutex, PoisonError};

use burn::module::Module;
use burn::tensor::{Device, Tensor};

use crate::device::is_cpu;
use crate::error::{Error, Result};
use crate::noise::{NoiseSource, normal_batch};
use crate::resample::{Downsample, Upsample};
use crate::resnet::{ResnetBlock, ResnetShape};
use crate::transformer::{Transformer2d, TransformerShape};

/// Allowed difference, relative to the largest value: what half-precision fragments in a GPU's matrix
/// products explain, and faults do not.
const ALLOWED: f64 = 1e-3;

/// One stage of a model with its numbers on the reference backend and on the device that is checked.
#[derive(Debug, Clone)]
pub struct Stage {
    /// Name of the stage, for the error.
    pub name: &'static str,
    /// Numbers of the CPU backend `flex`.
    pub reference: Vec<f32>,
    /// Numbers of the device.
    pub found: Vec<f32>,
}

impl Stage {
    /// The results of one function on two devices.
    pub fn new<const D: usize>(name: &'static str, reference: Tensor<D>, found: Tensor<D>) -> Self {
        let numbers = |x: Tensor<D>| x.into_data().iter::<f32>().collect();
        Self {
            name,
            reference: numbers(reference),
            found: numbers(found),
        }
    }
}

/// Runs every kind of layer with fixed weights on a device and on the CPU, and compares.
///
/// # Errors
///
/// [`Error::WrongNumbers`] with the layer that differs, by how much, and the allowed difference.
pub fn self_check(device: &Device) -> Result<()> {
    compare_stages(device, [residual(device), transformer(device)])
}

/// Checks that every stage agrees within 1e-3 of its largest value.
///
/// # Errors
///
/// [`Error::WrongNumbers`] for the first stage that does not.
pub fn compare_stages(device: &Device, stages: impl IntoIterator<Item = Stage>) -> Result<()> {
    let mut stages = stages.into_iter();
    stages.try_for_each(|stage| compare(device, stage.name, &stage.reference, &stage.found))
}

/// Checks a device that is no CPU, once a process; `checked` lists the devices that are good.
///
/// # Errors
///
/// As `check`; a device that failed is checked again the next time.
pub fn check_once(
    checked: &Mutex<Vec<Device>>,
    device: &Device,
    check: impl Fn(&Device) -> Result<()>,
) -> Result<()> {
    let device = &device.clone().inner();
    if is_cpu(device) {
        return Ok(());
    }
    once(checked, device, check)
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

/// A residual block between a halving and a doubling of the image.
fn residual(device: &Device) -> Stage {
    let cpu = Device::flex();
    let shape = ResnetShape {
        channels_in: 16,
        channels_out: 32,
        time_channels: None,
        groups: 8,
        epsilon: 1e-6,
    };
    let layers = (
        ResnetBlock::new(shape, &cpu),
        Downsample::padded(32, &cpu),
        Upsample::new(32, &cpu),
    );
    let image = |device: &Device| normal_batch(&[NoiseSource::new(1)], 0, [16, 20, 24], device);
    let forward = |(block, down, up): (ResnetBlock, Downsample, Upsample), device: &Device| {
        let x = down.forward(block.forward(image(device), None));
        up.forward(x, None)
    };
    let reference = forward(layers.clone(), &cpu);
    let (block, down, up) = layers;
    let moved = (
        block.to_device(device),
        down.to_device(device),
        up.to_device(device),
    );
    Stage::new("residual block", reference, forward(moved, device))
}

/// A transformer whose pixels attend to each other and to tokens.
fn transformer(device: &Device) -> Stage {
    let cpu = Device::flex();
    let shape = TransformerShape {
        channels: 32,
        context_channels: Some(24),
        heads: 4,
        layers: 1,
        groups: 8,
        linear_projection: false,
    };
    let model = Transformer2d::new(shape, &cpu);
    let image = |device: &Device| normal_batch(&[NoiseSource::new(2)], 0, [32, 8, 8], device);
    let context = |device: &Device| -> Tensor<3> {
        normal_batch(&[NoiseSource::new(3)], 0, [1, 9, 24], device).reshape([1, 9, 24])
    };
    let reference = model.forward(image(&cpu), Some(&context(&cpu)));
    let found = model
        .to_device(device)
        .forward(image(device), Some(&context(device)));
    Stage::new("transformer", reference, found)
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
        let never = |_: &Device| unreachable!("a CPU is not checked");
        assert!(check_once(&list, &Device::flex(), never).is_ok());
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
