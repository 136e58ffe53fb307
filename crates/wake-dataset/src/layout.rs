//! Files and manifest of a data set.

use super::recipe::{Draw, Recipe};
use super::scenes::{PAPER_SCENES, Simulated};
use super::shuffle::shuffled;
use crate::error::{Error, Result};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::io::ErrorKind;
use std::ops::Range;
use std::path::{Path, PathBuf};
use wake_nn::check_range;
use wake_physics::Plan;
use wake_physics::grey::GreyScale;
use whole_files::{failed, read_text, sealed, unsealed};

/// Version of the layout; other versions are refused.
const FORMAT: u32 = 5;
/// Default share of validation images.
const VAL_SHARE: f64 = 0.1;
/// Number of scenes planned to estimate the cost of a set.
const PLANNED: u64 = 8;

/// Manifest of a data set: the content of `dataset.json`, which determines every other file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Version of the layout.
    pub format: u32,
    /// Seed of the whole set.
    pub seed: u64,
    /// Number of pairs of the whole set.
    pub count: u64,
    /// Mapping from σ⁰ to grey, equal to the recipe's.
    pub grey: GreyScale,
    /// Share of validation images, 0 to 1.
    pub val_share: f64,
    /// Recipe of the scenes.
    pub recipe: Recipe,
    /// [Fingerprint](whole_files::fingerprint) of the file of the learnt sea in the images, if any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sea: Option<String>,
    /// Shard of the set in this folder, if it is not the whole set: the content of `shard.json`.
    #[serde(skip)]
    pub shard: Option<Shard>,
}

/// Shard `number` of `of` nearly equal ones, counted from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shard {
    /// Index of the shard, from 0 to below `of`.
    pub number: u64,
    /// Number of shards.
    pub of: u64,
}

impl std::str::FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let whole = |part: &str| part.trim().parse::<u64>().ok();
        let parts = text.split_once('/').map(|(i, n)| (whole(i), whole(n)));
        match parts {
            Some((Some(number), Some(of))) if number < of => Ok(Self { number, of }),
            _ => Err("expected I/N with I from 0 to N − 1, such as 0/4".to_owned()),
        }
    }
}

impl Manifest {
    /// Makes the manifest of a whole set of `count` pairs from a recipe and a seed.
    ///
    /// # Errors
    ///
    /// As [`Recipe::validate`].
    pub fn new(recipe: Recipe, seed: u64, count: u64) -> Result<Self> {
        recipe.validate()?;
        Ok(Self {
            format: FORMAT,
            seed,
            count,
            shard: None,
            grey: recipe.grey,
            val_share: VAL_SHARE,
            recipe,
            sea: None,
        })
    }

    /// Sets the share of validation images.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::OutOfRange`] for a share outside 0 to 1.
    pub fn with_val_share(self, val_share: f64) -> Result<Self> {
        check_range("val_share", val_share, 0.0, 1.0)?;
        Ok(Self { val_share, ..self })
    }

    /// Whether image `index` is for validation, chosen at random by the seed. Images of one scene of the paper's grid, which
    /// differ only in their seas, stay on one side.
    pub(super) fn is_val(&self, index: u64) -> bool {
        let scenes = match self.recipe.draw {
            Draw::PaperGrid => self.count.min(PAPER_SCENES),
            Draw::Values(_) => self.count,
        };
        let scenes = scenes.max(1);
        let val = (self.val_share * scenes as f64).round() as u64;
        shuffled(index % scenes, scenes, self.seed) < val
    }

    /// Numbers of training and validation images in this folder.
    pub(super) fn split_sizes(&self) -> [u64; 2] {
        let val = self.indices().filter(|&index| self.is_val(index)).count() as u64;
        [self.indices().end - self.indices().start - val, val]
    }

    /// The source of the set's pairs, without the learnt sea.
    ///
    /// # Errors
    ///
    /// As [`Simulated::new`].
    pub fn source(&self) -> Result<Simulated> {
        Simulated::new(self.recipe.clone(), self.seed)
    }

    /// Estimated core-seconds per image, from the plans of the first eight scenes.
    ///
    /// # Errors
    ///
    /// As [`Simulated::scene`] and [`Plan::new`].
    pub fn core_seconds(&self) -> Result<f64> {
        let (source, indices) = (self.source()?, self.indices());
        let planned = PLANNED.min(indices.end - indices.start).max(1);
        let mut seconds = 0.0;
        for index in indices.start..indices.start + planned {
            seconds += Plan::new(&source.scene(index)?)?.cost().core_seconds;
        }
        Ok(seconds / planned as f64)
    }

    /// Indices of the pairs in this folder: all, or a shard's contiguous range.
    pub fn indices(&self) -> Range<u64> {
        let Some(Shard { number, of }) = self.shard else {
            return 0..self.count;
        };
        let end = |share: u64| (u128::from(self.count) * u128::from(share) / u128::from(of)) as u64;
        end(number)..end(number + 1)
    }

    /// Content of `dataset.json`, the same for a set and all its shards.
    pub(super) fn text(&self) -> Result<String> {
        let text = serde_json::to_string_pretty(self);
        let text = text.map_err(|e| failed("encode", Path::new("dataset.json"), e))?;
        Ok(sealed(&text) + "\n")
    }

    /// Reads the manifest of a folder; `None` if it has none.
    ///
    /// # Errors
    ///
    /// [`Error::Dataset`] if it is not a manifest of this layout, or was changed after it was written.
    pub(super) fn read(folder: &Path) -> Result<Option<Self>> {
        let path = Layout(folder).manifest();
        let Some(text) = text_if_there(&path)? else {
            return Ok(None);
        };
        let Some(object) = text.strip_suffix('\n').and_then(unsealed) else {
            return Err(unreadable_manifest(&path, &text));
        };
        let mut manifest: Self = parse_json(&path, &object)?;
        if manifest.format != FORMAT {
            return Err(other_format(&path, manifest.format.into()));
        }
        if manifest.grey != manifest.recipe.grey {
            let message =
                "grey and recipe.grey differ, but a set has one mapping; restore the file";
            return Err(broken(&path, 1, message));
        }
        let note = Layout(folder).shard_note();
        let shard = text_if_there(&note)?.map(|text| parse_json(&note, &text));
        manifest.shard = shard.transpose()?;
        Ok(Some(manifest))
    }
}

/// Error for a text without a valid checksum: not JSON, another version, not a manifest, or changed.
fn unreadable_manifest(path: &Path, text: &str) -> Error {
    let value: serde_json::Value = match parse_json(path, text) {
        Ok(value) => value,
        Err(error) => return error,
    };
    let changed = || {
        let message = "the file was changed: its checksum crc32 does not match; restore it, or make the set again in another folder";
        broken(path, 1, message)
    };
    match value["format"].as_u64() {
        Some(format) if format != u64::from(FORMAT) => other_format(path, format),
        _ if value.get("crc32").is_some() => changed(),
        _ => parse_json::<Manifest>(path, text).map_or_else(|error| error, |_| changed()),
    }
}

fn other_format(path: &Path, format: u64) -> Error {
    let message =
        format!("format is {format}, expected {FORMAT}; make the set again with this version");
    broken(path, 1, message)
}

/// Reads a text file; `None` if there is none.
fn text_if_there(path: &Path) -> Result<Option<String>> {
    match read_text(path) {
        Ok(text) => Ok(Some(text)),
        Err(e) if e.source.kind() == ErrorKind::NotFound => Ok(None),
        Err(e) => Err(e.into()),
    }
}

fn parse_json<T: DeserializeOwned>(path: &Path, text: &str) -> Result<T> {
    serde_json::from_str(text).map_err(|e| broken(path, e.line(), e.to_string()))
}

/// Paths of the files of a data set in a folder.
#[derive(Clone, Copy)]
pub(super) struct Layout<'a>(pub(super) &'a Path);

impl Layout<'_> {
    pub(super) fn manifest(self) -> PathBuf {
        self.0.join("dataset.json")
    }

    pub(super) fn shard_note(self) -> PathBuf {
        self.0.join("shard.json")
    }

    pub(super) fn metadata(self) -> PathBuf {
        self.0.join("metadata.jsonl")
    }

    pub(super) fn coco(self) -> PathBuf {
        self.0.join("coco.json")
    }

    pub(super) fn card(self) -> PathBuf {
        self.0.join("README.md")
    }

    pub(super) fn yolo(self) -> PathBuf {
        self.0.join("data.yaml")
    }

    /// Folders of images and labels: images, YOLO, YOLO with oriented boxes, DOTA.
    pub(super) fn folders(self) -> [PathBuf; 4] {
        ["images", "labels", "labels-obb", "labelTxt"].map(|name| self.0.join(name))
    }

    /// Lists of training and validation images. The names must not contain `train` or `val` as separate words: Hugging Face
    /// `datasets` would take such a file for the whole split, and find no image in it.
    pub(super) fn lists(self) -> [PathBuf; 2] {
        ["trainset.txt", "valset.txt"].map(|name| self.0.join(name))
    }

    /// Image and label files of one pair, in the order of [`Self::folders`].
    pub(super) fn files_of(self, index: u64) -> [PathBuf; 4] {
        let [_, labels @ ..] = self.folders();
        let [upright, oriented, dota] = labels.map(|folder| folder.join(format!("{index:06}.txt")));
        [self.0.join(image_name(index)), upright, oriented, dota]
    }

    pub(super) fn shard(self, shard: Shard) -> PathBuf {
        self.0.join(format!("shard-{}", shard.number))
    }
}

/// The `file_name` of a pair.
pub(super) fn image_name(index: u64) -> String {
    format!("images/{index:06}.png")
}

pub(super) fn broken(path: &Path, line: usize, message: impl Into<String>) -> Error {
    Error::Dataset {
        path: path.to_owned(),
        line,
        message: message.into(),
    }
}
