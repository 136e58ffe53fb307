//! Pairs as tensors: the only file of the data set that knows burn.

use super::epochs::Epochs;
use super::folder::Folder;
use super::ordered::Ordered;
use super::pair::Pair;
use super::scenes::Simulated;
use crate::error::Result;
use burn::data::dataloader::batcher::Batcher;
use burn::data::dataset::{Dataset, DatasetError};
use burn::tensor::{Device, Tensor, TensorData};

/// Some pairs, their images as one tensor.
#[derive(Debug, Clone)]
pub struct Batch {
    /// Grey scaled to −1…1, `[batch, 1, rows, columns]`.
    pub images: Tensor<4>,
    /// The pairs; their images moved to the tensor and have no pixels here.
    pub pairs: Vec<Pair>,
}

/// Makes a [`Batch`] of pairs of the same size; also for burn's own data loaders.
#[derive(Debug, Clone, Copy, Default)]
pub struct ToBatch;

impl Batcher<Pair, Batch> for ToBatch {
    fn batch(&self, mut pairs: Vec<Pair>, device: &Device) -> Batch {
        let [rows, columns] = pairs
            .first()
            .map_or([0, 0], |pair| [pair.image.rows, pair.image.columns]);
        let mut values = Vec::with_capacity(pairs.len() * rows * columns);
        for pair in &mut pairs {
            let pixels = std::mem::take(&mut pair.image.pixels);
            values.extend(pixels.into_iter().map(|grey| 2.0 * grey - 1.0));
        }
        let data = TensorData::new(values, [pairs.len(), 1, rows, columns]);
        Batch {
            images: Tensor::from_data(data, device),
            pairs,
        }
    }
}

/// Endless: [`burn::data::dataset::transform::PartialDataset`] cuts an epoch out of it.
impl Dataset<Pair> for Simulated {
    fn get(&self, index: usize) -> Result<Pair, DatasetError> {
        self.pair(index as u64).map_err(DatasetError::new)
    }

    fn len(&self) -> usize {
        usize::MAX
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

/// An endless sequence of pairs.
pub trait Endless: Send + Sync + 'static {
    /// The pair at a position, always the same.
    ///
    /// # Errors
    ///
    /// If it cannot be made or read.
    fn pair(&self, position: u64) -> Result<Pair>;
}

impl Endless for Simulated {
    fn pair(&self, position: u64) -> Result<Pair> {
        Self::pair(self, position)
    }
}

impl Endless for Epochs {
    fn pair(&self, position: u64) -> Result<Pair> {
        Self::pair(self, position)
    }
}

/// How [`Batches`] loads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Loading {
    /// Pairs of a batch.
    pub batch_size: usize,
    /// Threads that make pairs.
    pub threads: usize,
    /// Position of the first pair: the number of pairs that an interrupted run has seen.
    pub start_index: u64,
}

impl Default for Loading {
    fn default() -> Self {
        Self {
            batch_size: 16,
            threads: 1,
            start_index: 0,
        }
    }
}

/// An endless iterator of batches, simulated or read ahead on other threads.
///
/// Batch b holds the pairs `start_index + b·batch_size` onward, in order, however many threads there are.
#[derive(Debug)]
pub struct Batches {
    pairs: Ordered<Pair>,
    batch_size: usize,
    device: Device,
}

impl Batches {
    /// Starts the threads.
    ///
    /// # Errors
    ///
    /// [`Error::Threads`](crate::Error::Threads) if the system gives no thread.
    pub fn new(source: impl Endless, loading: Loading, device: &Device) -> Result<Self> {
        let indices = loading.start_index..u64::MAX;
        let pairs = Ordered::new(indices, loading.threads, move |index| source.pair(index))?;
        Ok(Self {
            pairs,
            batch_size: loading.batch_size.max(1),
            device: device.clone(),
        })
    }
}

impl Iterator for Batches {
    type Item = Result<Batch>;

    fn next(&mut self) -> Option<Self::Item> {
        let pairs: Result<Vec<Pair>> = self.pairs.by_ref().take(self.batch_size).collect();
        Some(pairs.map(|pairs| ToBatch.batch(pairs, &self.device)))
    }
}
