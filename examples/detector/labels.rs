//! Labels of real tiles, as `labels.json` beside them has them.

use std::collections::BTreeMap;
use std::error::Error;
use std::path::Path;

use serde::Deserialize;

use wake_detector::score::{Judged, Label, Point, Ray};

#[derive(Deserialize)]
struct File {
    images: BTreeMap<String, Tile>,
}

#[derive(Deserialize)]
struct Tile {
    width: f64,
    height: f64,
    wakes: Vec<KnownWake>,
}

#[derive(Deserialize)]
struct KnownWake {
    tip: Point,
    axis_deg: f64,
    length_px: f64,
    confidence: Confidence,
    direction_ambiguous: Option<bool>,
    oriented_box: Option<[Point; 4]>,
}

/// How sure the labeller was.
#[derive(Deserialize, Debug, Clone, Copy, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
enum Confidence {
    Clear,
    Probable,
    Doubtful,
}

/// Tiles by file name, their clear wakes counting and all others ignored; or the probable ones counting, too.
///
/// # Errors
///
/// A file that cannot be read, or is of another form.
pub(crate) fn read(folder: &Path, probable: bool) -> Result<Vec<(String, Judged)>, Box<dyn Error>> {
    let path = folder.join("labels.json");
    let text = std::fs::read_to_string(&path).map_err(|error| {
        format!(
            "cannot read {}: {error}; --real names the folder of tiles and labels.json",
            path.display()
        )
    })?;
    let file: File =
        serde_json::from_str(&text).map_err(|error| format!("{}: {error}", path.display()))?;
    let tile = |(name, tile): (String, Tile)| {
        let labels = tile.wakes.into_iter().map(|wake| Label {
            ray: Ray {
                tip: wake.tip,
                axis_deg: wake.axis_deg,
                oriented_box: wake.oriented_box,
            },
            length: wake.length_px,
            counts: match wake.confidence {
                Confidence::Clear => true,
                Confidence::Probable => probable,
                Confidence::Doubtful => false,
            },
            ambiguous: wake.direction_ambiguous.unwrap_or(false),
        });
        (
            name,
            Judged {
                columns: tile.width,
                rows: tile.height,
                labels: labels.collect(),
                found: Vec::new(),
            },
        )
    };
    Ok(file.images.into_iter().map(tile).collect())
}
