//! Real tiles with wakes labelled by people in `labels.json`.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;
use whole_files::read_text;

use crate::error::{Error, Result};
use wake_detector::GreyImage;
use wake_detector::Wake;
use wake_detector::score::{Judged, Label, Point, Ray};

/// A tile and its labels.
#[derive(Debug, Clone)]
pub struct Tile {
    /// Name of its file.
    pub name: String,
    /// The tile.
    pub image: GreyImage,
    /// Labels of which only the clear wakes count.
    pub clear: Judged,
    /// Labels of which the clear and the probable wakes count.
    pub probable: Judged,
}

impl Tile {
    /// Reads the tiles of a folder, sorted by name.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::Io`] where there is no `labels.json` or one of more than 16 MiB, [`Error::Labels`] for one of another
    /// form, and as [`GreyImage::read`].
    pub fn read_all(folder: &Path) -> Result<Vec<Self>> {
        let tile = |(name, known): (String, KnownTile)| {
            Ok(Self {
                image: GreyImage::read(&folder.join(&name))?,
                clear: known.judged(false),
                probable: known.judged(true),
                name,
            })
        };
        labels(folder)?.into_iter().map(tile).collect()
    }

    /// The clear and the probable wakes, for drawing.
    #[must_use]
    pub fn wakes(&self) -> Vec<Wake> {
        let wake = |label: &Label| Wake {
            tip: label.ray.tip.map(|x| x as f32),
            axis_deg: label.ray.axis_deg as f32,
            half_angle_deg: 0.0,
            length: label.length as f32,
            snr: f32::INFINITY,
            contrast_db: None,
        };
        let counted = self.probable.labels.iter().filter(|label| label.counts);
        counted.map(wake).collect()
    }
}

/// The content of `labels.json`; other keys are ignored.
#[derive(Deserialize)]
struct Labels {
    images: BTreeMap<String, KnownTile>,
}

#[derive(Deserialize)]
struct KnownTile {
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

/// Confidence of the labeller.
#[derive(Deserialize, Debug, Clone, Copy, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
enum Confidence {
    Clear,
    Probable,
    Doubtful,
}

fn labels(folder: &Path) -> Result<BTreeMap<String, KnownTile>> {
    let path = folder.join("labels.json");
    let text = read_text(&path)?;
    let labels: Labels = serde_json::from_str(&text).map_err(|error| Error::Labels {
        path,
        message: error.to_string(),
    })?;
    Ok(labels.images)
}

impl KnownTile {
    fn judged(&self, probable: bool) -> Judged {
        let labels = self.wakes.iter().map(|wake| Label {
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
        Judged {
            columns: self.width,
            rows: self.height,
            labels: labels.collect(),
            found: Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probable_wakes_count_where_that_is_asked_for_and_doubtful_ones_never() {
        let folder = tempfile::tempdir().unwrap();
        let missing = Tile::read_all(folder.path()).unwrap_err().to_string();
        assert!(missing.contains("labels.json"), "{missing}");
        let path = folder.path().join("labels.json");
        std::fs::write(&path, "[]").unwrap();
        let other = Tile::read_all(folder.path()).unwrap_err();
        assert!(matches!(other, Error::Labels { .. }), "{other}");
        let file = std::fs::File::create(&path).unwrap();
        file.set_len((16 << 20) + 1).unwrap();
        let long = Tile::read_all(folder.path()).unwrap_err().to_string();
        assert!(long.contains("longer than 16 MiB"), "{long}");
        let wake = |sure: &str| {
            format!(r#"{{"tip": [1, 2], "axis_deg": 90, "length_px": 9, "confidence": "{sure}"}}"#)
        };
        let wakes = ["clear", "probable", "doubtful"].map(wake).join(", ");
        let text = format!(
            r#"{{"images": {{"a.png": {{"width": 8, "height": 4, "wakes": [{wakes}]}}}}}}"#
        );
        std::fs::write(&path, text).unwrap();
        image::GrayImage::new(8, 4)
            .save(folder.path().join("a.png"))
            .unwrap();
        let tiles = Tile::read_all(folder.path()).unwrap();
        let counts = |judged: &Judged| -> Vec<bool> {
            judged.labels.iter().map(|label| label.counts).collect()
        };
        assert_eq!(counts(&tiles[0].clear), [true, false, false]);
        assert_eq!(counts(&tiles[0].probable), [true, true, false]);
        assert_eq!(tiles[0].wakes().len(), 2);
    }
}
