//! Comparison of a device with the reference backend, on an image of the model in this crate.

use std::sync::Mutex;

use burn::tensor::Device;
use wake_nn::self_check::{self as check, Stage};

use super::WakeSampler;
use super::pretrained::shipped;
use crate::error::Result;
use crate::wake_model::network::{WakeModel, WakeModelConfig};

/// Results of the flex backend.
const REFERENCE: &[u8] = include_bytes!("../../../assets/wake_model_check.safetensors");

/// Samples the default scene with the embedded model on a device, and compares it with numbers of the CPU backend flex.
///
/// Samplers do this automatically on devices that are not CPUs, once per device.
///
/// # Errors
///
/// [`wake_nn::Error::WrongNumbers`] with the largest difference and the allowed difference.
pub fn self_check(device: &Device) -> Result<()> {
    Ok(check::compare(device, REFERENCE, [stage(device)?])?)
}

impl WakeSampler {
    /// Makes a sampler of a model in memory.
    ///
    /// # Errors
    ///
    /// As [`WakeModelConfig::validate`]; [`wake_nn::Error::WrongNumbers`] for a device that is not a CPU and fails
    /// [`self_check`].
    pub fn new(model: WakeModel, config: WakeModelConfig) -> Result<Self> {
        static CHECKED: Mutex<Vec<Device>> = Mutex::new(Vec::new());
        config.validate()?;
        let sampler = Self::unchecked(model, config);
        check::check_once(&CHECKED, &sampler.device, self_check)?;
        Ok(sampler)
    }
}

fn stage(device: &Device) -> Result<Stage> {
    let (model, config) = shipped(device)?;
    let sampler = WakeSampler::unchecked(model, config);
    let (grey, _) = sampler.sample_batch(&[sampler.base_scene()])?;
    Ok(Stage::new("wake model", grey))
}

#[cfg(all(test, feature = "flex"))]
mod tests {
    use super::*;

    /// With `DRAW=1` this rewrites the file.
    #[test]
    fn the_file_has_what_flex_computes() {
        let device = Device::flex();
        let path = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/assets/wake_model_check.safetensors"
        );
        check::draw(path.as_ref(), &[stage(&device).expect("a stage")]);
        self_check(&device).expect("flex against flex");
    }
}
