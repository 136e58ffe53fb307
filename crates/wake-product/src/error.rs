//! The error type of this crate.

use std::path::PathBuf;

/// Result of a fallible function of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// A product could not be simulated, or a ship in it not estimated.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The product cannot be read or written.
    #[error(transparent)]
    Product(#[from] wake_geo::Error),
    /// A scene is invalid or could not be simulated.
    #[error(transparent)]
    Scene(#[from] wake_physics::Error),
    /// A file of ships is invalid.
    #[error("{}: {why}", path.display())]
    Ships {
        /// The file.
        path: PathBuf,
        /// The fault, and the expected content.
        why: String,
    },
    /// A product that cannot be used.
    #[error("cannot use {}: {why}", path.display())]
    Template {
        /// The product.
        path: PathBuf,
        /// The reason, and what is supported.
        why: String,
    },
    /// A file that cannot be read or written.
    #[error(transparent)]
    File(#[from] whole_files::Error),
}
