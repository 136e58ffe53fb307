//! Where the weights of the small model come from.

use std::path::Path;

use burn::tensor::Device;

use super::WakeSampler;
use crate::error::Result;
use crate::small::{PatchTransform, WakeModelConfig};
use crate::weights::{Layout, load, load_bytes, read_text};

/// Files of a small model.
const CONFIG: &str = "config.json";
const MODEL: &str = "model.safetensors";
const PATCHES: &str = "patches.safetensors";

impl WakeSampler {
    /// The model that lies in this crate.
    ///
    /// # Errors
    ///
    /// None that a build from unchanged files can give.
    pub fn pretrained(device: &Device) -> Result<Self> {
        let config = include_str!("../../assets/config.json");
        let config = WakeModelConfig::from_json(config, Path::new(CONFIG))?;
        let patches = PatchTransform::zeros(config.latent_channels, device);
        let (model, layout) = (config.init(device), Layout::Diffusers);
        let model = load_bytes(
            model,
            layout,
            MODEL,
            include_bytes!("../../assets/model.safetensors"),
        )?;
        let patches = load_bytes(
            patches,
            layout,
            PATCHES,
            include_bytes!("../../assets/patches.safetensors"),
        )?;
        Self::new(model, patches, config)
    }

    /// A model that training wrote into a folder.
    ///
    /// # Errors
    ///
    /// [`Error::Io`](crate::Error::Io), [`Error::Json`](crate::Error::Json) or what
    /// [`load`] finds for files that are not there or do not fit.
    pub fn from_folder(folder: &Path, device: &Device) -> Result<Self> {
        let file = folder.join(CONFIG);
        let config = WakeModelConfig::from_json(&read_text(&file)?, &file)?;
        let patches = PatchTransform::zeros(config.latent_channels, device);
        let model = load(config.init(device), Layout::Diffusers, &folder.join(MODEL))?;
        let patches = load(patches, Layout::Diffusers, &folder.join(PATCHES))?;
        Self::new(model, patches, config)
    }
}
