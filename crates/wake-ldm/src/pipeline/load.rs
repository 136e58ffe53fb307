//! Reading a pipeline from a folder in diffusers layout.

use std::path::Path;

use burn::tensor::Device;
use wake_text::{TOKENS, Tokenizer};

use super::{Pipeline, PipelineParts};
use crate::autoencoder::AutoencoderKlConfig;
use crate::error::{Result, check_range};
use crate::scheduler::SchedulerConfig;
use crate::text::ClipTextConfig;
use crate::unet::UNetConfig;

impl Pipeline {
    /// Reads a folder with `text_encoder`, `unet`, `vae`, `scheduler` and (else CLIP's own)
    /// `tokenizer`, as diffusers writes it, to f32.
    ///
    /// # Errors
    ///
    /// [`Error`](crate::Error) with the file, option or tensors that do not fit.
    pub fn load(folder: &Path, device: &Device) -> Result<Self> {
        let text = ClipTextConfig::read(&folder.join("text_encoder/config.json"))?;
        let unet = UNetConfig::read(&folder.join("unet/config.json"))?;
        let autoencoder = AutoencoderKlConfig::read(&folder.join("vae/config.json"))?;
        check_range("max_position_embeddings", text.max_tokens as f64, TOKENS as f64, 1e6)?;
        Ok(Self::new(
            PipelineParts {
                tokenizer: tokenizer(&folder.join("tokenizer"))?,
                text_encoder: crate::weights::load(text.init(device), "text", &folder.join("text_encoder/model.safetensors"))?,
                latent_size: unet.sample_size,
                unet: crate::weights::load(unet.init(device), "", &folder.join("unet/diffusion_pytorch_model.safetensors"))?,
                autoencoder: crate::weights::load(autoencoder.init(device), "", &folder.join("vae/diffusion_pytorch_model.safetensors"))?,
                scheduler: SchedulerConfig::read(&folder.join("scheduler/scheduler_config.json"))?,
            },
            device,
        ))
    }
}

/// The folder's tokenizer, or CLIP's where there is none.
fn tokenizer(folder: &Path) -> Result<Option<Tokenizer>> {
    if folder.is_dir() { Ok(Some(Tokenizer::from_folder(folder)?)) } else { Ok(None) }
}
