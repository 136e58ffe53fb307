//! Square crops of labelled images, for fine-tuning with a few real labels.

use std::ops::Range;
use std::path::PathBuf;

use serde_json::{Value, json};
use wake_dataset::{Grey, Pair, Source};
use wake_detector::{GreyImage, Wake};
use wake_physics::Scene;
use wake_physics::labels::Labels;

use super::draw::Draw;
use super::judging::Tile;
use super::painted::label;
use crate::error::{Error, Result};

/// Signal-to-noise ratios given to labels that count, and to doubtful ones, around which nothing is learnt.
const SURE: f32 = 20.0;
const UNSURE: f32 = 3.0;
/// Separates the random numbers of the crops from the random numbers of other sources with the same seed.
const SQUARES: u64 = 0x1A_BE11;

/// Selection of labelled images to train on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LabelledImages {
    /// Folder of images with `labels.json`.
    pub folder: PathBuf,
    /// Names of the images that are left out.
    pub without: Vec<String>,
    /// Number of images, taken by name after the first one that is left out; `None`: all others.
    pub count: Option<usize>,
}

impl LabelledImages {
    /// Reads the selected images.
    ///
    /// # Errors
    ///
    /// As [`Tile::read_all`]; [`wake_nn::Error::InvalidOption`] for an image that does not exist, and
    /// [`wake_nn::Error::OutOfRange`] for more images than are left.
    pub fn read(&self) -> Result<Vec<Tile>> {
        let mut tiles = Tile::read_all(&self.folder)?;
        let place = |name: &String| {
            let place = tiles.iter().position(|tile| tile.name == *name);
            place.ok_or_else(|| {
                let names: Vec<&str> = tiles.iter().map(|tile| tile.name.as_str()).collect();
                Error::Value(wake_nn::Error::InvalidOption {
                    option: "image left out".to_owned(),
                    value: whole_files::sentence(name),
                    expected: format!("one of {}", names.join(", ")),
                })
            })
        };
        let places: Vec<usize> = self.without.iter().map(place).collect::<Result<_>>()?;
        if let Some(&first) = places.first() {
            tiles.rotate_left(first);
            tiles.retain(|tile| !self.without.contains(&tile.name));
        }
        if let Some(count) = self.count {
            let most = tiles.len() as f64;
            wake_nn::check_range("number of labelled images", count as f64, 1.0, most)?;
            tiles.truncate(count);
        }
        Ok(tiles)
    }

    /// Identity of the selection, for the record of a run.
    pub(super) fn identity(&self) -> Value {
        json!({"without": self.without, "count": self.count})
    }
}

/// Square crops of labelled images: every other one around a wake, the others anywhere.
#[derive(Debug)]
pub(crate) struct Labelled {
    tiles: Vec<(GreyImage, Vec<Wake>)>,
    seed: u64,
    size: usize,
}

impl Labelled {
    /// Crops of `size` rows and columns.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::OutOfRange`] for an image smaller than a crop.
    pub(crate) fn new(tiles: Vec<Tile>, seed: u64, size: usize) -> Result<Self> {
        let of = |tile: Tile| {
            let smallest = tile.image.rows().min(tile.image.columns());
            let name = format!("smaller side of {}", tile.name);
            wake_nn::check_range(&name, smallest as f64, size as f64, 1e6)?;
            let wakes = tile.probable.labels.iter().map(|label| Wake {
                tip: label.ray.tip.map(|x| x as f32),
                axis_deg: label.ray.axis_deg as f32,
                half_angle_deg: 0.0,
                length: label.length as f32,
                snr: if label.counts { SURE } else { UNSURE },
                contrast_db: None,
            });
            Ok((tile.image.clone(), wakes.collect()))
        };
        Ok(Self {
            tiles: tiles.into_iter().map(of).collect::<Result<_>>()?,
            seed,
            size,
        })
    }

    /// Crop at a position.
    fn pair(&self, position: u64) -> Pair {
        let draw = &mut Draw::new(self.seed ^ SQUARES, position);
        let (image, wakes) = &self.tiles[draw.one_of(&vec![1.0; self.tiles.len()])];
        let room = [image.columns(), image.rows()].map(|n| (n - self.size) as f32);
        let anywhere = room.map(|room| draw.between(0.0, room));
        let corner = match wakes.len() {
            0 => anywhere,
            _ if !position.is_multiple_of(2) => anywhere,
            count => {
                let wake = wakes[draw.one_of(&vec![1.0; count])];
                let part = draw.between(0.0, 1.0);
                let place = wake.at(part * wake.length.min(self.size as f32));
                let off = [0, 1].map(|_| draw.between(0.2, 0.8) * self.size as f32);
                [0, 1].map(|axis| (place[axis] - off[axis]).clamp(0.0, room[axis]))
            }
        };
        let [left, top] = corner.map(|c| c.floor() as usize);
        let levels = image.window(top, left, self.size, self.size);
        let levels: Vec<u8> = levels
            .iter()
            .map(|l| l.round().clamp(0.0, 255.0) as u8)
            .collect();
        let here = |wake: &Wake| Wake {
            tip: [wake.tip[0] - left as f32, wake.tip[1] - top as f32],
            ..*wake
        };
        let wakes = wakes.iter().map(here).filter(|wake| self.meets(wake));
        let mut scene = Scene {
            ships: Vec::new(),
            seed: position,
            ..Scene::default()
        };
        (scene.grid.rows, scene.grid.columns) = (self.size, self.size);
        Pair {
            index: position,
            image: Grey::of_levels(&levels, self.size, self.size),
            prompt: String::new(),
            scene,
            labels: Labels {
                ships: wakes.map(|wake| label(&wake, self.size)).collect(),
                ..Labels::default()
            },
            amplitudes: None,
        }
    }

    /// Whether any point of the wake's line lies in the crop.
    fn meets(&self, wake: &Wake) -> bool {
        let inside = |x: &f32| (0.0..self.size as f32).contains(x);
        (0..=32).any(|n| wake.at(wake.length * n as f32 / 32.0).iter().all(inside))
    }
}

impl Source for Labelled {
    fn size(&self) -> [usize; 2] {
        [self.size; 2]
    }

    fn items(&self, positions: Range<u64>) -> wake_dataset::Result<Vec<Pair>> {
        Ok(positions.map(|position| self.pair(position)).collect())
    }
}

/// Source of crops of labelled images.
///
/// # Errors
///
/// As [`LabelledImages::read`] and [`Labelled::new`].
pub(crate) fn source(images: &LabelledImages, seed: u64, size: usize) -> Result<Labelled> {
    Labelled::new(images.read()?, seed, size)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detector::Sample;
    use std::path::Path;

    const NAMES: [&str; 4] = ["a.png", "b.png", "c.png", "d.png"];

    /// A folder with images of one wake each, drawn as a bright line.
    fn folder_of(names: &[&str], folder: &Path) {
        let mut images = Vec::new();
        for name in names {
            let mut image = image::GrayImage::from_pixel(120, 100, image::Luma([50]));
            for n in 0..60 {
                image.put_pixel(30 + n, 40, image::Luma([200]));
            }
            image.save(folder.join(name)).unwrap();
            images.push(format!(
                r#""{name}": {{"width": 120, "height": 100, "wakes": [
                    {{"tip": [30, 40], "axis_deg": 90, "length_px": 60, "confidence": "clear"}}]}}"#
            ));
        }
        let text = format!(r#"{{"images": {{{}}}}}"#, images.join(", "));
        std::fs::write(folder.join("labels.json"), text).unwrap();
    }

    fn names(images: &LabelledImages) -> Vec<String> {
        let tiles = images.read().unwrap();
        tiles.into_iter().map(|tile| tile.name).collect()
    }

    #[test]
    fn the_image_that_is_left_out_is_not_learnt_from() {
        let folder = tempfile::tempdir().unwrap();
        folder_of(&NAMES, folder.path());
        let images = |without: &[&str], count| LabelledImages {
            folder: folder.path().to_owned(),
            without: without.iter().map(|&name| name.to_owned()).collect(),
            count,
        };
        assert_eq!(names(&images(&[], None)), NAMES);
        assert_eq!(names(&images(&["c.png"], Some(2))), ["d.png", "a.png"]);
        assert_eq!(names(&images(&["a.png"], None)), NAMES[1..]);
        assert_eq!(
            names(&images(&["c.png", "a.png"], None)),
            ["d.png", "b.png"]
        );
        let unknown = images(&["a.png", "e.png"], None);
        let unknown = unknown.read().unwrap_err().to_string();
        assert!(
            unknown.contains("e.png") && unknown.contains("d.png"),
            "{unknown}"
        );
        let many = images(&["a.png"], Some(4)).read().unwrap_err().to_string();
        assert!(many.contains("labelled images is 4"), "{many}");
    }

    /// The bright line lies on the label's ray in every crop that it meets, and a crop depends on its position alone.
    #[test]
    fn labels_follow_the_squares() {
        let folder = tempfile::tempdir().unwrap();
        folder_of(&NAMES[..1], folder.path());
        let images = LabelledImages {
            folder: folder.path().to_owned(),
            without: Vec::new(),
            count: None,
        };
        let source = source(&images, 3, 64).unwrap();
        let pairs = source.items(0..40).unwrap();
        assert_eq!(source.items(7..9).unwrap(), pairs[7..9]);
        let mut met = 0;
        for pair in &pairs {
            let sample = Sample::of_pair(pair);
            for wake in &sample.wakes {
                met += 1;
                assert!((wake.axis_deg - 90.0).abs() < 1e-3 && (wake.length - 60.0).abs() < 1e-3);
                for along in [0.0f32, 20.0, 50.0] {
                    let [x, y] = wake.at(along).map(f32::round);
                    if (0.0..64.0).contains(&x) && (0.0..64.0).contains(&y) {
                        let grey = sample.pixels[y as usize * 64 + x as usize];
                        assert!(grey > 190.0, "{wake:?} {along}: {grey}");
                    }
                }
            }
        }
        assert!(met >= 20, "{met}");
        let large = super::source(&images, 3, 128).unwrap_err().to_string();
        assert!(large.contains("smaller side of a.png is 100"), "{large}");
    }
}
