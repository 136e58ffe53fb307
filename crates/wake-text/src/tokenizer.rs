//! Prompt → 77 token ids.

use crate::cleaning::{Cleaned, clean};
use crate::error::Result;
use crate::vocabulary::{END_MARK, START_MARK, Vocabulary, to_symbols};
use crate::words::for_words;
use rayon::prelude::*;
use std::path::Path;
use std::sync::LazyLock;

/// Number of tokens the text encoder of CLIP takes, start and end mark included.
pub const TOKENS: usize = 77;

/// A prompt as the text encoder takes it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Tokens {
    /// Start mark, words, end mark, padding.
    pub ids: [u32; TOKENS],
    /// `true` up to the end mark, `false` on the padding.
    pub mask: [bool; TOKENS],
    /// Number of tokens before truncation, both marks included.
    pub token_count: usize,
    /// Byte offset in the prompt of the first character that was cut off, always a character boundary.
    pub truncated_at: Option<usize>,
}

impl Tokens {
    /// Whether a part of the prompt was cut off.
    pub fn truncated(&self) -> bool {
        self.truncated_at.is_some()
    }
}

/// CLIP's tokenizer: cleans, splits into words and merges byte pairs.
///
/// Built once, shared by all threads: nothing in it changes.
///
/// # Examples
///
/// ```
/// let tokens = wake_text::Tokenizer::clip().encode("a photo of a cat");
/// assert_eq!(tokens.ids[..8], [49406, 320, 1125, 539, 320, 2368, 49407, 49407]);
/// assert_eq!(tokens.token_count, 7);
/// ```
///
/// # References
///
/// Radford et al. (2021), Learning Transferable Visual Models From Natural Language Supervision, section
/// 2.4; Sennrich et al. (2016), Neural Machine Translation of Rare Words with Subword Units, algorithm 1.
#[derive(Debug)]
pub struct Tokenizer {
    vocabulary: Vocabulary,
}

impl Tokenizer {
    /// The tokenizer of Stable Diffusion v1: CLIP's vocabulary of 49,408 tokens, padded with the end mark.
    ///
    /// The vocabulary lies in the crate; the first call in a process unpacks it.
    pub fn clip() -> &'static Self {
        static CLIP: LazyLock<Tokenizer> = LazyLock::new(|| {
            Tokenizer::new(Vocabulary::embedded().expect("the crate's own vocabulary is whole"))
        });
        &CLIP
    }

    /// A tokenizer with the vocabulary of a folder, such as that of a Stable Diffusion model or its
    /// subfolder `tokenizer`.
    ///
    /// It reads `vocab.json` and `merges.txt`, else `tokenizer.json`; and, where there is a
    /// `special_tokens_map.json`, its padding token.
    ///
    /// # Errors
    ///
    /// [`Error::NoVocabulary`](crate::Error::NoVocabulary) if none of these files is there, else as
    /// [`Tokenizer::from_files`].
    pub fn from_folder(folder: &Path) -> Result<Self> {
        Vocabulary::from_folder(folder).map(Self::new)
    }

    /// A tokenizer with another vocabulary, from `vocab.json` and `merges.txt`.
    ///
    /// # Errors
    ///
    /// [`Error::File`](crate::Error::File) if a file cannot be read,
    /// [`Error::Vocabulary`](crate::Error::Vocabulary) with the line where it is broken.
    pub fn from_files(vocab: &Path, merges: &Path) -> Result<Self> {
        Vocabulary::from_files(vocab, merges).map(Self::new)
    }

    /// A tokenizer with another vocabulary, from `tokenizer.json`.
    ///
    /// Only vocabulary and merges are taken from the file; cleaning and splitting are CLIP's.
    ///
    /// # Errors
    ///
    /// As [`Tokenizer::from_files`].
    pub fn from_tokenizer_json(path: &Path) -> Result<Self> {
        Vocabulary::from_tokenizer_json(path).map(Self::new)
    }

    fn new(vocabulary: Vocabulary) -> Self {
        Self {
            vocabulary,
        }
    }

    /// The tokens of a prompt; a longer one is cut, with the end mark kept last.
    ///
    /// The marks `<|startoftext|>` and `<|endoftext|>` within a prompt become their tokens, as in Stable
    /// Diffusion.
    pub fn encode(&self, prompt: &str) -> Tokens {
        let cleaned = clean(prompt);
        let mut row = Row::new(&self.vocabulary);
        let mut from = 0;
        for (at, _) in cleaned.text.match_indices("<|") {
            let marks = [
                (START_MARK, self.vocabulary.start),
                (END_MARK, self.vocabulary.end),
            ];
            let found = marks
                .iter()
                .find(|(mark, _)| cleaned.text[at..].starts_with(mark));
            if let Some((mark, id)) = found {
                self.push_words(&cleaned.text, from..at, &mut row);
                row.push(*id, || at);
                from = at + mark.len();
            }
        }
        self.push_words(&cleaned.text, from..cleaned.text.len(), &mut row);
        row.finish(&cleaned)
    }

    /// The tokens of many prompts, in their order, on all cores.
    pub fn encode_batch<S: AsRef<str> + Sync>(&self, prompts: &[S]) -> Vec<Tokens> {
        prompts
            .par_iter()
            .map(|prompt| self.encode(prompt.as_ref()))
            .collect()
    }

    fn push_words(&self, text: &str, range: std::ops::Range<usize>, row: &mut Row) {
        for_words(&text[range.clone()], |word| {
            let start = range.start + word.start;
            let word = &text[start..range.start + word.end];
            let symbols = to_symbols(word);
            self.vocabulary.for_tokens(&symbols, |id, at| {
                row.push(id, || start + symbols[..at].chars().count());
            });
        });
    }
}

/// The 77 ids while they are filled.
struct Row {
    ids: [u32; TOKENS],
    end: u32,
    /// Tokens so far, the ones cut off included.
    count: usize,
    /// Byte in the cleaned text where the first token without a place starts.
    cut: Option<usize>,
}

impl Row {
    fn new(vocabulary: &Vocabulary) -> Self {
        let mut ids = [vocabulary.pad; TOKENS];
        ids[0] = vocabulary.start;
        Self {
            ids,
            end: vocabulary.end,
            count: 1,
            cut: None,
        }
    }

    /// Appends a token that starts at byte `at` of the cleaned text.
    fn push(&mut self, id: u32, at: impl FnOnce() -> usize) {
        if self.count < TOKENS - 1 {
            self.ids[self.count] = id;
        } else if self.cut.is_none() {
            self.cut = Some(at());
        }
        self.count += 1;
    }

    fn finish(mut self, cleaned: &Cleaned) -> Tokens {
        let end = self.count.min(TOKENS - 1);
        self.ids[end] = self.end;
        Tokens {
            ids: self.ids,
            mask: std::array::from_fn(|i| i <= end),
            token_count: self.count + 1,
            truncated_at: self.cut.map(|at| cleaned.origin(at)),
        }
    }
}
