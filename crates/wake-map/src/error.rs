//! The error type of this crate.

use std::path::PathBuf;

/// Result of a fallible function of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// A product could not be searched.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The product cannot be read.
    #[error(transparent)]
    Product(#[from] wake_geo::Error),
    /// A file of the search cannot be read or written.
    #[error(transparent)]
    File(#[from] whole_files::Error),
    /// The progress file belongs to a search with other inputs.
    #[error("{} belongs to another search ({what}); remove it to start over", path.display())]
    OtherSearch {
        /// The progress file.
        path: PathBuf,
        /// The difference.
        what: String,
    },
}
