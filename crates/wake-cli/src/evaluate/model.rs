//! The wake model to evaluate.

use crate::exit::Outcome;
use std::path::Path;
use wake_ldm::WakeSampler;
use wake_nn::burn::tensor::Device;

/// Loads the model of a folder, or the one in the crate; `steps` overrides its own number of steps.
pub(crate) fn load(
    folder: Option<&Path>,
    steps: Option<usize>,
    device: &Device,
) -> Outcome<WakeSampler> {
    let sampler = match folder {
        Some(folder) => WakeSampler::from_folder(folder, device)?,
        None => WakeSampler::pretrained(device)?,
    };
    Ok(match steps {
        Some(steps) => sampler.with_steps(steps)?,
        None => sampler,
    })
}
