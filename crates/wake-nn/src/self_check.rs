//! Comparison of a device's results with stored results of the reference backend.
//!
//! Drivers and kernels can be faulty: black images and silent garbage have been reported for GPUs. Weights and inputs
//! follow from counters, so they are the same on every device; the results of the CPU backend `flex` were written by a test.

use std::path::Path;
use std::sync::{Mutex, PoisonError};

use burn::module::{Module, ModuleMapper, Param};
use burn::tensor::{Device, Tensor, TensorData};

use crate::device::is_cpu;
use crate::error::{Error, Result};
use crate::noise::NoiseSource;
use crate::weights::files::WeightFiles;

/// Allowed difference, relative to the largest value: enough for half-precision fragments in a GPU's
/// matrix products, too little for faults.
const ALLOWED: f64 = 1e-3;
/// Largest number of values that are compared in a stage.
const COMPARED: usize = 2048;

/// Results of a device at one stage of a model.
#[derive(Debug, Clone)]
pub struct Stage {
    /// Name of the stage, for the error.
    pub name: &'static str,
    /// All numbers, or at most 2,048 at equal distances.
    pub found: Vec<f32>,
}

impl Stage {
    /// The result of a stage.
    pub fn new<const D: usize>(name: &'static str, found: Tensor<D>) -> Self {
        let found = found.into_data();
        // An odd step reaches all columns of an image.
        let step = found.num_elements().div_ceil(COMPARED) | 1;
        Self {
            name,
            found: found.iter::<f32>().step_by(step).collect(),
        }
    }
}

/// Writes the numbers of some stages as a file, which [`compare`] reads.
///
/// # Errors
///
/// [`Error::InvalidSafetensors`] for numbers that cannot be written.
pub fn file_of(stages: &[Stage]) -> Result<Vec<u8>> {
    let bytes: Vec<Vec<u8>> = stages
        .iter()
        .map(|stage| stage.found.iter().flat_map(|x| x.to_le_bytes()).collect())
        .collect();
    let invalid = |reason: safetensors::SafeTensorError| Error::InvalidSafetensors {
        path: "self_check.safetensors".into(),
        reason: reason.to_string().into(),
    };
    let views = stages.iter().zip(&bytes).map(|(stage, bytes)| {
        let shape = vec![stage.found.len()];
        let view = safetensors::tensor::TensorView::new(safetensors::Dtype::F32, shape, bytes);
        view.map(|view| (stage.name, view)).map_err(invalid)
    });
    let views: Vec<_> = views.collect::<Result<_>>()?;
    safetensors::serialize(views, None).map_err(invalid)
}

/// Checks that every stage agrees within 1e-3 of its largest value with the reference.
///
/// - `reference`: a file made by [`file_of`], embedded in the program
///
/// # Errors
///
/// [`Error::WrongNumbers`] for the first stage that does not agree.
pub fn compare(
    device: &Device,
    reference: &'static [u8],
    stages: impl IntoIterator<Item = Stage>,
) -> Result<()> {
    let files = WeightFiles::embedded("self_check.safetensors", reference)?;
    let references = files.tensors()?;
    for stage in stages {
        let reference = references.get(stage.name);
        let reference = reference.map_or(Ok(Vec::new()), |stored| stored.numbers())?;
        compare_numbers(device, stage.name, &reference, &stage.found)?;
    }
    Ok(())
}

/// Sets the weights of a module from a seed alone, the same on every device.
///
/// Matrices have mean 0 and a variance that preserves the size of activations; vectors, such as scales and shifts, are around ½.
pub fn seeded<M: Module>(module: M, seed: u64) -> M {
    module.map(&mut Seeder {
        source: NoiseSource::new(seed),
        number: 0,
    })
}

struct Seeder {
    source: NoiseSource,
    number: u32,
}

impl ModuleMapper for Seeder {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let (source, number) = (self.source, self.number);
        self.number += 1;
        param.map(|old| {
            let (shape, count) = (old.dims(), old.dims().iter().product::<usize>());
            let (mean, spread) = match D {
                1 => (0.5, 0.1),
                _ => (0.0, (shape[0].max(shape[1]) as f32 / count as f32).sqrt()),
            };
            let normals = source.normal(number, count);
            let values: Vec<f32> = normals.iter().map(|x| mean + spread * x).collect();
            let new = Tensor::from_data(TensorData::new(values, shape), &old.device());
            match old.is_require_grad() {
                true => new.require_grad(),
                false => new,
            }
        })
    }
}

/// Checks a device that is not a CPU, once per process; `checked` lists the devices that passed.
///
/// # Errors
///
/// The errors of `check`; a device that failed is checked again the next time.
pub fn check_once<E>(
    checked: &Mutex<Vec<Device>>,
    device: &Device,
    check: impl Fn(&Device) -> Result<(), E>,
) -> Result<(), E> {
    let device = &device.clone().inner();
    if is_cpu(device) {
        return Ok(());
    }
    once(checked, device, check)
}

/// Runs a check on a device unless the list has it, and adds the device if it passes.
fn once<E>(
    checked: &Mutex<Vec<Device>>,
    device: &Device,
    check: impl Fn(&Device) -> Result<(), E>,
) -> Result<(), E> {
    let mut checked = checked.lock().unwrap_or_else(PoisonError::into_inner);
    if !checked.contains(device) {
        check(device)?;
        checked.push(device.clone());
    }
    Ok(())
}

/// Rewrites the file of some stages if the environment variable `DRAW` is set, for the tests of crates that have such a
/// file; the next build compares with it.
///
/// # Panics
///
/// If the file cannot be written.
#[doc(hidden)]
pub fn draw(path: &Path, stages: &[Stage]) {
    if std::env::var("DRAW").is_ok() {
        let bytes = file_of(stages).expect("numbers that can be written");
        std::fs::write(path, bytes).expect("a file that can be written");
    }
}

/// Returns an error for numbers that differ by more than is allowed or are NaN.
fn compare_numbers(
    device: &Device,
    stage: &'static str,
    reference: &[f32],
    found: &[f32],
) -> Result<()> {
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
    if difference <= ALLOWED && reference.len() == found.len() && !found.is_empty() {
        return Ok(());
    }
    Err(Error::WrongNumbers {
        device: crate::device_label(device),
        stage,
        difference,
        allowed: ALLOWED,
    })
}

#[cfg(all(test, feature = "flex"))]
mod tests {
    use std::cell::Cell;

    use super::*;

    #[test]
    fn a_device_is_checked_until_it_is_good_and_then_no_more() {
        let (list, calls) = (Mutex::new(Vec::new()), Cell::new(0));
        let good_from_the_second = |device: &Device| {
            calls.set(calls.get() + 1);
            let found = if calls.get() < 2 { [2.0] } else { [1.0] };
            compare_numbers(device, "test", &[1.0], &found)
        };
        let again = || once(&list, &Device::flex(), good_from_the_second);
        assert!(again().is_err() && again().is_ok() && again().is_ok());
        assert_eq!(calls.get(), 2);
        let never = |_: &Device| -> Result<()> { unreachable!("a CPU is not checked") };
        assert!(check_once(&list, &Device::flex(), never).is_ok());
    }

    #[test]
    fn wrong_numbers_and_none_are_found() {
        let cpu = Device::flex();
        let good = [1.0, -2.0, 3.0];
        assert!(compare_numbers(&cpu, "test", &good, &good).is_ok());
        for bad in [[1.0, -2.0, 3.01], [0.0; 3], [f32::NAN, -2.0, 3.0]] {
            let error = compare_numbers(&cpu, "test", &good, &bad);
            assert!(matches!(
                error,
                Err(Error::WrongNumbers { stage: "test", .. })
            ));
        }
        for few in [&good[..2], &[]] {
            assert!(compare_numbers(&cpu, "test", &good, few).is_err());
        }
    }

    /// Written numbers are read back, and a stage that is not in the file is an error.
    #[test]
    fn numbers_come_back_from_their_file() {
        let cpu = Device::flex();
        let stage = |name, from| {
            let numbers: Vec<f32> = (from..from + 5000).map(|n| n as f32).collect();
            Stage::new(name, Tensor::<1>::from_floats(numbers.as_slice(), &cpu))
        };
        assert!((stage("a", 0).found[1] - 3.0).abs() < 1e-6);
        let file = file_of(&[stage("a", 0), stage("b", 7)]).expect("a file");
        let file: &'static [u8] = file.leak();
        assert!(compare(&cpu, file, [stage("a", 0), stage("b", 7)]).is_ok());
        assert!(compare(&cpu, file, [stage("b", 40)]).is_err());
        assert!(compare(&cpu, file, [stage("c", 0)]).is_err());
    }
}
