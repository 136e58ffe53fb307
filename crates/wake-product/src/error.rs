//! What can go wrong.

use std::path::PathBuf;

/// Result of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// What can go wrong when a product is simulated.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The template, or a file that is written.
    #[error(transparent)]
    Product(#[from] wake_geo::Error),
    /// A value of a scene.
    #[error(transparent)]
    Scene(#[from] wake_physics::Error),
    /// A file of ships.
    #[error("{}: {why}", path.display())]
    Ships {
        /// The file.
        path: PathBuf,
        /// What is wrong with it, and what is expected.
        why: String,
    },
    /// A product that cannot be a template.
    #[error("{} cannot be simulated: {why}", path.display())]
    Template {
        /// The product.
        path: PathBuf,
        /// Why, and what can be.
        why: String,
    },
    /// A file that cannot be read or written.
    #[error(transparent)]
    File(#[from] whole_files::Error),
}
