//! A data set on disk, read back, once or again and again.

use super::layout::{Layout, Manifest, broken, cannot};
use super::metadata::{Rows, parse};
use super::pair::{Grey, Pair};
use crate::error::Result;
use crate::noise::{NoiseSource, uniform};
use std::path::{Path, PathBuf};
use wake_physics::{Scene, labels_of};

/// Rounds of the network that shuffles.
const ROUNDS: u32 = 6;

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

    /// The scenes that made the images, in order.
    pub fn scenes(&self) -> impl Iterator<Item = &Scene> {
        self.rows.iter().map(|(_, row)| &row.scene)
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
        let grid = &self.manifest.recipe.scene.grid;
        let path = self.path.join(&row.file_name);
        Ok(Pair {
            index: *index,
            image: read_image(&path, [grid.rows, grid.columns])?,
            prompt: row.text.clone(),
            labels: labels_of(&row.scene),
            scene: row.scene.clone(),
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

/// Which of `count` things comes at a position of an endless walk through them: each once in every round of `count`
/// positions, in another order each round. A function of (seed, position) alone.
///
/// - `count`: at least 1
///
/// A Feistel network permutes the numbers of an even number of bits; those that fall beyond `count` are permuted again
/// until they do not ("cycle walking").
///
/// # References
///
/// Black and Rogaway (2002), "Ciphers with Arbitrary Finite Domains".
pub(crate) fn shuffled(position: u64, count: u64, seed: u64) -> u64 {
    let source = NoiseSource::new(seed.wrapping_add(position / count));
    let bits = u64::BITS - count.saturating_sub(1).leading_zeros();
    let half = bits.div_ceil(2).max(1);
    let mut place = feistel(position % count, half, source);
    while place >= count {
        place = feistel(place, half, source);
    }
    place
}

/// A permutation of the numbers of 2·`half` bits.
fn feistel(number: u64, half: u32, source: NoiseSource) -> u64 {
    let size = 1u64 << half;
    let (mut left, mut right) = (number / size, number % size);
    for round in 0..ROUNDS {
        let mixed = (source.uniform(uniform::ORDER + round, right) * size as f64) as u64;
        (left, right) = (right, left ^ mixed);
    }
    left * size + right
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_place_comes_once_an_epoch() {
        for count in (1..70).chain([1000]) {
            let order =
                |seed| -> Vec<u64> { (0..count).map(|p| shuffled(p, count, seed)).collect() };
            let places: BTreeSet<u64> = order(3).into_iter().collect();
            assert_eq!(places, (0..count).collect());
            assert!(count < 10 || order(3) != order(4));
        }
    }

    /// Each place is equally likely for a position: χ² of 8 places over 4,000 orders below its 1e-5 quantile for 7
    /// degrees of freedom, 35.
    #[test]
    fn orders_are_even() {
        let mut counts = [0u32; 8];
        for seed in 0..4000 {
            counts[shuffled(3, 8, seed) as usize] += 1;
        }
        let chi2: f64 = counts
            .iter()
            .map(|&c| (f64::from(c) - 500.0).powi(2) / 500.0)
            .sum();
        assert!(chi2 < 35.0, "{counts:?}");
    }
}
