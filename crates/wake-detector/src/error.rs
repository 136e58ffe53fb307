//! The error type of this crate.

use std::path::PathBuf;

/// Longest side of an image \[pixels\].
pub(crate) const LONGEST_SIDE: usize = 20_000;
/// Largest size of a file \[bytes\].
pub(crate) const LONGEST_FILE: u64 = 2_000_000_000;
/// Largest memory for reading an image \[bytes\]: 20,000 × 20,000 pixels of 16 bits, and as much again.
pub(crate) const MOST_MEMORY: u64 = 1_800_000_000;
/// Largest memory for text, colour profile and other metadata of an image \[bytes\].
pub(crate) const MOST_NOTES: u64 = 64 << 20;

/// Result of a fallible function of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// An image that could not be read, or a network that could not be loaded.
#[non_exhaustive]
#[expect(missing_docs, reason = "the message names every field")]
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file or folder that cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Io {
        path: PathBuf,
        source: std::io::Error,
    },

    /// A folder without images.
    #[error("{} holds no PNG, JPEG or TIFF file; name another folder", folder.display())]
    NoImages { folder: PathBuf },

    /// Two images with the same name, whose results could not be distinguished.
    #[error(
        "two images have the name '{}', so their results could not be told apart; search them separately",
        whole_files::quoted(name)
    )]
    SameName { name: String },

    /// A file that is not a readable image.
    #[error(
        "{} cannot be read as an image ({why}); give a PNG, JPEG or TIFF file of 8 or 16 bits",
        path.display()
    )]
    Unreadable { path: PathBuf, why: String },

    /// A file that is too long.
    #[error("{} has {bytes} bytes, above the limit of {LONGEST_FILE}; cut it into pieces", path.display())]
    FileTooLong { path: PathBuf, bytes: u64 },

    /// An image with too many pixels per side, or none.
    #[error(
        "{} has {columns} x {rows} pixels, outside 1 to {LONGEST_SIDE} per side; cut it into pieces",
        path.display()
    )]
    TooLarge {
        path: PathBuf,
        columns: u32,
        rows: u32,
    },

    /// An image that needs too much memory to read.
    #[error(
        "{} needs {bytes} bytes of memory, above the limit of {MOST_MEMORY}; convert it to grey of 8 or 16 bits",
        path.display()
    )]
    TooMuchMemory { path: PathBuf, bytes: u64 },

    /// Levels that do not fill an image of the stated size.
    #[error(
        "an image of {rows} x {columns} pixels has {levels} levels; give one level per pixel, and at least one"
    )]
    WrongSize {
        rows: usize,
        columns: usize,
        levels: usize,
    },

    /// Weights that give unusable maps for an image with one obvious wake.
    #[error(
        "the weights in {} on {device} give maps that are {why} for an image with one obvious wake; \
         use weights written by `wake train detector`, or the shipped weights",
        path.display()
    )]
    WrongMaps {
        path: PathBuf,
        device: String,
        why: &'static str,
    },

    /// A file that is not a calibration, or is the calibration of other weights.
    #[error("the calibration {} cannot be used: {why}", path.display())]
    Calibration { path: PathBuf, why: String },

    /// A text file that cannot be read.
    #[error(transparent)]
    File(#[from] whole_files::Error),

    /// An error of weights or devices.
    #[error(transparent)]
    Model(#[from] wake_nn::Error),
}
