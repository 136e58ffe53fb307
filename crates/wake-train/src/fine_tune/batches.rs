//! Pairs of a data set, as a latent diffusion model takes them.

use crate::error::Result;
use crate::streams;
use wake_dataset::{Folder, Grey, Pair};
use wake_ldm::pipeline::token_ids;
use wake_nn::noise::NoiseSource;
use wake_text::Tokenizer;

/// Part of the pairs whose prompt is left out, for guidance.
pub(crate) const WITHOUT_PROMPT: f64 = 0.1;

/// An image beside its prompt in tokens.
#[derive(Debug, Clone, PartialEq)]
pub struct Prompted {
    /// The image, 0 to 1.
    pub image: Grey,
    /// Ids of the prompt, marks and padding included.
    pub ids: Vec<i32>,
}

/// Where prompted images come from: a function of the position alone.
pub trait PromptedSource: Sync {
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
pub struct PromptedPairs<'a> {
    data: &'a Folder,
    positions: Vec<u64>,
    tokenizer: Option<&'a Tokenizer>,
    seed: u64,
}

impl<'a> PromptedPairs<'a> {
    /// Those of a folder; a tokenizer of `None` is CLIP's own.
    #[must_use]
    pub fn new(data: &'a Folder, tokenizer: Option<&'a Tokenizer>, seed: u64) -> Self {
        Self {
            data,
            positions: data.trainset(),
            tokenizer,
            seed,
        }
    }

    /// Number of pairs that are drawn from.
    #[must_use]
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }
}

impl PromptedSource for PromptedPairs<'_> {
    fn at(&self, position: u64) -> Result<Prompted> {
        let random = NoiseSource::new(self.seed);
        let draw = random.uniform(streams::PAIRS, position);
        let number = self.positions[(draw * self.len() as f64) as usize];
        let Pair { image, prompt, .. } = self.data.pair(number)?;
        let told = random.uniform(streams::UNTOLD, position) >= WITHOUT_PROMPT;
        let ids = token_ids(self.tokenizer, if told { &prompt } else { "" });
        Ok(Prompted { image, ids })
    }
}
