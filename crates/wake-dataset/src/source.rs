//! Sources of pairs: endless functions of a position.

use super::folder::{Epochs, Folder};
use super::pair::Pair;
use super::scenes::Simulated;
use crate::error::Result;
use rayon::prelude::*;
use std::fmt::Debug;
use std::ops::Range;
use std::sync::Arc;

/// An endless sequence of pairs, each with the scene that made its image: a pure function of the position.
///
/// Pair p does not depend on the order, the number or the grouping of requests.
pub trait Source: Debug + Send + Sync + 'static {
    /// Rows and columns of every image.
    fn size(&self) -> [usize; 2];

    /// Returns the pairs at a range of positions, in order; a batch is requested at once.
    ///
    /// # Errors
    ///
    /// If a pair cannot be made or read.
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

    /// In the order of the folder, starting again after its end.
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
