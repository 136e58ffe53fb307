//! Classifier two-sample tests between the open sea of real tiles and simulated seas.

use std::fmt::Write;
use std::path::Path;
use std::sync::Arc;

use serde_json::{Value, json};
use wake_dataset::Source;
use wake_detector::GreyImage;
use wake_nn::device_named;
use wake_physics::Field;
use wake_train::detector::ImageRecipe;
use wake_train::detector::judging::{Tile, paired_windows};
use wake_train::{TwoSampleOptions, classifier_two_sample_test};

use crate::exit::Outcome;

/// Seed of held-out images, which no training uses.
pub(crate) const HELD_OUT: u64 = 900_001;
/// Rows and columns of a window of open sea.
const WINDOW: usize = 128;
/// Most windows of each half of a tile.
const OF_A_HALF: usize = 4;

/// Windows of open sea in the tiles of a folder, without pixels marked in `NAME_mask.png`.
pub(crate) fn windows(folder: &Path, tiles: &[Tile]) -> Outcome<Vec<Field>> {
    let mut windows = Vec::new();
    for tile in tiles {
        let stem = Path::new(&tile.name).with_extension("");
        let mask = folder.join(format!("{}_mask.png", stem.display()));
        let mask = mask.is_file().then(|| GreyImage::read(&mask)).transpose()?;
        let found = paired_windows(&tile.image, mask.as_ref(), WINDOW, OF_A_HALF);
        windows.extend(found.into_iter().map(field));
    }
    Ok(windows)
}

fn field(values: Vec<f32>) -> Field {
    Field {
        rows: WINDOW,
        columns: WINDOW,
        values,
    }
}

/// Windows of a source, as many as `count`.
fn simulated(source: &Arc<dyn Source>, count: usize) -> Outcome<Vec<Field>> {
    let pairs = source.items(0..count as u64)?;
    let levels = |pair: wake_dataset::Pair| {
        let levels = pair.image.levels();
        field(levels.into_iter().map(f32::from).collect())
    };
    Ok(pairs.into_iter().map(levels).collect())
}

/// Accuracy of a classifier between real windows and each simulated sea, and between two draws of one recipe as the
/// floor.
pub(crate) fn told_apart(real: &[Field]) -> Outcome<Vec<Value>> {
    let device = device_named("flex")?;
    let windows = |source: wake_dataset::Result<Arc<dyn Source>>| simulated(&source?, real.len());
    let satellites = |plain: bool| windows(ImageRecipe::open_sea(plain, HELD_OUT, WINDOW));
    let detector = |seed: u64| windows(ImageRecipe::empty_sea(seed, WINDOW));
    let delivered = detector(HELD_OUT)?;
    let rows = [
        (
            "real sea and pixels without response",
            real,
            satellites(true)?,
        ),
        ("real sea and recipe satellites", real, satellites(false)?),
        ("real sea and recipe detector", real, delivered.clone()),
        (
            "recipe detector and itself, other seeds",
            &delivered,
            detector(HELD_OUT + 1)?,
        ),
    ];
    let row = |(name, first, second): (&str, &[Field], Vec<Field>)| {
        let found =
            classifier_two_sample_test(first, &second, &TwoSampleOptions::default(), &device)?;
        Ok(json!({
            "kinds": name, "accuracy": found.accuracy, "half_width": found.half_width, "images": found.images,
        }))
    };
    rows.into_iter().map(row).collect()
}

/// Table of the accuracies.
pub(crate) fn table(rows: &[Value]) -> String {
    let mut text = "\n## The open sea\n\nAccuracy of a classifier, trained on the left halves of the real tiles, on patches of 64² pixels of their \
         right halves ([two-sample test](evaluation.md#two-sample-test-and-shape-of-the-sea); 0.5: indistinguishable).\n\n\
         | kinds | right | windows |\n| --- | --- | --- |\n"
        .to_owned();
    for row in rows {
        let number = |key: &str| row[key].as_f64().unwrap_or(f64::NAN);
        // Writing into a string cannot fail.
        let _ = writeln!(
            text,
            "| {} | {:.2} ± {:.2} | {} |",
            row["kinds"].as_str().unwrap_or_default(),
            number("accuracy"),
            number("half_width"),
            row["images"],
        );
    }
    text
}
