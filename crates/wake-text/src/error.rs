//! What can go wrong, by whose fault it is.

use std::path::PathBuf;

/// Why a prompt could not be written or read, or a vocabulary not be loaded.
#[non_exhaustive]
#[expect(missing_docs, reason = "the message names every field")]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// The scene is not valid, so there is no prompt for it.
    #[error(transparent)]
    Scene(#[from] wake_physics::Error),
    /// A prompt states a value that no scene can have.
    #[error("the prompt says '{words}', but {source}")]
    Impossible {
        words: String,
        source: wake_physics::Error,
    },
    /// A prompt says two things that cannot both hold.
    #[error("the prompt contradicts itself: '{first}' and '{second}'; keep one of them")]
    Contradiction { first: String, second: String },
    /// A file could not be read.
    #[error("cannot read {}: {message}", path.display())]
    File { path: PathBuf, message: String },
    /// A file could not be written.
    #[error("cannot write {}: {message}", path.display())]
    Write { path: PathBuf, message: String },
    /// A vocabulary file is broken.
    #[error("{}, line {line}, column {column}: {message}", path.display())]
    Vocabulary {
        path: PathBuf,
        line: usize,
        column: usize,
        message: String,
    },
    /// A folder holds no vocabulary.
    #[error(
        "there is no vocabulary in {}; it needs vocab.json and merges.txt, or tokenizer.json",
        path.display()
    )]
    NoVocabulary { path: PathBuf },
}

/// Result of this crate's fallible functions.
pub type Result<T> = std::result::Result<T, Error>;
