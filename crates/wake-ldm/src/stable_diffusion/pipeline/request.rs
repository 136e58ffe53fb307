//! Options of a run.

use burn::tensor::Tensor;

use crate::error::{Error, Result};
use crate::stable_diffusion::scheduler::SchedulerConfig;
use wake_nn::check_range;
use wake_nn::noise::NoiseSource;

/// Prompts as texts, or as embeddings from the text encoder.
#[derive(Debug, Clone)]
#[allow(
    clippy::large_enum_variant,
    reason = "a request has two of these, not thousands"
)]
pub enum Prompts {
    /// One text per image (times `Request::count`).
    Texts(Vec<String>),
    /// Embeddings, `[prompts, tokens, width]`.
    Embeddings(Tensor<3>),
}

impl Prompts {
    fn len(&self) -> usize {
        match self {
            Self::Texts(texts) => texts.len(),
            Self::Embeddings(embeddings) => embeddings.dims()[0],
        }
    }
}

impl From<&str> for Prompts {
    fn from(text: &str) -> Self {
        Self::Texts(vec![text.to_owned()])
    }
}

impl From<Vec<String>> for Prompts {
    fn from(texts: Vec<String>) -> Self {
        Self::Texts(texts)
    }
}

impl From<Tensor<3>> for Prompts {
    fn from(embeddings: Tensor<3>) -> Self {
        Self::Embeddings(embeddings)
    }
}

/// An image to start from.
#[derive(Debug, Clone)]
pub enum StartImage {
    /// Pixels in [0, 1], `[1 or images, channels, rows, columns]`.
    Pixels(Tensor<4>),
    /// Latents of the diffusion model, `[1 or images, latent_channels, rows, columns]`.
    Latents(Tensor<4>),
}

/// Options of a run: prompts, guidance, seeds, start image.
///
/// ```
/// use wake_ldm::pipeline::Request;
///
/// let request = Request::new("a ship and its Kelvin wake").with_steps(20).with_seed(7);
/// ```
#[derive(Debug, Clone)]
pub struct Request {
    pub(super) prompts: Prompts,
    pub(super) negative: Prompts,
    pub(super) guidance: f64,
    pub(super) guidance_rescale: f64,
    pub(super) steps: usize,
    pub(super) scheduler: Option<SchedulerConfig>,
    pub(super) size: Option<[usize; 2]>,
    pub(super) count: usize,
    pub(super) seeds: Seeds,
    pub(super) start: Option<(StartImage, f64)>,
    pub(super) latents: Option<Tensor<4>>,
    pub(super) step_noise: Option<Tensor<5>>,
    pub(super) condition: Option<Tensor<2>>,
    pub(super) images_at_once: usize,
}

/// Seeds of the noise of the images.
#[derive(Debug, Clone)]
pub(super) enum Seeds {
    /// Image k has this seed plus k.
    From(u64),
    /// One seed per image.
    Each(Vec<u64>),
}

impl Request {
    /// Makes a request with default settings: guidance 7.5, 50 steps, one image per prompt, seeds 0, 1, ….
    pub fn new(prompts: impl Into<Prompts>) -> Self {
        Self {
            prompts: prompts.into(),
            negative: "".into(),
            guidance: 7.5,
            guidance_rescale: 0.0,
            steps: 50,
            scheduler: None,
            size: None,
            count: 1,
            seeds: Seeds::From(0),
            start: None,
            latents: None,
            step_noise: None,
            condition: None,
            images_at_once: 1,
        }
    }

    /// Sets the negative prompts: one for all prompts, or one for each. Default: the empty text.
    pub fn with_negative(mut self, negative: impl Into<Prompts>) -> Self {
        self.negative = negative.into();
        self
    }

    /// Sets the guidance scale, g in
    ///
    /// ```text
    /// ε = ε(negative) + g (ε(prompt) − ε(negative))
    /// ```
    ///
    /// in [0, 1000]. At 1 and below there is no guidance, as in diffusers: only the prompt's half is computed.
    ///
    /// # References
    ///
    /// Ho & Salimans (2022), "Classifier-Free Diffusion Guidance", Eq. 6, with g = 1 + w.
    pub fn with_guidance(mut self, guidance: f64) -> Self {
        self.guidance = guidance;
        self
    }

    /// Sets the guidance rescale in [0, 1]: the share by which the contrast of the prediction is reset to that without guidance.
    ///
    /// # References
    ///
    /// Lin et al. (2024), "Common Diffusion Noise Schedules and Sample Steps are Flawed", Eqs. 15
    /// and 16.
    pub fn with_guidance_rescale(mut self, rescale: f64) -> Self {
        self.guidance_rescale = rescale;
        self
    }

    /// Sets the number of steps of the scheduler.
    pub fn with_steps(mut self, steps: usize) -> Self {
        self.steps = steps;
        self
    }

    /// Uses another scheduler than the pipeline's.
    pub fn with_scheduler(mut self, scheduler: SchedulerConfig) -> Self {
        self.scheduler = Some(scheduler);
        self
    }

    /// Sets the rows and columns of the images, multiples of the autoencoder's downsampling. Default: the
    /// size that the U-Net was trained for.
    pub fn with_size(mut self, rows: usize, columns: usize) -> Self {
        self.size = Some([rows, columns]);
        self
    }

    /// Sets the number of images per prompt. All images of the first prompt come first.
    pub fn with_count(mut self, count: usize) -> Self {
        self.count = count;
        self
    }

    /// Gives image k this seed plus k.
    pub fn with_seed(mut self, seed: u64) -> Self {
        self.seeds = Seeds::From(seed);
        self
    }

    /// Gives every image a seed of its own.
    pub fn with_seeds(mut self, seeds: Vec<u64>) -> Self {
        self.seeds = Seeds::Each(seeds);
        self
    }

    /// Starts from an image, of which `strength` in (0, 1] is replaced: only that share of the steps is
    /// taken.
    ///
    /// # References
    ///
    /// Meng et al. (2022), "SDEdit: Guided Image Synthesis and Editing with Stochastic Differential
    /// Equations", algorithm 1.
    pub fn with_start(mut self, image: StartImage, strength: f64) -> Self {
        self.start = Some((image, strength));
        self
    }

    /// Starts from this standard normal noise, `[images, latent_channels, rows, columns]`, instead of noise from the seeds.
    pub fn with_latents(mut self, latents: Tensor<4>) -> Self {
        self.latents = Some(latents);
        self
    }

    /// Uses this noise for step i, `[steps, images, latent_channels, rows, columns]`, instead of noise from the seeds.
    pub fn with_step_noise(mut self, noise: Tensor<5>) -> Self {
        self.step_noise = Some(noise);
        self
    }

    /// Conditions the U-Net on numbers in addition to the prompt, `[images, condition_channels]`. Both
    /// halves of a guided run get them, so guidance acts on the words only.
    pub fn with_condition(mut self, condition: Tensor<2>) -> Self {
        self.condition = Some(condition);
        self
    }

    /// Sets the number of images per pass of the U-Net. With 1, the default, an image does not depend on the
    /// others to the last bit; GPUs need more.
    pub fn with_images_at_once(mut self, images: usize) -> Self {
        self.images_at_once = images;
        self
    }

    /// Number of images.
    pub fn images(&self) -> usize {
        self.prompts.len() * self.count
    }

    /// Whether the negative prompt's half is computed.
    pub(super) fn guided(&self) -> bool {
        self.guidance > 1.0
    }

    /// Checks everything that does not depend on the models.
    pub(super) fn validate(&self) -> Result<()> {
        check_range("guidance", self.guidance, 0.0, 1000.0)?;
        check_range("guidance_rescale", self.guidance_rescale, 0.0, 1.0)?;
        check_range("number of prompts", self.prompts.len() as f64, 1.0, 65536.0)?;
        check_range("count", self.count as f64, 1.0, 65536.0)?;
        check_range("images_at_once", self.images_at_once as f64, 1.0, 65536.0)?;
        if let Some((_, strength)) = self.start {
            check_range("strength", strength, 1.0 / self.steps.max(1) as f64, 1.0)?;
        }
        let negative = self.negative.len();
        if negative != 1 && negative != self.prompts.len() {
            let expected = format!("1 or {}, one per prompt", self.prompts.len());
            return Err(invalid("number of negative prompts", negative, expected));
        }
        match &self.seeds {
            Seeds::Each(seeds) if seeds.len() != self.images() => {
                let expected = format!("{}, one per image", self.images());
                Err(invalid("number of seeds", seeds.len(), expected))
            }
            _ => Ok(()),
        }
    }

    /// Noise source of each image.
    pub(super) fn sources(&self) -> Vec<NoiseSource> {
        (0..self.images())
            .map(|k| match &self.seeds {
                Seeds::From(seed) => NoiseSource::new(seed.wrapping_add(k as u64)),
                Seeds::Each(seeds) => NoiseSource::new(seeds[k]),
            })
            .collect()
    }
}

/// Returns the error for an option that conflicts with others.
pub(super) fn invalid(
    option: &str,
    value: impl std::fmt::Display,
    expected: impl Into<String>,
) -> Error {
    Error::Model(wake_nn::Error::InvalidOption {
        option: option.to_owned(),
        value: value.to_string(),
        expected: expected.into(),
    })
}
