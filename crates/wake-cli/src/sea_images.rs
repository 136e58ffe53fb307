//! Images in a folder, for learning a sea or for comparison with one.

use std::ops::Range;
use std::path::{Path, PathBuf};

use wake_detector::GreyImage;
use wake_ldm::sea_texture::SeaImage;
use wake_physics::Field;

use crate::exit::Outcome;

/// File endings of images.
const ENDINGS: [&str; 5] = ["png", "tif", "tiff", "jpg", "jpeg"];

/// Half of every image that is used.
#[derive(clap::ValueEnum, Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Half {
    Left,
    Right,
}

impl Half {
    /// Columns of a half, or of the whole image.
    fn columns(half: Option<Self>, columns: usize) -> Range<usize> {
        match half {
            None => 0..columns,
            Some(Self::Left) => 0..columns / 2,
            Some(Self::Right) => columns / 2..columns,
        }
    }
}

/// Paths of an image and its mask, not read yet.
pub(crate) struct SeaFile {
    pub(crate) path: PathBuf,
    /// `NAME_mask.png` beside it, if there is one.
    pub(crate) mask: Option<PathBuf>,
}

/// Lists the images of a folder by name, without masks and the detector's pictures of wakes (`*.wakes.png`).
pub(crate) fn list(folder: &Path) -> Outcome<Vec<SeaFile>> {
    let place = folder.display();
    let mut files = Vec::new();
    for path in whole_files::entries(folder)? {
        let ending = path.extension().unwrap_or_default().to_string_lossy();
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let is_image = ENDINGS.iter().any(|e| ending.eq_ignore_ascii_case(e));
        if !is_image || stem.ends_with("_mask") || stem.ends_with(".wakes") {
            continue;
        }
        let mut mask = path.file_stem().unwrap_or_default().to_owned();
        mask.push("_mask.png");
        let mask = folder.join(mask);
        files.push(SeaFile {
            mask: mask.is_file().then_some(mask),
            path,
        });
    }
    if files.is_empty() {
        return Err(format!(
            "{place} holds no PNG, TIFF or JPEG image; name a folder of radar images"
        )
        .into());
    }
    Ok(files)
}

impl SeaFile {
    /// Reads the image, or half of it.
    pub(crate) fn read(&self, half: Option<Half>) -> Outcome<SeaImage> {
        let amplitude = field(&self.path, half)?;
        let mask = self.mask.as_ref().map(|mask| field(mask, half));
        let told = |error| format!("{}: {error}", self.path.display());
        Ok(SeaImage::new(amplitude, mask.transpose()?).map_err(told)?)
    }
}

fn field(path: &Path, half: Option<Half>) -> Outcome<Field> {
    let grey = GreyImage::read(path)?;
    let columns = Half::columns(half, grey.columns());
    Ok(Field {
        rows: grey.rows(),
        columns: columns.len(),
        values: grey.window(0, columns.start, grey.rows(), columns.len()),
    })
}
