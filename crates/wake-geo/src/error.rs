//! Error type of this crate.

use std::path::{Path, PathBuf};

use whole_files::sentence;

/// Result of the fallible functions of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Reason why a product could not be opened, read or written, or a pixel could not be located.
#[non_exhaustive]
#[expect(missing_docs, reason = "the message names every field")]
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file or folder that cannot be read or written.
    #[error("cannot access {}: {source}", shown(path))]
    Io {
        path: PathBuf,
        source: std::io::Error,
    },

    /// A path of unknown format.
    #[error(
        "{} cannot be read as a product ({why}); give a Sentinel-1 GRD product (.SAFE folder or .zip) or a GeoTIFF, \
         PNG or JPEG file",
        shown(path)
    )]
    Unreadable { path: PathBuf, why: String },

    /// A file of the coast without usable polygons.
    #[error(
        "{} cannot be read as land ({why}); give a GeoJSON file with polygons of the land",
        shown(path)
    )]
    Land { path: PathBuf, why: String },

    /// A Sentinel-1 product of a type other than GRD.
    #[error(
        "{} is a Sentinel-1 product of type {found}, but only Level-1 GRD can be read; download the GRD product of the \
         same scene",
        shown(path)
    )]
    ProductType { path: PathBuf, found: String },

    /// A polarization that the product does not have.
    #[error("{} has no polarization {wanted}; choose one of {there}", shown(path))]
    Polarization {
        path: PathBuf,
        wanted: &'static str,
        there: String,
    },

    /// A required file that the product lacks.
    #[error(
        "{} has no file {name:?}; download the product again and unpack it whole",
        shown(path)
    )]
    Missing { path: PathBuf, name: String },

    /// Pixels of a product that has no measurement.
    #[error(
        "{} has annotation but no measurement, so its pixels cannot be read; download the product again and unpack it whole",
        shown(path)
    )]
    NoMeasurement { path: PathBuf },

    /// Content that cannot be right.
    #[error("{file:?}: {why}; the file is damaged: download or write it again")]
    Damaged { file: String, why: String },

    /// A value above a limit of this crate.
    #[error("{file:?}: {what} is {value}, above the limit {limit}; {remedy}")]
    TooLarge {
        file: String,
        what: &'static str,
        value: u64,
        limit: u64,
        remedy: &'static str,
    },

    /// A TIFF file with a feature that this crate does not read.
    #[error("{file:?}: {what} is not supported; convert the file with `{remedy}`")]
    Unsupported {
        file: String,
        what: String,
        remedy: &'static str,
    },

    /// An image without places on Earth.
    #[error(
        "pixels of {file:?} cannot be located ({why}); give a GeoTIFF with an EPSG code or control points, or a Sentinel-1 product"
    )]
    NoPlaces { file: String, why: String },

    /// A number outside the allowed closed range.
    #[error("{name} is {value}, outside [{min}, {max}]; give a number in this range")]
    OutOfRange {
        name: &'static str,
        value: f64,
        min: f64,
        max: f64,
    },

    /// A window that is empty or not entirely inside the image.
    #[error(
        "the window of lines {lines:?} and pixels {pixels:?} is empty or reaches beyond the image of {size_lines} lines and \
         {size_pixels} pixels; give a window inside the image"
    )]
    Window {
        lines: std::ops::Range<usize>,
        pixels: std::ops::Range<usize>,
        size_lines: usize,
        size_pixels: usize,
    },

    /// A part of an image that cannot be cut out.
    #[error(
        "the part of lines {lines:?} and pixels {pixels:?} cannot be cut out of an image of {size_lines} lines and \
         {size_pixels} pixels; give a part inside it of at least {smallest} lines and {smallest} pixels"
    )]
    Part {
        lines: std::ops::Range<usize>,
        pixels: std::ops::Range<usize>,
        size_lines: usize,
        size_pixels: usize,
        smallest: usize,
    },

    /// A product that already exists and would be overwritten.
    #[error(
        "{} already exists; choose another folder, or move it away",
        shown(path)
    )]
    Exists { path: PathBuf },

    /// A file that could not be written as requested.
    #[error("cannot write {}: {why}", shown(path))]
    Unwritable { path: PathBuf, why: String },
}

impl Error {
    pub(crate) fn io(path: &Path, source: std::io::Error) -> Self {
        let path = path.to_owned();
        Self::Io { path, source }
    }

    pub(crate) fn unreadable(path: &Path, why: impl std::fmt::Display) -> Self {
        Self::Unreadable {
            path: path.to_owned(),
            why: sentence(&why.to_string()),
        }
    }

    pub(crate) fn damaged(file: &str, why: impl Into<String>) -> Self {
        Self::Damaged {
            file: file.to_owned(),
            why: why.into(),
        }
    }
}

/// A path for use in a sentence, without control characters.
fn shown(path: &Path) -> String {
    sentence(&path.to_string_lossy())
}

/// Checks a number against a closed range; NaN lies outside.
pub(crate) fn check_range(name: &'static str, value: f64, min: f64, max: f64) -> Result<()> {
    match (min..=max).contains(&value) {
        true => Ok(()),
        false => Err(Error::OutOfRange {
            name,
            value,
            min,
            max,
        }),
    }
}
