//! Training pairs of a data set, in endless epochs.

use std::ops::Range;
use std::path::Path;

use serde_json::{Value, json};
use wake_dataset::{Folder, Pair, Source, shuffled};

use crate::error::Result;

/// Every training pair of a folder once in each epoch, in a new order each time; validation pairs are never drawn.
#[derive(Debug)]
pub(super) struct TrainingData {
    folder: Folder,
    /// Positions of the training pairs.
    positions: Vec<u64>,
    seed: u64,
}

impl TrainingData {
    /// Opens a folder of `wake dataset`.
    ///
    /// # Errors
    ///
    /// As [`Folder::open`]; [`wake_nn::Error::OutOfRange`] for images of another size and for a set without training pairs.
    pub(super) fn open(path: &Path, seed: u64, size: usize) -> Result<Self> {
        let folder = Folder::open(path)?;
        let grid = &folder.manifest().recipe.scene.grid;
        let only = size as f64;
        wake_nn::check_range("grid.rows of the data set", grid.rows as f64, only, only)?;
        wake_nn::check_range(
            "grid.columns of the data set",
            grid.columns as f64,
            only,
            only,
        )?;
        let positions = folder.trainset();
        let most = folder.len() as f64;
        wake_nn::check_range(
            "number of training pairs of the data set",
            positions.len() as f64,
            1.0,
            most,
        )?;
        Ok(Self {
            folder,
            positions,
            seed,
        })
    }

    /// Identity of the pairs, for the record of a run.
    pub(super) fn identity(&self) -> Value {
        json!({"set": self.folder.manifest(), "pairs": self.positions.len()})
    }
}

impl Source for TrainingData {
    fn size(&self) -> [usize; 2] {
        self.folder.size()
    }

    fn items(&self, positions: Range<u64>) -> wake_dataset::Result<Vec<Pair>> {
        let count = self.positions.len() as u64;
        let of = |position| {
            let place = shuffled(position, count, self.seed) as usize;
            self.folder.pair(self.positions[place])
        };
        positions.map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wake_dataset::{Manifest, Recipe, write};

    /// A set of a few small scenes.
    fn set(folder: &Path) {
        let recipe = Recipe::default()
            .with_assignments(&["scene.grid.rows = 32", "scene.grid.columns = 32"]);
        let manifest = Manifest::new(recipe.unwrap(), 5, 8).unwrap();
        let manifest = manifest.with_val_share(0.25).unwrap();
        let source = manifest.source().unwrap();
        write(folder, &manifest, &source, 1, |_| {}).unwrap();
    }

    #[test]
    fn an_epoch_has_each_training_pair_once_and_no_other() {
        let folder = tempfile::tempdir().unwrap();
        set(folder.path());
        let data = TrainingData::open(folder.path(), 3, 32).unwrap();
        let training = Folder::open(folder.path()).unwrap().trainset();
        assert!(training.len() > 1 && training.len() < 8);
        let count = training.len() as u64;
        let mut orders = Vec::new();
        for epoch in 0..3 {
            let pairs = data.items(epoch * count..(epoch + 1) * count).unwrap();
            let order: Vec<u64> = pairs.iter().map(|pair| pair.index).collect();
            let mut sorted = order.clone();
            sorted.sort_unstable();
            assert_eq!(sorted, training);
            orders.push(order);
        }
        assert!(orders[0] != orders[1] || orders[1] != orders[2]);
        // A pair alone is the same as in a batch.
        let alone = data.items(2..3).unwrap();
        assert_eq!(alone[0].index, orders[0][2]);
    }

    #[test]
    fn images_of_another_size_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        set(folder.path());
        let error = TrainingData::open(folder.path(), 3, 256)
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("grid.rows of the data set") && error.contains("256"),
            "{error}"
        );
    }
}
