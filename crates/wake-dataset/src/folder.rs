//! A data set on disk, read back, once or again and again.

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

/// A finite data set in a folder that [`write`](super::write) made.
#[derive(Debug, Clone)]
pub struct Folder {
    path: PathBuf,
    manifest: Manifest,
    rows: Rows,
    /// Labels of the pairs that were read: they take longer than an image to read, and every epoch needs them.
    labels: Arc<[OnceLock<Labels>]>,
}

impl Folder {
    /// Opens a folder; images are read when they are asked for.
    ///
    /// # Errors
    ///
    /// [`Error::Dataset`](crate::Error::Dataset) with the number of the first line that is broken or was changed.
    pub fn open(path: &Path) -> Result<Self> {
        let Some(manifest) = Manifest::read(path)? else {
            let message = "no data set; make one with `wake dataset`";
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

    /// The scenes that made the images, in order.
    pub fn scenes(&self) -> impl Iterator<Item = &Scene> {
        self.rows.iter().map(|(_, row)| &row.scene)
    }

    /// Positions of the pairs that are to be learnt from, those that `trainset.txt` names.
    #[must_use]
    pub fn trainset(&self) -> Vec<u64> {
        self.split(false)
    }

    /// Positions of the pairs that are to be validated with, those that `valset.txt` names.
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
            let message = format!("no pair {position}, there are {}", self.len());
            broken(&self.path, 0, message)
        })
    }

    /// Reads a pair; `position` counts from 0 in this folder.
    ///
    /// # Errors
    ///
    /// [`Error::Dataset`](crate::Error::Dataset) if there is no such pair, or its image is another one than was written.
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

/// The image of a file's content.
fn decoded(path: &Path, bytes: &[u8], [rows, columns]: [usize; 2]) -> Result<Grey> {
    let image = image::load_from_memory_with_format(bytes, ImageFormat::Png);
    let image = image
        .map_err(|e| broken(path, 0, e.to_string()))?
        .into_luma8();
    let size = [image.height() as usize, image.width() as usize];
    if size != [rows, columns] {
        let message = format!(
            "{} x {} pixels, but the set has {rows} x {columns}",
            size[0], size[1]
        );
        return Err(broken(path, 0, message));
    }
    Ok(Grey::of_levels(image.as_raw(), rows, columns))
}

/// Every pair of a folder once in each epoch, shuffled anew, without end.
///
/// Position p is pair p mod n of epoch p div n: a function of (seed, p) alone.
#[derive(Debug, Clone)]
pub struct Epochs {
    folder: Folder,
    seed: u64,
}

impl Epochs {
    /// The endless walk through a folder.
    pub fn new(folder: Folder, seed: u64) -> Self {
        Self { folder, seed }
    }

    /// The folder that is walked through.
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
