//! Pairs as tensors: the only file of the data set that knows burn.

use super::folder::{Epochs, Folder};
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

/// The first pairs of a source, as a data set of burn.
#[derive(Debug, Clone)]
pub struct Finite<S> {
    /// The source.
    pub source: S,
    /// How many pairs.
    pub length: usize,
}

impl<S: Source> Dataset<Pair> for Finite<S> {
    fn get(&self, index: usize) -> Result<Pair, DatasetError> {
        if index >= self.length {
            let message = format!("no pair {index}, there are {}", self.length);
            return Err(DatasetError::new(std::io::Error::other(message)));
        }
        self.source.pair(index as u64).map_err(DatasetError::new)
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

/// An endless sequence of pairs, each with the scene that made its image.
pub trait Source: Send + Sync + 'static {
    /// The pair at a position, always the same.
    ///
    /// # Errors
    ///
    /// If it cannot be made or read.
    fn pair(&self, position: u64) -> Result<Pair>;
}

impl Source for Simulated {
    fn pair(&self, position: u64) -> Result<Pair> {
        Self::pair(self, position)
    }
}

impl Source for Epochs {
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
    pub fn new(source: impl Source, loading: Loading, device: &Device) -> Result<Self> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::{Manifest, Recipe, write};
    use burn::data::dataloader::DataLoaderBuilder;

    fn source() -> Simulated {
        let changes = [
            "scene.grid.rows = 16",
            "scene.grid.columns = 24",
            "scene.grid.spacing = 20",
        ];
        Simulated::new(Recipe::default().with_assignments(&changes).unwrap(), 5).unwrap()
    }

    fn loading(threads: usize, start_index: u64) -> Loading {
        Loading {
            batch_size: 3,
            threads,
            start_index,
        }
    }

    /// Indices and pixels of the first batches.
    fn first(source: impl Source, loading: Loading, batches: usize) -> Vec<(Vec<u64>, Vec<f32>)> {
        let of = |batch: Batch| {
            assert_eq!(batch.images.dims(), [3, 1, 16, 24]);
            let indices = batch.pairs.iter().map(|pair| pair.index).collect();
            (indices, batch.images.into_data().try_to_vec().unwrap())
        };
        let loader = Batches::new(source, loading, &Device::default()).unwrap();
        loader
            .take(batches)
            .map(|batch| of(batch.unwrap()))
            .collect()
    }

    #[test]
    fn batches_do_not_depend_on_the_threads_and_start_anywhere() {
        let one = first(source(), loading(1, 0), 4);
        assert_eq!(one[3].0, [9, 10, 11]);
        for threads in [2, 3] {
            assert_eq!(first(source(), loading(threads, 0), 4), one);
        }
        assert_eq!(first(source(), loading(2, 6), 2), one[2..]);
    }

    #[test]
    fn images_are_the_grey_of_the_pairs_from_minus_one_to_one() {
        let batch = &first(source(), loading(2, 0), 1)[0].1;
        let greys = (0..3).flat_map(|i| source().pair(i).unwrap().image.pixels);
        let expected: Vec<f32> = greys.map(|grey| 2.0 * grey - 1.0).collect();
        assert_eq!(*batch, expected);
        assert!(batch.iter().all(|v| (-1.0..=1.0).contains(v)));
        let distinct = batch.iter().any(|v| (v - batch[0]).abs() > 0.01);
        assert!(distinct, "a picture, not one grey");
    }

    /// The same pairs through the data loader of burn, in its own order.
    #[test]
    fn burn_loads_them_too() {
        let device = Device::default();
        let loader = DataLoaderBuilder::new(ToBatch)
            .batch_size(3)
            .num_workers(2)
            .set_device(device)
            .build(Finite {
                source: source(),
                length: 6,
            });
        let mut batches: Vec<(Vec<u64>, Vec<f32>)> = loader
            .iter()
            .map(|batch| {
                let batch = batch.unwrap();
                let indices = batch.pairs.iter().map(|pair| pair.index).collect();
                (indices, batch.images.into_data().try_to_vec().unwrap())
            })
            .collect();
        batches.sort_by(|a, b| a.0.cmp(&b.0));
        assert_eq!(batches, first(source(), loading(1, 0), 2));
    }

    #[test]
    fn a_folder_is_walked_in_another_order_each_epoch() {
        let path = tempfile::tempdir().unwrap();
        let manifest = Manifest::new(source().recipe().clone(), 5, 6).unwrap();
        write(path.path(), &manifest, 2, |_| ()).unwrap();
        let folder = Folder::open(path.path()).unwrap();
        assert_eq!(Dataset::len(&folder), 6);
        assert_eq!(folder.get(2).unwrap().index, 2);
        let walk = |start| first(Epochs::new(folder.clone(), 9), loading(2, start), 6);
        let indices: Vec<u64> = walk(0).into_iter().flat_map(|batch| batch.0).collect();
        for epoch in indices.chunks(6) {
            let mut sorted = epoch.to_vec();
            sorted.sort_unstable();
            assert_eq!(sorted, [0, 1, 2, 3, 4, 5]);
        }
        assert_ne!(indices[..6], indices[6..12]);
        assert_eq!(walk(6)[..4], walk(0)[2..]);
    }
}
