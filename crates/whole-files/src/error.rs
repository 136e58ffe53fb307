//! The error type of this crate.

use std::path::{Path, PathBuf};

/// A file or folder that could not be read or written.
#[derive(Debug, thiserror::Error)]
#[error("cannot {action} {}: {source}", path.display())]
pub struct Error {
    /// Attempted action, such as "write".
    pub action: &'static str,
    /// File or folder.
    pub path: PathBuf,
    /// Error of the operating system.
    pub source: std::io::Error,
}

/// Result of a fallible function of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// Makes the error of an action on a file or folder.
pub fn failed(action: &'static str, path: &Path, source: impl Into<std::io::Error>) -> Error {
    Error {
        action,
        path: path.to_owned(),
        source: source.into(),
    }
}
