//! Writing a pipeline as a folder in diffusers layout.

use std::io::Write;
use std::path::Path;

use serde_json::{Value, json};
use wake_text::Tokenizer;

use super::Pipeline;
use crate::error::Result;
use wake_nn::weights::{Layout, Precision, save_folder};
use whole_files::write_synced;

impl Pipeline {
    /// Writes a folder that [`load`](Self::load) and diffusers' `StableDiffusionPipeline` read:
    /// `tokenizer`, `text_encoder`, `unet`, `vae` and `scheduler`, and `model_index.json` last.
    ///
    /// diffusers cannot read an autoencoder with a `patch_size` above 1 as a whole; see
    /// [`AutoencoderKlConfig::to_json`](crate::stable_diffusion::autoencoder::AutoencoderKlConfig::to_json).
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::Io`] and [`Error::Text`](crate::Error::Text) when a file cannot be
    /// written.
    pub fn save(&self, folder: &Path, precision: Precision) -> Result<()> {
        let parts = &self.parts;
        let tokenizer = parts
            .tokenizer
            .as_ref()
            .unwrap_or_else(|| Tokenizer::clip());
        tokenizer.save(&folder.join("tokenizer"))?;
        let text = parts.text_encoder.config().to_json();
        save_folder(
            &parts.text_encoder,
            Layout::ClipText,
            &text,
            &folder.join("text_encoder"),
            precision,
        )?;
        let unet = parts.unet.config().clone();
        let unet = unet.with_sample_size(parts.latent_size).to_json();
        save_folder(
            &parts.unet,
            Layout::Diffusers,
            &unet,
            &folder.join("unet"),
            precision,
        )?;
        let vae = parts.autoencoder.config().to_json();
        save_folder(
            &parts.autoencoder,
            Layout::Diffusers,
            &vae,
            &folder.join("vae"),
            precision,
        )?;
        let scheduler = folder.join("scheduler/scheduler_config.json");
        write_json(&scheduler, &parts.scheduler.to_json())?;
        write_json(&folder.join("model_index.json"), &self.model_index())
    }

    /// Index that diffusers reads first: the library and class of each part.
    fn model_index(&self) -> Value {
        json!({
            "_class_name": "StableDiffusionPipeline",
            "feature_extractor": [null, null],
            "image_encoder": [null, null],
            "requires_safety_checker": false,
            "safety_checker": [null, null],
            "scheduler": ["diffusers", self.parts.scheduler.class()],
            "text_encoder": ["transformers", "CLIPTextModel"],
            "tokenizer": ["transformers", "CLIPTokenizer"],
            "unet": ["diffusers", "UNet2DConditionModel"],
            "vae": ["diffusers", "AutoencoderKL"],
        })
    }
}

fn write_json(path: &Path, json: &Value) -> Result<()> {
    Ok(write_synced(path, |file| writeln!(file, "{json:#}"))?)
}
