//! Where the weights of the small model come from.

use std::path::Path;

use burn::tensor::Device;

use super::WakeSampler;
use crate::error::Result;
use crate::wake_model::network::{WakeModel, WakeModelConfig};
use wake_nn::weights::{Layout, load, load_bytes};

/// Files of a small model.
const CONFIG: &str = "config.json";
const PATCHES: &str = "patches.safetensors";
const PARSER: &str = "reader.safetensors";
const PRIOR: &str = "prior.safetensors";
const FLOW: &str = "flow.safetensors";

/// Bytes of a file of the model in this crate.
macro_rules! asset {
    ($name:literal) => {
        include_bytes!(concat!("../../../assets/", $name))
    };
}

impl WakeSampler {
    /// The model that lies in this crate.
    ///
    /// # Errors
    ///
    /// None that a build from unchanged files can give.
    pub fn pretrained(device: &Device) -> Result<Self> {
        let config = include_str!("../../../assets/config.json");
        let config = WakeModelConfig::from_json(config, Path::new(CONFIG))?;
        let (model, layout) = (config.init(device), Layout::Diffusers);
        let model = WakeModel {
            patches: load_bytes(
                model.patches,
                layout,
                PATCHES,
                asset!("patches.safetensors"),
            )?,
            parser: load_bytes(model.parser, layout, PARSER, asset!("reader.safetensors"))?,
            prior: load_bytes(model.prior, layout, PRIOR, asset!("prior.safetensors"))?,
            flow: load_bytes(model.flow, layout, FLOW, asset!("flow.safetensors"))?,
        };
        Self::new(model, config)
    }

    /// A model that training wrote into a folder.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::Io`], [`wake_nn::Error::Json`] or what
    /// [`load`] finds for files that are not there or do not fit.
    pub fn from_folder(folder: &Path, device: &Device) -> Result<Self> {
        let file = folder.join(CONFIG);
        let config = WakeModelConfig::read(&file)?;
        let (model, layout) = (config.init(device), Layout::Diffusers);
        let model = WakeModel {
            patches: load(model.patches, layout, &folder.join(PATCHES))?,
            parser: load(model.parser, layout, &folder.join(PARSER))?,
            prior: load(model.prior, layout, &folder.join(PRIOR))?,
            flow: load(model.flow, layout, &folder.join(FLOW))?,
        };
        Self::new(model, config)
    }
}
