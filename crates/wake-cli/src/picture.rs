//! Writes pictures of results atomically.

use std::io::Cursor;
use std::path::Path;

use image::{ImageFormat, RgbImage};
use whole_files::write_atomically;

use crate::exit::Outcome;

/// Writes a picture as PNG.
pub(crate) fn write(picture: &RgbImage, path: &Path) -> Outcome<()> {
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, ImageFormat::Png)?;
    Ok(write_atomically(path, bytes.get_ref())?)
}
