//! Sources of a given length, and folders, as data sets for burn's loaders.

use crate::folder::Folder;
use crate::pair::Pair;
use crate::source::Source;
use burn::data::dataset::{Dataset, DatasetError};

/// The first pairs of a source as a burn data set, for burn's `DataLoader` and shuffling.
#[derive(Debug, Clone)]
pub struct Finite<S> {
    /// The source.
    pub source: S,
    /// Number of pairs.
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
            let message = format!(
                "there is no pair {index}; the source has {} pairs, counted from 0",
                self.length
            );
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
