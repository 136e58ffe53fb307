//! Weights of the small model: embedded in this crate, or from a folder.

use std::path::Path;

use burn::module::Module;
use burn::tensor::Device;

use super::WakeSampler;
use crate::error::Result;
use crate::wake_model::network::{Part, WakeModel, WakeModelConfig};
use wake_nn::weights::{Layout, load, load_bytes};

/// Bytes of one of the model's files in this crate.
macro_rules! asset {
    ($name:literal) => {
        include_bytes!(concat!("../../../assets/", $name))
    };
}

/// Weights of a part in this crate.
const fn weights(part: Part) -> &'static [u8] {
    match part {
        Part::Patches => asset!("patches.safetensors"),
        Part::Parser => asset!("parser.safetensors"),
        Part::Prior => asset!("prior.safetensors"),
        Part::Flow => asset!("flow.safetensors"),
    }
}

/// Configuration of the model in this crate.
const CONFIG: &str = include_str!("../../../assets/config.json");

impl WakeSampler {
    /// Files of the model in this crate, by name; written into a folder, they can be read by
    /// [`from_folder`](Self::from_folder).
    #[must_use]
    pub fn pretrained_files() -> [(&'static str, &'static [u8]); 5] {
        let file = |part: Part| (part.file(), weights(part));
        [
            (WakeModelConfig::FILE, CONFIG.as_bytes()),
            file(Part::Patches),
            file(Part::Parser),
            file(Part::Prior),
            file(Part::Flow),
        ]
    }

    /// Makes a sampler of the model embedded in this crate.
    ///
    /// # Errors
    ///
    /// None for a build from unchanged files.
    pub fn pretrained(device: &Device) -> Result<Self> {
        let (model, config) = shipped(device)?;
        Self::new(model, config)
    }

    /// Reads a model that training wrote into a folder.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::Io`], [`wake_nn::Error::Json`] or the errors of
    /// [`load`] for files that are missing or do not fit.
    pub fn from_folder(folder: &Path, device: &Device) -> Result<Self> {
        let config = WakeModelConfig::read(&folder.join(WakeModelConfig::FILE))?;
        let (model, layout) = (config.init(device), Layout::Diffusers);
        let file = |part: Part| folder.join(part.file());
        let model = WakeModel {
            patches: load(model.patches, layout, &file(Part::Patches))?,
            parser: load(model.parser, layout, &file(Part::Parser))?,
            prior: load(model.prior, layout, &file(Part::Prior))?,
            flow: load(model.flow, layout, &file(Part::Flow))?,
        };
        Self::new(model, config)
    }
}

/// Model and configuration in this crate.
pub(super) fn shipped(device: &Device) -> Result<(WakeModel, WakeModelConfig)> {
    let config = WakeModelConfig::from_json(CONFIG, Path::new(WakeModelConfig::FILE))?;
    let model = config.init(device);
    let model = WakeModel {
        patches: embedded(model.patches, Part::Patches)?,
        parser: embedded(model.parser, Part::Parser)?,
        prior: embedded(model.prior, Part::Prior)?,
        flow: embedded(model.flow, Part::Flow)?,
    };
    Ok((model, config))
}

/// Loads a part's weights from this crate.
fn embedded<M: Module>(module: M, part: Part) -> Result<M> {
    Ok(load_bytes(
        module,
        Layout::Diffusers,
        part.file(),
        weights(part),
    )?)
}
