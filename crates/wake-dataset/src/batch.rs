//! Batches of pairs as tensors.
//!
//! ```
//! use burn::tensor::Device;
//! use wake_dataset::{Loader, Recipe, Simulated};
//!
//! let recipe = Recipe::default().with_assignments(&["scene.grid.rows = 32", "scene.grid.columns = 32"])?;
//! let source = Simulated::new(recipe, 7)?;
//! let mut batches = Loader::new(source).batch(2).threads(2).on(&Device::default())?;
//! let batch = batches.next().expect("there is always a next one")?;
//! assert_eq!(batch.images.dims(), [2, 1, 32, 32]);
//! println!("{:?}, {:?}", batch.scenes[0].ships, batch.objects[0]);
//! # Ok::<(), wake_dataset::Error>(())
//! ```

use super::loader::Loader;
use super::ordered::Ordered;
use super::pair::Pair;
use super::source::Source;
use crate::error::Result;
use burn::data::dataloader::batcher::Batcher;
use burn::tensor::{Device, Tensor, TensorData};
use wake_physics::Scene;
use wake_physics::labels::Object;

/// A batch of images as one tensor, with labels, scenes and prompts.
#[derive(Debug, Clone)]
pub struct Batch {
    /// Grey 0…1, `[batch, 1, rows, columns]`.
    pub images: Tensor<4>,
    /// Upright boxes of all objects, `[objects, 6]`: index of the image in the batch, class (0 wake, 1 ship), and left, top,
    /// width and height \[pixels\].
    pub boxes: Tensor<2>,
    /// Labelled boxes of each image.
    pub objects: Vec<Vec<Object>>,
    /// The scene of each image.
    pub scenes: Vec<Scene>,
    /// The prompt of each image.
    pub prompts: Vec<String>,
}

/// Makes a [`Batch`] from pairs of the same size; also usable with burn's data loaders.
#[derive(Debug, Clone, Copy, Default)]
pub struct ToBatch;

impl Batcher<Pair, Batch> for ToBatch {
    fn batch(&self, pairs: Vec<Pair>, device: &Device) -> Batch {
        let count = pairs.len();
        let [rows, columns] = pairs
            .first()
            .map_or([0, 0], |pair| [pair.image.rows, pair.image.columns]);
        let mut values: Vec<f32> = Vec::with_capacity(count * rows * columns);
        let (mut objects, mut scenes, mut prompts) = (Vec::new(), Vec::new(), Vec::new());
        for pair in pairs {
            values.extend(&pair.image.pixels);
            objects.push(pair.labels.objects());
            scenes.push(pair.scene);
            prompts.push(pair.prompt);
        }
        let images = TensorData::new(values, [count, 1, rows, columns]);
        Batch {
            images: Tensor::from_data(images, device),
            boxes: Tensor::from_data(boxes(&objects), device),
            objects,
            scenes,
            prompts,
        }
    }
}

/// The rows of [`Batch::boxes`].
fn boxes(objects: &[Vec<Object>]) -> TensorData {
    let rows = objects.iter().enumerate().flat_map(|(image, objects)| {
        objects.iter().map(move |object| {
            let [left, top, width, height] = object.box_px.map(|x| x as f32);
            let class = object.class.number() as f32;
            [image as f32, class, left, top, width, height]
        })
    });
    let rows: Vec<[f32; 6]> = rows.collect();
    TensorData::new(rows.concat(), [rows.len(), 6])
}

impl<S: Source> Loader<S> {
    /// Starts the threads and returns batches with their tensors on `device`.
    ///
    /// # Errors
    ///
    /// [`Error::Threads`](crate::Error::Threads) if a thread cannot be started.
    pub fn on(self, device: &Device) -> Result<Batches> {
        Ok(Batches {
            pairs: self.ordered()?,
            device: device.clone(),
        })
    }
}

/// Endless batches of a [`Loader`]; up to four per thread are made ahead.
#[derive(Debug)]
pub struct Batches {
    pairs: Ordered<Vec<Pair>>,
    device: Device,
}

impl Iterator for Batches {
    type Item = Result<Batch>;

    fn next(&mut self) -> Option<Self::Item> {
        let pairs = self.pairs.next()?;
        Some(pairs.map(|pairs| ToBatch.batch(pairs, &self.device)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Epochs, Finite, Folder, Manifest, Mixture, Recipe, Simulated, write};
    use burn::data::dataloader::DataLoaderBuilder;
    use burn::data::dataset::Dataset;
    use std::collections::BTreeSet;
    use std::sync::Arc;

    fn source() -> Simulated {
        let changes = [
            "scene.grid.rows = 16",
            "scene.grid.columns = 24",
            "scene.grid.spacing = 20",
        ];
        Simulated::new(Recipe::default().with_assignments(&changes).unwrap(), 5).unwrap()
    }

    /// Seeds of the scenes, numbers of objects, and pixels.
    type Told = (Vec<u64>, Vec<usize>, Vec<f32>);

    fn told(batch: Batch) -> Told {
        assert_eq!(batch.images.dims(), [3, 1, 16, 24]);
        let seeds = batch.scenes.iter().map(|scene| scene.seed).collect();
        let objects = batch.objects.iter().map(Vec::len).collect();
        (
            seeds,
            objects,
            batch.images.into_data().try_to_vec().unwrap(),
        )
    }

    /// The first batches.
    fn first(source: impl Source, threads: usize, start: u64, steps: usize) -> Vec<Told> {
        let loader = Loader::new(source).batch(3).threads(threads).start(start);
        let batches = loader.on(&Device::default()).unwrap();
        batches
            .take(steps)
            .map(|batch| told(batch.unwrap()))
            .collect()
    }

    fn folder(count: u64) -> (tempfile::TempDir, Folder) {
        let path = tempfile::tempdir().unwrap();
        let manifest = Manifest::new(source().recipe().clone(), 5, count).unwrap();
        let source = manifest.source().unwrap();
        write(path.path(), &manifest, &source, 2, |_| ()).unwrap();
        let folder = Folder::open(path.path()).unwrap();
        (path, folder)
    }

    #[test]
    fn batches_do_not_depend_on_the_threads_and_start_at_any_step() {
        let (_path, folder) = folder(6);
        let sources: [Arc<dyn Source>; 4] = [
            Arc::new(source()),
            Arc::new(folder.clone()),
            Arc::new(Epochs::new(folder.clone(), 3)),
            Arc::new(
                Mixture::new(vec![(2.0, Arc::new(source())), (1.0, Arc::new(folder))]).unwrap(),
            ),
        ];
        for source in sources {
            let one = first(Arc::clone(&source), 1, 0, 5);
            for threads in [2, 3] {
                assert_eq!(first(Arc::clone(&source), threads, 0, 5), one);
            }
            assert_eq!(first(Arc::clone(&source), 2, 3, 2), one[3..]);
        }
    }

    #[test]
    fn images_are_the_grey_of_the_pairs_and_objects_those_of_their_labels() {
        let (seeds, objects, pixels) = first(source(), 2, 0, 1).remove(0);
        let pairs = source().items(0..3).unwrap();
        let greys = pairs.iter().flat_map(|pair| &pair.image.pixels);
        assert_eq!(pixels, greys.copied().collect::<Vec<f32>>());
        let distinct = pixels.iter().any(|v| (v - pixels[0]).abs() > 0.01);
        assert!(distinct, "a picture, not one grey");
        let scenes: Vec<u64> = pairs.iter().map(|pair| pair.scene.seed).collect();
        assert_eq!(seeds, scenes);
        let found: Vec<usize> = pairs.iter().map(|p| p.labels.objects().len()).collect();
        assert_eq!(objects, found);
    }

    /// Each row holds the image, class and box of one object.
    #[test]
    fn boxes_are_those_of_the_objects() {
        // Large enough for a wake to be visible in two rows of windows.
        let sizes = [
            "scene.grid.rows = 64",
            "scene.grid.columns = 64",
            "scene.grid.spacing = 8",
        ];
        let recipe = Recipe::default().with_assignments(&sizes).unwrap();
        let source = Simulated::new(recipe, 5).unwrap();
        let batch = ToBatch.batch(source.items(0..30).unwrap(), &Device::default());
        let rows: Vec<f32> = batch.boxes.clone().into_data().try_to_vec().unwrap();
        let mut rows = rows.chunks(6);
        assert_eq!(
            batch.boxes.dims()[0],
            batch.objects.iter().map(Vec::len).sum::<usize>()
        );
        for (image, objects) in batch.objects.iter().enumerate() {
            for object in objects {
                let [left, top, width, height] = object.box_px;
                let class = f64::from(object.class.number());
                let expected = [image as f64, class, left, top, width, height];
                let row = rows.next().unwrap();
                for (found, expected) in row.iter().zip(expected) {
                    // Rounding of f32 up to 64 pixels.
                    assert!((f64::from(*found) - expected).abs() < 1e-5, "{row:?}");
                }
            }
        }
        assert!(batch.boxes.dims()[0] > 2, "hardly any object");
    }

    /// burn's data loader gives the same pairs, in its own order.
    #[test]
    fn burn_loads_them_too() {
        let loader = DataLoaderBuilder::new(ToBatch)
            .batch_size(3)
            .num_workers(2)
            .set_device(Device::default())
            .build(Finite {
                source: source(),
                length: 6,
            });
        let mut batches: Vec<Told> = loader.iter().map(|batch| told(batch.unwrap())).collect();
        batches.sort_by(|a, b| a.0.cmp(&b.0));
        let mut expected = first(source(), 1, 0, 2);
        expected.sort_by(|a, b| a.0.cmp(&b.0));
        assert_eq!(batches, expected);
    }

    /// burn's shuffle gives every pair of the given length once, in an order that depends on its seed.
    #[test]
    fn burn_shuffles_them() {
        let seeds = |shuffle: u64| -> Vec<u64> {
            let loader = DataLoaderBuilder::new(ToBatch)
                .batch_size(3)
                .shuffle(shuffle)
                .set_device(Device::default())
                .build(Finite {
                    source: source(),
                    length: 12,
                });
            let batches = loader.iter().map(|batch| told(batch.unwrap()).0);
            batches.flatten().collect()
        };
        let all: BTreeSet<u64> = (0..12)
            .map(|i| source().pair(i).unwrap().scene.seed)
            .collect();
        assert_eq!(seeds(1).into_iter().collect::<BTreeSet<u64>>(), all);
        assert_eq!(seeds(1), seeds(1));
        assert_ne!(seeds(1), seeds(2));
        let beyond = Finite {
            source: source(),
            length: 2,
        };
        assert!(beyond.get(2).unwrap_err().to_string().contains("no pair 2"));
    }

    #[test]
    fn a_folder_is_walked_in_order_or_in_another_one_each_epoch() {
        let (_path, folder) = folder(6);
        assert_eq!(Dataset::len(&folder), 6);
        assert_eq!(folder.get(2).unwrap().index, 2);
        let walk = |source: &dyn Source| -> Vec<u64> {
            let pairs = source.items(0..18).unwrap();
            pairs.iter().map(|pair| pair.index).collect()
        };
        assert_eq!(walk(&folder), [0, 1, 2, 3, 4, 5].repeat(3));
        let walked = walk(&Epochs::new(folder, 9));
        for epoch in walked.chunks(6) {
            let mut sorted = epoch.to_vec();
            sorted.sort_unstable();
            assert_eq!(sorted, [0, 1, 2, 3, 4, 5]);
        }
        assert_ne!(walked[..6], walked[6..12]);
    }
}
