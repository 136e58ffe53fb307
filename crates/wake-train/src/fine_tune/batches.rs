//! Pairs of a data set as inputs of a latent diffusion model.

use crate::error::Result;
use crate::streams;
use wake_dataset::{Folder, Grey, Pair};
use wake_ldm::pipeline::token_ids;
use wake_nn::noise::NoiseSource;
use wake_text::Tokenizer;

/// Share of the images whose prompt is left out, for guidance.
const WITHOUT_PROMPT: f64 = 0.1;

/// Whether the model is conditioned on the prompt of the image at a position of a run.
///
/// - `stream`: stream of the random numbers
pub(crate) fn is_told(random: NoiseSource, stream: u32, position: u64) -> bool {
    random.uniform(stream, position) >= WITHOUT_PROMPT
}

/// Image with its tokenized prompt.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Prompted {
    /// The image, 0 to 1.
    pub image: Grey,
    /// Token ids of the prompt, including marks and padding.
    pub ids: Vec<i32>,
}

/// Source of images with prompts, a function of the position alone.
pub(crate) trait PromptedSource: Sync {
    /// Image and prompt at a position of a run; all have one size and one number of tokens.
    ///
    /// # Errors
    ///
    /// Errors of reading the data.
    fn at(&self, position: u64) -> Result<Prompted>;
}

/// Pairs of a folder's `trainset.txt`, drawn at random with equal probability, a tenth of them without their prompts.
///
/// # References
///
/// Ho & Salimans (2021), "Classifier-Free Diffusion Guidance", algorithm 1 (prompts left out).
#[derive(Debug)]
pub(crate) struct PromptedPairs<'a> {
    data: &'a Folder,
    positions: Vec<u64>,
    tokenizer: Option<&'a Tokenizer>,
    seed: u64,
}

impl<'a> PromptedPairs<'a> {
    /// Pairs of a folder; a tokenizer of `None` is CLIP's own.
    #[must_use]
    pub(crate) fn new(data: &'a Folder, tokenizer: Option<&'a Tokenizer>, seed: u64) -> Self {
        Self {
            data,
            positions: data.trainset(),
            tokenizer,
            seed,
        }
    }

    /// Number of pairs that are drawn from.
    #[must_use]
    pub(crate) fn len(&self) -> usize {
        self.positions.len()
    }
}

impl PromptedSource for PromptedPairs<'_> {
    fn at(&self, position: u64) -> Result<Prompted> {
        let random = NoiseSource::new(self.seed);
        let draw = random.uniform(streams::PAIRS, position);
        let number = self.positions[(draw * self.len() as f64) as usize];
        let Pair { image, prompt, .. } = self.data.pair(number)?;
        let told = is_told(random, streams::UNTOLD, position);
        let ids = token_ids(self.tokenizer, if told { &prompt } else { "" });
        Ok(Prompted { image, ids })
    }
}
