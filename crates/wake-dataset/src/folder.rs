//! Reading of a data set on disk, once or in endless epochs.

use super::grey::Grey;
use super::layout::{Layout, Manifest, broken};
use super::metadata::{Row, Rows, parse};
use super::pair::Pair;
use super::shuffle::shuffled;
use crate::error::Result;
use image::ImageFormat;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};
use wake_physics::labels::Labels;
use wake_physics::{Scene, labels_of};

/// A finite data set in a folder made by [`write`](super::write).
#[derive(Debug, Clone)]
pub struct Folder {
    path: PathBuf,
    manifest: Manifest,
    rows: Rows,
    /// Cached labels of the pairs read so far: computing them takes longer than reading an image.
    labels: Arc<[OnceLock<Labels>]>,
}

impl Folder {
    /// Opens a folder; images are read on demand.
    ///
    /// # Errors
    ///
    /// [`Error::Dataset`](crate::Error::Dataset) if there is no finished data set, with the number of the first line that is
    /// broken or was changed.
    pub fn open(path: &Path) -> Result<Self> {
        let Some(manifest) = Manifest::read(path)? else {
            let message = "this folder is not a data set; make one with `wake dataset`";
            return Err(broken(path, 0, message));
        };
        let metadata = Layout(path).metadata();
        let text = whole_files::read_bytes(&metadata)?;
        let rows = parse(&metadata, &text, &manifest)?;
        let expected = manifest.indices().end - manifest.indices().start;
        if rows.len() as u64 != expected {
            let message = format!(
                "ends after {} of {expected} pairs; run `wake dataset` again to finish it",
                rows.len()
            );
            return Err(broken(&metadata, rows.len(), message));
        }
        Ok(Self {
            path: path.to_owned(),
            manifest,
            labels: rows.iter().map(|_| OnceLock::new()).collect(),
            rows,
        })
    }

    /// The manifest of the set.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// Number of pairs.
    pub fn len(&self) -> u64 {
        self.rows.len() as u64
    }

    /// Whether there is no pair.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// The scenes of the images, in order.
    pub fn scenes(&self) -> impl Iterator<Item = &Scene> {
        self.rows.iter().map(|(_, row)| &row.scene)
    }

    /// Positions of the training pairs, which `trainset.txt` lists.
    #[must_use]
    pub fn trainset(&self) -> Vec<u64> {
        self.split(false)
    }

    /// Positions of the validation pairs, which `valset.txt` lists.
    #[must_use]
    pub fn valset(&self) -> Vec<u64> {
        self.split(true)
    }

    fn split(&self, val: bool) -> Vec<u64> {
        let rows = self.rows.iter().zip(0..);
        rows.filter(|((index, _), _)| self.manifest.is_val(*index) == val)
            .map(|(_, position)| position)
            .collect()
    }

    /// The index and the row of a pair.
    pub(super) fn row(&self, position: u64) -> Result<&(u64, Row)> {
        self.rows.get(position as usize).ok_or_else(|| {
            let message = format!(
                "there is no pair {position}; the set has {} pairs, counted from 0",
                self.len()
            );
            broken(&self.path, 0, message)
        })
    }

    /// Reads a pair; `position` counts from 0 in this folder.
    ///
    /// # Errors
    ///
    /// [`Error::Dataset`](crate::Error::Dataset) if there is no such pair, or its image is not the one that was written.
    pub fn pair(&self, position: u64) -> Result<Pair> {
        let (index, row) = self.row(position)?;
        let labels = &self.labels[position as usize];
        let grid = &self.manifest.recipe.scene.grid;
        let path = self.path.join(&row.file_name);
        let bytes = row.image_bytes(&path, position as usize + 1)?;
        Ok(Pair {
            index: *index,
            image: decoded(&path, &bytes, [grid.rows, grid.columns])?,
            prompt: row.text.clone(),
            labels: labels.get_or_init(|| labels_of(&row.scene)).clone(),
            scene: row.scene.clone(),
            amplitudes: row.amplitudes,
        })
    }
}

/// Decodes the content of an image file.
fn decoded(path: &Path, bytes: &[u8], [rows, columns]: [usize; 2]) -> Result<Grey> {
    let image = image::load_from_memory_with_format(bytes, ImageFormat::Png);
    let image = image
        .map_err(|e| broken(path, 0, e.to_string()))?
        .into_luma8();
    let size = [image.height() as usize, image.width() as usize];
    if size != [rows, columns] {
        let message = format!(
            "the image has {} x {} pixels, but the set has {rows} x {columns}; make the set again",
            size[0], size[1]
        );
        return Err(broken(path, 0, message));
    }
    Ok(Grey::of_levels(image.as_raw(), rows, columns))
}

/// Endless epochs of a folder: every pair once per epoch, reshuffled each time.
///
/// Position p is item p mod n of the shuffled epoch p div n: a function of (seed, p) alone.
#[derive(Debug, Clone)]
pub struct Epochs {
    folder: Folder,
    seed: u64,
}

impl Epochs {
    /// Makes endless epochs of a folder, shuffled by a seed.
    pub fn new(folder: Folder, seed: u64) -> Self {
        Self { folder, seed }
    }

    /// The folder.
    pub(super) fn folder(&self) -> &Folder {
        &self.folder
    }

    /// The pair at a position.
    ///
    /// # Errors
    ///
    /// As [`Folder::pair`].
    pub fn pair(&self, position: u64) -> Result<Pair> {
        let count = self.folder.len().max(1);
        self.folder.pair(shuffled(position, count, self.seed))
    }
}
