//! Reading a pipeline from a folder in diffusers layout.

use std::path::Path;

use burn::tensor::Device;
use serde_json::Value;
use wake_text::{TOKENS, Tokenizer};

use super::{Pipeline, PipelineParts};
use crate::error::{Error, Result};
use crate::stable_diffusion::autoencoder::AutoencoderKl;
use crate::stable_diffusion::scheduler::SchedulerConfig;
use crate::stable_diffusion::text::ClipText;
use crate::unet::UNet;
use wake_nn::check_range;
use whole_files::read_text;

/// Size of CLIP's vocabulary: its tokenizer's largest id, plus one.
const CLIP_VOCABULARY: usize = 49408;

impl Pipeline {
    /// Reads a pipeline from a folder in diffusers layout, as f32.
    ///
    /// The folder holds `text_encoder`, `unet`, `vae`, `scheduler` and optionally `tokenizer` (by default CLIP's own). If it
    /// has a `model_index.json`, the index must name a pipeline of these parts.
    ///
    /// # Errors
    ///
    /// [`Error`] with the file, option or tensors that do not fit, or with two models that do not fit together.
    pub fn load(folder: &Path, device: &Device) -> Result<Self> {
        check_index(&folder.join("model_index.json"))?;
        let tokenizer = tokenizer(&folder.join("tokenizer"))?;
        let scheduler = SchedulerConfig::read(&folder.join("scheduler/scheduler_config.json"))?;
        let text_encoder = ClipText::from_folder(&folder.join("text_encoder"), device)?;
        let text = text_encoder.config();
        check_range(
            "max_position_embeddings",
            text.max_tokens as f64,
            TOKENS as f64,
            1e6,
        )?;
        if tokenizer.is_none() {
            check_range(
                "vocab_size",
                text.vocab_size as f64,
                CLIP_VOCABULARY as f64,
                1e9,
            )?;
        }
        let unet = UNet::from_folder(&folder.join("unet"), device)?;
        let config = unet.config();
        must_agree(
            "cross_attention_dim",
            config.cross_attention_dim.unwrap_or(0),
            text.hidden_size,
        )?;
        let autoencoder = AutoencoderKl::from_folder(&folder.join("vae"), device)?;
        for (name, channels) in [
            ("in_channels", config.in_channels),
            ("out_channels", config.out_channels),
        ] {
            must_agree(name, channels, autoencoder.latent_channels())?;
        }
        let latent_size = config.sample_size;
        let parts = PipelineParts {
            tokenizer,
            text_encoder,
            unet,
            autoencoder,
            scheduler,
            latent_size,
        };
        Self::new(parts, device)
    }
}

/// Classes of diffusers that have the parts of this pipeline.
const CLASSES: [&str; 2] = ["StableDiffusionPipeline", "StableDiffusionImg2ImgPipeline"];

/// Rejects a folder whose index is broken or names another kind of pipeline; the index is optional.
fn check_index(path: &Path) -> Result<()> {
    if !path.exists() {
        return Ok(());
    }
    let index: Value = serde_json::from_str(&read_text(path)?).map_err(|source| {
        Error::Model(wake_nn::Error::Json {
            path: path.to_owned(),
            source,
        })
    })?;
    let class = &index["_class_name"];
    if class.as_str().is_some_and(|class| CLASSES.contains(&class)) {
        return Ok(());
    }
    Err(Error::Model(wake_nn::Error::Unsupported {
        option: "_class_name of model_index.json".to_owned(),
        value: class.to_string(),
        supported: CLASSES.join(", "),
    }))
}

/// Reads the folder's tokenizer; `None`, which stands for CLIP's, if there is none.
fn tokenizer(folder: &Path) -> Result<Option<Tokenizer>> {
    if folder.is_dir() {
        Ok(Some(Tokenizer::from_folder(folder)?))
    } else {
        Ok(None)
    }
}

/// Returns an error for a U-Net that does not fit the other models.
fn must_agree(option: &str, value: usize, expected: usize) -> Result<()> {
    if value == expected {
        return Ok(());
    }
    Err(Error::Model(wake_nn::Error::InvalidOption {
        option: format!("{option} of the U-Net"),
        value: value.to_string(),
        expected: format!("{expected}, as in the other models"),
    }))
}
