//! Where pairs come from: functions of a position, endless, or cut to a length for burn's own loaders.

use super::folder::{Epochs, Folder};
use super::pair::Pair;
use super::scenes::Simulated;
use crate::error::Result;
use burn::data::dataset::{Dataset, DatasetError};
use rayon::prelude::*;
use std::fmt::Debug;
use std::ops::Range;
use std::sync::Arc;

/// An endless sequence of pairs, each with the scene that made its image: a pure function of the position.
///
/// Pair p is the same whoever asks for it, how often, in whichever order and together with whichever others.
pub trait Source: Debug + Send + Sync + 'static {
    /// Rows and columns of every image.
    fn size(&self) -> [usize; 2];

    /// The pairs at a range of positions, in order; those of a batch are asked for at once.
    ///
    /// # Errors
    ///
    /// If one cannot be made or read.
    fn items(&self, positions: Range<u64>) -> Result<Vec<Pair>>;
}

impl Source for Simulated {
    fn size(&self) -> [usize; 2] {
        let grid = &self.recipe().scene.grid;
        [grid.rows, grid.columns]
    }

    fn items(&self, positions: Range<u64>) -> Result<Vec<Pair>> {
        positions.into_par_iter().map(|p| self.pair(p)).collect()
    }
}

impl Source for Folder {
    fn size(&self) -> [usize; 2] {
        let grid = &self.manifest().recipe.scene.grid;
        [grid.rows, grid.columns]
    }

    /// In the order of the folder, from its beginning again after its end.
    fn items(&self, positions: Range<u64>) -> Result<Vec<Pair>> {
        let count = self.len().max(1);
        let pairs = positions.into_par_iter().map(|p| self.pair(p % count));
        pairs.collect()
    }
}

impl Source for Epochs {
    fn size(&self) -> [usize; 2] {
        self.folder().size()
    }

    fn items(&self, positions: Range<u64>) -> Result<Vec<Pair>> {
        positions.into_par_iter().map(|p| self.pair(p)).collect()
    }
}

impl<S: Source + ?Sized> Source for Arc<S> {
    fn size(&self) -> [usize; 2] {
        (**self).size()
    }

    fn items(&self, positions: Range<u64>) -> Result<Vec<Pair>> {
        (**self).items(positions)
    }
}

/// The first pairs of a source, as a data set of burn: for its `DataLoader`, and its way to shuffle.
#[derive(Debug, Clone)]
pub struct Finite<S> {
    /// The source.
    pub source: S,
    /// How many pairs.
    pub length: usize,
}

impl<S: Source> Dataset<Pair> for Finite<S> {
    fn get(&self, index: usize) -> Result<Pair, DatasetError> {
        let position = index as u64;
        let pairs = match index < self.length {
            true => self.source.items(position..position + 1),
            false => Ok(Vec::new()),
        };
        let pair = pairs.map_err(DatasetError::new)?.pop();
        pair.ok_or_else(|| {
            let message = format!("no pair {index}, there are {}", self.length);
            DatasetError::new(std::io::Error::other(message))
        })
    }

    fn len(&self) -> usize {
        self.length
    }
}

impl Dataset<Pair> for Folder {
    fn get(&self, index: usize) -> Result<Pair, DatasetError> {
        self.pair(index as u64).map_err(DatasetError::new)
    }

    fn len(&self) -> usize {
        Self::len(self) as usize
    }
}
