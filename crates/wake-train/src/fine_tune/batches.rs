//! Pairs of a data set, as a latent diffusion model takes them.

use crate::error::Result;
use crate::streams;
use wake_dataset::{Folder, Grey, Pair};
use wake_ldm::pipeline::token_ids;
use wake_nn::noise::NoiseSource;
use wake_text::Tokenizer;

/// Part of the images whose prompt is left out, for guidance.
const WITHOUT_PROMPT: f64 = 0.1;

/// Whether the prompt of the image at a position of a run is told to the model.
///
/// - `stream`: of the random numbers that decide
pub(crate) fn is_told(random: NoiseSource, stream: u32, position: u64) -> bool {
    random.uniform(stream, position) >= WITHOUT_PROMPT
}

/// An image beside its prompt in tokens.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Prompted {
    /// The image, 0 to 1.
    pub image: Grey,
    /// Ids of the prompt, marks and padding included.
    pub ids: Vec<i32>,
}

/// Where prompted images come from: a function of the position alone.
pub(crate) trait PromptedSource: Sync {
    /// The one at a position of a run; all have one size and one number of tokens.
    ///
    /// # Errors
    ///
    /// Those of what it reads.
    fn at(&self, position: u64) -> Result<Prompted>;
}

/// Pairs of a folder's `trainset.txt`, drawn with a seed, each as likely as every other, a tenth of them without their prompts.
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
    /// Those of a folder; a tokenizer of `None` is CLIP's own.
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
