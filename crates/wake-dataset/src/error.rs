//! The error type of this crate.

use std::path::PathBuf;
use whole_files::sentence;

/// Result of a fallible function of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// A data set that could not be described, made, written or read.
#[non_exhaustive]
#[expect(missing_docs, reason = "the message names every field")]
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The recipe of a data set cannot be parsed, or its values cannot be combined.
    #[error("cannot read the recipe: {}", sentence(message))]
    Recipe { message: String },

    /// A folder is not a data set, is damaged, or is another data set; line 0 stands for the whole file or folder.
    #[error("{}{}: {}", path.display(), if *line > 0 { format!(", line {line}") } else { String::new() }, sentence(message))]
    Dataset {
        path: PathBuf,
        line: usize,
        message: String,
    },

    /// A thread could not be started.
    #[error("cannot start a thread: {source}; use fewer threads")]
    Threads { source: std::io::Error },

    /// A value outside its range, an option of the wrong kind, or a file that cannot be read or written.
    #[error(transparent)]
    Value(#[from] wake_nn::Error),

    /// A scene is invalid or could not be simulated.
    #[error(transparent)]
    Scene(#[from] wake_physics::Error),

    /// A prompt could not be written.
    #[error(transparent)]
    Text(#[from] wake_text::Error),

    /// A source of images outside this crate, or the JPEG codec, failed.
    #[error(transparent)]
    Source(Box<dyn std::error::Error + Send + Sync>),
}

impl From<whole_files::Error> for Error {
    fn from(error: whole_files::Error) -> Self {
        Self::Value(error.into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Untrusted text reaches the terminal shortened and without control characters.
    #[test]
    fn foreign_text_is_escaped_and_cut() {
        let foreign = format!("\u{1b}[31m\0\u{7}\n{}", "x".repeat(100_000));
        let errors = [
            Error::Recipe {
                message: foreign.clone(),
            },
            Error::Dataset {
                path: PathBuf::from("metadata.jsonl"),
                line: 3,
                message: foreign,
            },
        ];
        for error in errors {
            let text = error.to_string();
            assert!(!text.chars().any(char::is_control), "{text}");
            assert!(text.len() < 5000, "{}: {}", text.len(), &text[..200]);
        }
    }
}
