//! What can go wrong.

use std::path::PathBuf;

/// Result of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// What can go wrong when a product is searched.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The product.
    #[error(transparent)]
    Product(#[from] wake_geo::Error),
    /// A file of the search.
    #[error(transparent)]
    File(#[from] whole_files::Error),
    /// A search that was begun with something else.
    #[error("{} is of another search ({what}); remove it to begin again", path.display())]
    OtherSearch {
        /// The file that notes how far a search is.
        path: PathBuf,
        /// What differs.
        what: String,
    },
}
