//! Pictures of results, written whole or not at all.

use std::error::Error;
use std::io::Cursor;
use std::path::Path;

use image::{ImageFormat, RgbImage};
use wake_physics::output::write_atomically;

/// Writes a picture as PNG.
pub(crate) fn write(picture: &RgbImage, path: &Path) -> Result<(), Box<dyn Error>> {
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, ImageFormat::Png)?;
    Ok(write_atomically(path, bytes.get_ref())?)
}
