//! A data set on disk, read back.

use super::layout::{Layout, Manifest, broken, cannot};
use super::log::{Rows, parse};
use super::pair::{Grey, Pair};
use crate::error::Result;
use std::path::{Path, PathBuf};
use wake_physics::labels_of;

/// A finite data set in a folder that [`write`](super::write) made.
#[derive(Debug, Clone)]
pub struct Folder {
    path: PathBuf,
    manifest: Manifest,
    rows: Rows,
}

impl Folder {
    /// Opens a folder; images are read when they are asked for.
    ///
    /// Captions may have been edited.
    ///
    /// # Errors
    ///
    /// [`Error::Dataset`](crate::Error::Dataset) with the number of the first broken line.
    pub fn open(path: &Path) -> Result<Self> {
        let Some(manifest) = Manifest::read(path)? else {
            let message = "no data set; make one with the example make_dataset";
            return Err(broken(path, 0, message));
        };
        let metadata = Layout(path).metadata();
        let text = std::fs::read(&metadata).map_err(|e| cannot("read", &metadata, e))?;
        let rows = parse(&metadata, &text, &manifest)?;
        let expected = manifest.indices().end - manifest.indices().start;
        if rows.len() as u64 != expected {
            let message = format!(
                "ends after {} of {expected} pairs; run make_dataset again to finish it",
                rows.len()
            );
            return Err(broken(&metadata, rows.len(), message));
        }
        Ok(Self {
            path: path.to_owned(),
            manifest,
            rows,
        })
    }

    /// What the set is.
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

    /// Reads a pair; `position` counts from 0 in this folder.
    ///
    /// # Errors
    ///
    /// [`Error::Dataset`](crate::Error::Dataset) if there is no such pair, or its image is not of the set's size.
    pub fn pair(&self, position: u64) -> Result<Pair> {
        let Some((index, row)) = self.rows.get(position as usize) else {
            let message = format!("no pair {position}, there are {}", self.len());
            return Err(broken(&self.path, 0, message));
        };
        let base = &self.manifest.recipe.scene;
        let path = self.path.join(&row.file_name);
        Ok(Pair {
            index: *index,
            image: read_image(&path, [base.grid.rows, base.grid.columns])?,
            prompt: row.text.clone(),
            parameters: row.parameters,
            labels: labels_of(&row.parameters.onto(base)),
        })
    }
}

fn read_image(path: &Path, [rows, columns]: [usize; 2]) -> Result<Grey> {
    let image = image::open(path).map_err(|e| broken(path, 0, e.to_string()))?;
    let image = image.into_luma8();
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

#[cfg(test)]
#[path = "folder_tests.rs"]
mod tests;
