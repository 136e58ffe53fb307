//! `wake train sea`: learns sea texture from real images without labels.

use std::path::PathBuf;

use crate::sheet::Picture;
use clap::Args;
use serde_json::{Map, Value, json};
use wake_ldm::sea_texture::SeaTexture;
use wake_train::{SeaPatches, SeaTraining};
use whole_files::fingerprint;

use super::options::{Pace, Place, Thrift};
use super::screen::Screen;
use crate::exit::{self, Outcome};
use crate::progress;
use crate::sea_images::{Half, SeaFile, list};

/// Most patches held in memory, unless there are more images.
const PATCHES: usize = 2048;
/// Seas on a sheet, rows and columns of a sea, and seas in a row.
const SHOWN: u64 = 8;
const SIDE: usize = 256;
const ACROSS: usize = 4;

/// Defaults of the options that all trainings have.
pub(crate) const DEFAULTS: &[(&str, &str)] = &[
    ("steps", "1200"),
    ("batch", "16"),
    ("rate", "1e-3"),
    ("every", "200"),
    ("out", "out/sea"),
];

/// Train a model of sea texture on unlabelled radar images.
///
/// Writes `sea.safetensors`, which `wake generate --sea` and `wake dataset --sea` use as the sea of their scenes.
#[derive(Args)]
pub(crate) struct Options {
    /// Folder of radar images of 8 or 16 bits, with grey linear in amplitude; pixels marked in `NAME_mask.png` are left
    /// out
    #[arg(long, value_name = "DIR")]
    images: PathBuf,
    /// Pixel spacing (m), if known; scenes with another spacing are then rejected
    #[arg(long, value_name = "METRES")]
    spacing: Option<f64>,
    /// Train on one half of every image, so that the other can be used for evaluation
    #[arg(long, value_enum)]
    half: Option<Half>,
    #[command(flatten)]
    pace: Pace,
    #[command(flatten)]
    place: Place,
    #[command(flatten)]
    thrift: Thrift,
}

pub(crate) fn run(options: &Options) -> Outcome<()> {
    let constants = options.place.paced(&options.pace, &options.thrift)?;
    SeaTraining::check(&constants)?;
    let files = list(&options.images)?;
    let training = SeaTraining {
        identity: identity(options, &files)?,
        patches: &patches(options, &files)?,
        spacing: options.spacing,
        options: constants,
    };
    let screen = Screen::new(&options.place.out);
    training.train(&options.place.out, &screen.watch(), |sea, path| {
        Ok::<_, wake_train::Error>(sheet(sea)?.write(path)?)
    })?;
    screen.end()
}

fn name(file: &SeaFile) -> String {
    let name = file.path.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

/// Identity of the training data: the content of all files.
fn identity(options: &Options, files: &[SeaFile]) -> Outcome<Value> {
    let mut images = Map::new();
    for file in files {
        let mask = file
            .mask
            .as_ref()
            .map(|mask| fingerprint(mask))
            .transpose()?;
        images.insert(name(file), json!([fingerprint(&file.path)?, mask]));
    }
    let half = options.half.map(|half| format!("{half:?}"));
    Ok(
        json!({"images": images, "half": half, "spacing": options.spacing, "seed": options.place.seed}),
    )
}

/// Patches of all images; only one image is in memory at a time.
fn patches(options: &Options, files: &[SeaFile]) -> Outcome<SeaPatches> {
    let each = PATCHES.div_ceil(files.len());
    let bar = progress::bar(files.len() as u64, "images");
    let (mut patches, mut without) = (SeaPatches::default(), Vec::new());
    for file in files {
        if patches.push(&file.read(options.half)?, each, options.place.seed) == 0 {
            without.push(name(file));
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    if patches.is_empty() {
        return Err(format!(
            "--images {}: no patch of 128 x 128 pixels of open sea; give larger images or smaller masks",
            options.images.display()
        )
        .into());
    }
    if let Some(first) = without.first() {
        let count = without.len();
        exit::note(&format!(
            "note: no open sea in {count} of {} images, such as {first}",
            files.len()
        ));
    }
    Ok(patches)
}

/// Sheet of seas of the first seeds, as quick-looks.
fn sheet(texture: &SeaTexture) -> wake_ldm::Result<Picture> {
    let picture = |seed: u64| -> wake_ldm::Result<Picture> {
        let sea = texture.sample(seed, SIDE, SIDE)?;
        let level = |&i: &f32| (80.0 * i.sqrt()).round().clamp(0.0, 255.0) as u8;
        let levels: Vec<u8> = sea.values.iter().map(level).collect();
        Ok(Picture::from_levels(&levels, SIDE).captioned(&format!("seed {seed}")))
    };
    let pictures = (0..SHOWN).map(picture);
    let pictures = pictures.collect::<wake_ldm::Result<Vec<_>>>()?;
    Ok(Picture::sheet(&pictures, ACROSS))
}
