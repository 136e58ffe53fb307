//! Errors of this crate.

use std::path::PathBuf;
use whole_files::{quoted, sentence};

/// Why a prompt could not be written or read, or a vocabulary not be loaded.
#[non_exhaustive]
#[expect(missing_docs, reason = "the message names every field")]
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// The scene is invalid, so it has no prompt.
    #[cfg(feature = "scene")]
    #[error(transparent)]
    Scene(#[from] wake_physics::Error),
    /// A prompt states a value that no scene can have.
    #[cfg(feature = "scene")]
    #[error("the prompt says '{}', but {source}", quoted(words))]
    Impossible {
        words: String,
        source: wake_physics::Error,
    },
    /// A prompt says two things that cannot both hold.
    #[error(
        "the prompt contradicts itself: '{}' and '{}'; keep one of them",
        quoted(first),
        quoted(second)
    )]
    Contradiction { first: String, second: String },
    /// A file could not be read.
    #[error("cannot read {}: {}", path.display(), sentence(message))]
    File { path: PathBuf, message: String },
    /// A file could not be written.
    #[error("cannot write {}: {}", path.display(), sentence(message))]
    Write { path: PathBuf, message: String },
    /// A vocabulary file is broken.
    #[error("{}, line {line}, column {column}: {}", path.display(), sentence(message))]
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

#[cfg(all(test, feature = "scene"))]
mod tests {
    use super::*;

    /// Untrusted text reaches a terminal as one short line without control characters.
    #[test]
    fn foreign_text_is_escaped_and_cut() {
        let foreign = format!("\u{1b}[31m\0\u{7}\n{}", "x".repeat(100_000));
        let path = PathBuf::from("vocab.json");
        let scene = wake_physics::Scene::default().with_assignments(&["sea.wind_speed=-1"]);
        let errors = [
            Error::Impossible {
                words: foreign.clone(),
                source: scene.unwrap_err(),
            },
            Error::Contradiction {
                first: foreign.clone(),
                second: foreign.clone(),
            },
            Error::File {
                path: path.clone(),
                message: foreign.clone(),
            },
            Error::Write {
                path: path.clone(),
                message: foreign.clone(),
            },
            Error::Vocabulary {
                path,
                line: 1,
                column: 2,
                message: foreign,
            },
        ];
        for error in errors {
            let text = error.to_string();
            assert!(!text.chars().any(char::is_control), "{text}");
            assert!(text.len() < 1000, "{}", text.len());
        }
    }
}
