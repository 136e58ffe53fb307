//! The byte-pair vocabulary: the crate's own, or one from files.
//!
//! CLIP's vocabulary follows from its merges alone: the symbols of the 256 bytes; the same with the mark
//! `</w>` of a word's end; what the 48,894 merges make, in their order; start mark; end mark. So the crate
//! holds only the merges (`assets/clip_merges.txt.gz`, from OpenAI's CLIP, MIT licence beside it).

use crate::error::{Error, Result};
use crate::vocabulary_files::{parse_merges, parse_pad, parse_tokenizer, parse_vocab, read};
use rayon::prelude::*;
use std::borrow::Cow;
use std::io::Read;
use std::path::Path;
use tokenizers::Model;
use tokenizers::models::bpe::{BPE, Merges, Vocab};

/// Marks the start of every prompt.
pub(crate) const START_MARK: &str = "<|startoftext|>";
/// Marks the end of every prompt.
pub(crate) const END_MARK: &str = "<|endoftext|>";
/// Marks the last symbol of a word.
const WORD_END: &str = "</w>";

/// Words of several tokens that each thread remembers.
const CACHED_WORDS: usize = 10_000;

const CLIP_MERGES: &[u8] = include_bytes!("../assets/clip_merges.txt.gz");

/// The merges and the ids of the tokens they make.
#[derive(Debug)]
pub(crate) struct Vocabulary {
    bpe: BPE,
    /// The words that end up as one token, as symbols: most words of a prompt, found without merging.
    whole_words: Vocab,
    pub(crate) start: u32,
    pub(crate) end: u32,
    pub(crate) pad: u32,
}

impl Vocabulary {
    /// CLIP's vocabulary, unpacked from the crate.
    pub(crate) fn embedded() -> Result<Self> {
        let path = Path::new("clip_merges.txt");
        let merges = parse_merges(path, &embedded_merges()?, None)?;
        Self::build(path, clip_vocab(&merges), merges)
    }

    pub(crate) fn from_files(vocab_path: &Path, merges_path: &Path) -> Result<Self> {
        let vocab = parse_vocab(vocab_path, &read(vocab_path)?)?;
        let merges = parse_merges(merges_path, &read(merges_path)?, Some(&vocab))?;
        Self::build(vocab_path, vocab, merges).map(Self::checked)
    }

    pub(crate) fn from_tokenizer_json(path: &Path) -> Result<Self> {
        let (vocab, merges) = parse_tokenizer(path, &read(path)?)?;
        Self::build(path, vocab, merges).map(Self::checked)
    }

    pub(crate) fn from_folder(folder: &Path) -> Result<Self> {
        let inner = folder.join("tokenizer");
        let folder = if inner.is_dir() { &inner } else { folder };
        let [vocab, merges, whole, special] = [
            "vocab.json",
            "merges.txt",
            "tokenizer.json",
            "special_tokens_map.json",
        ]
        .map(|name| folder.join(name));
        let mut vocabulary = if vocab.is_file() && merges.is_file() {
            Self::from_files(&vocab, &merges)?
        } else if whole.is_file() {
            Self::from_tokenizer_json(&whole)?
        } else {
            return Err(Error::NoVocabulary {
                path: folder.to_owned(),
            });
        };
        if special.is_file()
            && let Some(pad) = parse_pad(&special, &read(&special)?)?
        {
            vocabulary.pad = id(&vocabulary.bpe, &special, &pad)?;
        }
        Ok(vocabulary)
    }

    fn build(path: &Path, vocab: Vocab, merges: Merges) -> Result<Self> {
        let whole_words = word_ends(&vocab);
        let bpe = BPE::builder()
            .vocab_and_merges(vocab, merges)
            .unk_token(END_MARK.to_owned())
            .end_of_word_suffix(WORD_END.to_owned())
            .build()
            .map_err(|e| Error::File {
                path: path.to_owned(),
                message: e.to_string(),
            })?;
        let [start, end] = [START_MARK, END_MARK].map(|mark| id(&bpe, path, mark));
        let end = end?;
        Ok(Self {
            bpe,
            whole_words,
            start: start?,
            end,
            pad: end,
        })
    }

    /// Keeps only those whole words that the merges do make: in CLIP's vocabulary all, in another perhaps not.
    fn checked(mut self) -> Self {
        self.bpe.resize_cache(0); // its places are for words of several tokens
        let words: Vec<_> = self.whole_words.into_iter().collect();
        let bpe = &self.bpe;
        let is_made = |(word, id): &(String, u32)| match bpe.tokenize(word).as_deref() {
            Ok([token]) => token.id == *id,
            _ => false,
        };
        let made: Vec<_> = words.into_par_iter().filter(is_made).collect();
        self.whole_words = made.into_iter().collect();
        self.bpe.resize_cache(CACHED_WORDS);
        self
    }

    /// The tokens of a word spelt in symbols: id, and first byte in the symbols.
    pub(crate) fn for_tokens(&self, word: &str, mut each: impl FnMut(u32, usize)) {
        if let Some(&id) = self.whole_words.get(word) {
            return each(id, 0);
        }
        // Cannot fail: an unknown symbol becomes the end mark, which is in every vocabulary.
        for token in self.bpe.tokenize(word).unwrap_or_default() {
            each(token.id, token.offsets.0);
        }
    }
}

/// The id of a token that must be there.
fn id(bpe: &BPE, path: &Path, token: &str) -> Result<u32> {
    bpe.token_to_id(token).ok_or_else(|| Error::File {
        path: path.to_owned(),
        message: format!("the vocabulary has no token '{token}'"),
    })
}

/// The tokens that end a word, without the mark, and their ids.
fn word_ends(vocab: &Vocab) -> Vocab {
    let ends = vocab
        .iter()
        .filter_map(|(token, &id)| Some((token.strip_suffix(WORD_END)?, id)));
    ends.map(|(word, id)| (word.to_owned(), id)).collect()
}

fn embedded_merges() -> Result<String> {
    let mut text = String::new();
    flate2::read::GzDecoder::new(CLIP_MERGES)
        .read_to_string(&mut text)
        .map_err(|e| Error::File {
            path: "clip_merges.txt.gz".into(),
            message: e.to_string(),
        })?;
    Ok(text)
}

/// CLIP's tokens in the order of their ids.
fn clip_vocab(merges: &Merges) -> Vocab {
    let symbols: Vec<String> = bytes_in_order()
        .map(|byte| byte_symbol(byte).to_string())
        .collect();
    let word_ends = symbols.iter().map(|symbol| format!("{symbol}{WORD_END}"));
    let merged = merges.iter().map(|(left, right)| format!("{left}{right}"));
    let marks = [START_MARK, END_MARK].map(str::to_owned);
    let tokens = symbols.iter().cloned().chain(word_ends).chain(merged);
    tokens.chain(marks).zip(0..).collect()
}

/// Bytes with a printable character of their own in Latin-1, then the others.
fn bytes_in_order() -> impl Iterator<Item = u8> {
    let has_own = |byte: &u8| has_own_symbol(*byte);
    let own = (0..=u8::MAX).filter(has_own);
    own.chain((0..=u8::MAX).filter(move |byte| !has_own(byte)))
}

fn has_own_symbol(byte: u8) -> bool {
    matches!(byte, b'!'..=b'~' | 0xA1..=0xAC | 0xAE..=0xFF)
}

/// The character that stands for a byte in the vocabulary: its own in Latin-1 where that is printable,
/// else one from U+0100 on.
fn byte_symbol(byte: u8) -> char {
    if has_own_symbol(byte) {
        return char::from(byte);
    }
    // The 68 others are 0 to 32, 127 to 160 and 173, in that order.
    let rank = match byte {
        0..=32 => u32::from(byte),
        127..=160 => u32::from(byte) - 127 + 33,
        _ => 67,
    };
    char::from_u32(256 + rank).unwrap_or(char::REPLACEMENT_CHARACTER)
}

/// A word as the vocabulary spells it: one symbol for each byte.
pub(crate) fn to_symbols(word: &str) -> Cow<'_, str> {
    if word.bytes().all(|byte| byte.is_ascii_graphic()) {
        Cow::Borrowed(word)
    } else {
        word.bytes().map(byte_symbol).collect()
    }
}
