//! From a sentence to an image; this is the only file that determines the order of the stages.
//!
//! ```text
//! prompt ─► token ids ─► embedding ─┐
//!              noise ─► U-Net ⇄ scheduler ─► latents ─► decoder ─► image
//! ```

mod guidance;
mod load;
mod request;
mod sampling;
mod save;

use std::collections::HashMap;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use burn::tensor::{Device, Int, Tensor, TensorData};
use wake_text::Tokenizer;

use crate::error::Result;
use crate::self_check::check_once;
use crate::stable_diffusion::autoencoder::AutoencoderKl;
use crate::stable_diffusion::lora::merge_lora;
use crate::stable_diffusion::scheduler::SchedulerConfig;
use crate::stable_diffusion::text::ClipText;
use crate::unet::UNet;
use wake_nn::check_range;
use wake_nn::weights::{self, Layout};

use request::invalid;
pub use request::{Prompts, Request, StartImage};
pub use sampling::{Progress, Sampling};

/// Number of prompts whose embeddings are cached.
const CACHED_PROMPTS: usize = 256;

/// The models of a pipeline.
#[derive(Debug, Clone)]
pub struct PipelineParts {
    /// Converts prompts to token ids; `None` stands for CLIP's tokenizer.
    pub tokenizer: Option<Tokenizer>,
    /// Converts token ids to embeddings.
    pub text_encoder: ClipText,
    /// Predicts the noise.
    pub unet: UNet,
    /// Converts latents to images and back.
    pub autoencoder: AutoencoderKl,
    /// Scheduler of requests that do not name one.
    pub scheduler: SchedulerConfig,
    /// Rows and columns of the latent images of requests that give no size.
    pub latent_size: usize,
}

/// Text-to-image and image-to-image with a latent diffusion model.
///
/// ```no_run
/// use burn::tensor::Device;
/// use wake_ldm::pipeline::{Pipeline, Request};
///
/// # fn main() -> Result<(), wake_ldm::Error> {
/// let pipeline = Pipeline::load("stable-diffusion-v1-4".as_ref(), &Device::default())?;
/// let request = Request::new("a ship and its wake, radar image").with_steps(20).with_seed(7);
/// let mut sampling = pipeline.sample(&request)?;
/// for progress in sampling.by_ref() {
///     eprintln!("{} of {}", progress.done, progress.of);
/// }
/// let images = pipeline.decode(sampling.latents()); // [1, 3, 512, 512] in [0, 1]
/// # Ok(())
/// # }
/// ```
///
/// # References
///
/// Rombach et al. (2022), "High-Resolution Image Synthesis with Latent Diffusion Models".
#[derive(Debug)]
pub struct Pipeline {
    parts: PipelineParts,
    embeddings: Mutex<HashMap<String, Tensor<3>>>,
    device: Device,
}

impl Pipeline {
    /// Makes a pipeline from models on `device`.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::WrongNumbers`] for a device that is not a CPU and fails
    /// [`self_check`](crate::self_check).
    pub fn new(parts: PipelineParts, device: &Device) -> Result<Self> {
        check_once(device)?;
        Ok(Self {
            parts,
            embeddings: Mutex::default(),
            device: device.clone(),
        })
    }

    /// Returns the models of the pipeline.
    pub fn into_parts(self) -> PipelineParts {
        self.parts
    }

    /// Merges a low-rank adaptation in diffusers' format into the models.
    ///
    /// It is merged into the U-Net, and into the text encoder if the file has layers for it; `scale` is its strength.
    ///
    /// # Errors
    ///
    /// As [`merge_lora`].
    pub fn with_lora(mut self, path: &Path, scale: f64) -> Result<Self> {
        let unet = self.parts.unet;
        self.parts.unet = merge_lora(unet, Layout::Diffusers, "unet", path, scale)?;
        if weights::has_prefix(path, "text_encoder")? {
            let text = self.parts.text_encoder;
            self.parts.text_encoder =
                merge_lora(text, Layout::ClipText, "text_encoder", path, scale)?;
            self.embeddings = Mutex::default();
        }
        Ok(self)
    }

    /// Scheduler of requests that do not name one.
    pub fn scheduler(&self) -> &SchedulerConfig {
        &self.parts.scheduler
    }

    /// The autoencoder, for tiled encoding and decoding of large images.
    pub fn autoencoder(&self) -> &AutoencoderKl {
        &self.parts.autoencoder
    }

    /// Rows and columns of the images of requests that give no size.
    pub fn image_size(&self) -> [usize; 2] {
        [self.parts.latent_size * self.parts.autoencoder.downsampling(); 2]
    }

    /// Device of the models.
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// Embeds prompts one at a time, with a cache of earlier ones.
    ///
    /// # Shapes
    ///
    /// `[prompts, 77, width]`
    ///
    /// # Panics
    ///
    /// When there is no prompt.
    pub fn embed<S: AsRef<str>>(&self, prompts: &[S]) -> Tensor<3> {
        Tensor::cat(
            prompts
                .iter()
                .map(|prompt| self.embed_one(prompt.as_ref()))
                .collect(),
            0,
        )
    }

    fn embed_one(&self, prompt: &str) -> Tensor<3> {
        let mut cache = self
            .embeddings
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = cache.get(prompt) {
            return known.clone();
        }
        let ids = token_ids(self.parts.tokenizer.as_ref(), prompt);
        let length = ids.len();
        let ids: Tensor<2, Int> =
            Tensor::from_data(TensorData::new(ids, [1, length]), &self.device);
        let embedding = self.parts.text_encoder.last_hidden_state(ids);
        if cache.len() >= CACHED_PROMPTS {
            cache.clear();
        }
        cache.insert(prompt.to_owned(), embedding.clone());
        embedding
    }

    /// Decodes latents to images in [0, 1], one at a time.
    ///
    /// # Shapes
    ///
    /// `[images, latent_channels, rows, columns]` to `[images, channels, …]`, larger by the
    /// autoencoder's downsampling.
    pub fn decode(&self, latents: Tensor<4>) -> Tensor<4> {
        let z = self.parts.autoencoder.from_latents(latents);
        (self.parts.autoencoder.decode_sliced(z) / 2.0 + 0.5).clamp(0.0, 1.0)
    }

    /// Encodes images in [0, 1] to latents, sampled with the given noise, one image at a time.
    ///
    /// # Shapes
    ///
    /// `pixels`: `[images, channels, rows, columns]`; `noise` and result: shaped like the latents of
    /// [`decode`](Self::decode).
    pub fn encode(&self, pixels: Tensor<4>, noise: Tensor<4>) -> Tensor<4> {
        let images = pixels.dims()[0];
        let one = |k: usize| {
            let image = self
                .parts
                .autoencoder
                .scaled(pixels.clone().narrow(0, k, 1));
            let posterior = self.parts.autoencoder.encode(image);
            posterior.sample(noise.clone().narrow(0, k, 1))
        };
        self.parts
            .autoencoder
            .to_latents(Tensor::cat((0..images).map(one).collect(), 0))
    }

    /// Channels, rows and columns of the latent images of a request.
    fn latent_shape(&self, request: &Request) -> Result<[usize; 3]> {
        let down = self.parts.autoencoder.downsampling();
        let [rows, columns] = match (request.size, &request.start, &request.latents) {
            (Some(size), _, _) => size,
            (None, Some((StartImage::Pixels(pixels), _)), _) => last_two(pixels),
            (None, Some((StartImage::Latents(x), _)), _) | (None, None, Some(x)) => {
                last_two(x).map(|size| size * down)
            }
            (None, None, None) => self.image_size(),
        };
        for (name, size) in [("rows", rows), ("columns", columns)] {
            check_range(name, size as f64, down as f64, 16384.0)?;
            if !size.is_multiple_of(down) {
                return Err(invalid(name, size, format!("a multiple of {down}")));
            }
        }
        Ok([
            self.parts.autoencoder.latent_channels(),
            rows / down,
            columns / down,
        ])
    }

    /// Embeddings of prompts, one per image.
    fn contexts(&self, prompts: &Prompts, request: &Request) -> Result<Tensor<3>> {
        let embeddings = match prompts {
            Prompts::Texts(texts) => self.embed(texts),
            Prompts::Embeddings(embeddings) => embeddings.clone(),
        };
        let [found, tokens, width] = embeddings.dims();
        let expected = self.parts.text_encoder.width();
        if width != expected {
            return Err(invalid("width of embeddings", width, expected.to_string()));
        }
        let images = request.images();
        Ok(embeddings
            .reshape([found, 1, tokens, width])
            .repeat_dim(1, images / found)
            .reshape([images, tokens, width]))
    }

    /// Checks the shape of the condition vectors, if there are any.
    fn check_condition(&self, request: &Request) -> Result<()> {
        let Some(condition) = &request.condition else {
            return Ok(());
        };
        match self.parts.unet.condition_channels() {
            Some(channels) => {
                let expected = [request.images(), channels];
                check_shape("condition", &condition.dims(), &expected)
            }
            None => Err(invalid(
                "shape of condition",
                format!("{:?}", condition.dims()),
                "none, because this U-Net has no condition vector",
            )),
        }
    }

    /// Checks that pixels fit latent images of this shape.
    fn check_pixels(&self, pixels: &Tensor<4>, [_, rows, columns]: [usize; 3]) -> Result<()> {
        let autoencoder = &self.parts.autoencoder;
        let (channels, down) = (autoencoder.image_channels(), autoencoder.downsampling());
        let expected = [channels, rows * down, columns * down];
        check_shape("the start image", &pixels.dims()[1..], &expected)
    }
}

/// Rejects a tensor of another shape.
fn check_shape(what: &str, found: &[usize], expected: &[usize]) -> Result<()> {
    match found == expected {
        true => Ok(()),
        false => Err(invalid(
            &format!("shape of {what}"),
            format!("{found:?}"),
            format!("{expected:?}"),
        )),
    }
}

/// Token ids of a prompt, including marks and padding; without a tokenizer, CLIP's is used.
pub fn token_ids(tokenizer: Option<&Tokenizer>, prompt: &str) -> Vec<i32> {
    let tokenizer = tokenizer.unwrap_or_else(|| Tokenizer::clip());
    let tokens = tokenizer.encode(prompt);
    tokens.ids.iter().map(|&id| id as i32).collect()
}

fn last_two(x: &Tensor<4>) -> [usize; 2] {
    let [_, _, rows, columns] = x.dims();
    [rows, columns]
}

/// Rounds images in [0, 1] to bytes, as rows of interleaved channels, one vector per image.
///
/// # Shapes
///
/// `[images, channels, rows, columns]` to `rows · columns · channels` bytes each.
pub fn to_bytes(images: Tensor<4>) -> Vec<Vec<u8>> {
    let [count, channels, rows, columns] = images.dims();
    let interleaved = images
        .permute([0, 2, 3, 1])
        .reshape([count * rows * columns * channels]);
    let bytes: Vec<u8> = interleaved
        .into_data()
        .iter::<f32>()
        .map(|x| (x * 255.0).round_ties_even().clamp(0.0, 255.0) as u8)
        .collect();
    bytes
        .chunks(rows * columns * channels)
        .map(<[u8]>::to_vec)
        .collect()
}
