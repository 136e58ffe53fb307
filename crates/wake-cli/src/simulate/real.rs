//! Real images of a folder, with the axes of their labelled wakes.

use super::figures::ImageFigures;
use super::profile::WakeAxis;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use wake_physics::{Error, Field, Result};

/// `labels.json` of a folder; unknown keys are ignored.
#[derive(Deserialize, Default)]
struct Labels {
    images: BTreeMap<String, Image>,
}

#[derive(Deserialize)]
struct Image {
    wakes: Vec<Wake>,
}

#[derive(Deserialize)]
struct Wake {
    id: String,
    tip: [f64; 2],
    axis_deg: f64,
    confidence: String,
}

/// Figures of the PNG images of a folder by name, without files whose name ends in `_mask`. Grey is taken as linear in
/// amplitude, and doubtful wakes are left out.
pub(crate) fn figures(folder: &Path) -> Result<Vec<ImageFigures>> {
    let labels = labels(&folder.join("labels.json"))?;
    let mut images = Vec::new();
    for path in pictures(folder)? {
        let name = |part: Option<&std::ffi::OsStr>| {
            part.unwrap_or_default().to_string_lossy().into_owned()
        };
        let wakes = labels.images.get(&name(path.file_name()));
        let wakes = wakes.into_iter().flat_map(|image| &image.wakes);
        let wakes = wakes.filter(|wake| wake.confidence != "doubtful");
        let wakes = wakes.map(|wake| {
            let axis = WakeAxis {
                tip: wake.tip,
                direction: wake.axis_deg,
            };
            (wake.id.clone(), axis)
        });
        let name = name(path.file_stem());
        images.push(ImageFigures::of_amplitude(&name, &grey(&path)?, wakes));
    }
    Ok(images)
}

fn labels(path: &Path) -> Result<Labels> {
    if !path.is_file() {
        return Ok(Labels::default());
    }
    let text = std::fs::read_to_string(path).map_err(|e| unreadable(path, &e))?;
    serde_json::from_str(&text).map_err(|e| unreadable(path, &e))
}

fn pictures(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut paths = Vec::new();
    for path in whole_files::entries(folder)? {
        let is_png = path
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("png"));
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        if is_png && !stem.ends_with("_mask") && path.is_file() {
            paths.push(path);
        }
    }
    if paths.is_empty() {
        let none = std::io::Error::other("it holds no PNG image; name a folder of real images");
        return Err(unreadable(folder, &none));
    }
    Ok(paths)
}

fn grey(path: &Path) -> Result<Field> {
    let picture = image::open(path)
        .map_err(|e| unreadable(path, &e))?
        .into_luma8();
    Ok(Field {
        rows: picture.height() as usize,
        columns: picture.width() as usize,
        values: picture.into_raw().into_iter().map(f32::from).collect(),
    })
}

fn unreadable(path: &Path, cause: &dyn std::fmt::Display) -> Error {
    Error::File {
        action: "read",
        path: path.to_owned(),
        message: cause.to_string(),
    }
}
