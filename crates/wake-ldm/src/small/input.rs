//! Batches of conditions as tensors.

use burn::tensor::{Device, Int, Tensor, TensorData};

use crate::conditioning::{
    Conditions, FEATURES, MapGrid, PATCH, PLACES, Vocabulary, WAVES, WakeMaps, features,
};

/// Numbers of a batch, and what follows from them.
#[derive(Debug, Clone)]
pub struct Known {
    /// `[batch, FEATURES]`
    pub numbers: Tensor<2>,
    /// Phases, a square of pixels as channels: `[batch, WAVES · 64, rows, columns]` of the latents.
    pub waves: Tensor<4>,
    /// `[batch, PLACES, rows, columns]` of the latents.
    pub places: Tensor<4>,
}

/// Prompts of a batch.
#[derive(Debug, Clone)]
pub struct Words {
    /// Compact ids `[batch, tokens]`.
    pub ids: Tensor<2, Int>,
}

/// What the model sees beside the noisy latents.
#[derive(Debug, Clone)]
pub struct ModelInput {
    /// Noisy latents `[batch, channels, rows, columns]`.
    pub latents: Tensor<4>,
    /// Noise level σ of each, 0 to 1: `[batch]`.
    pub sigma: Tensor<1>,
}

impl Known {
    /// The numbers of some scenes; maps are made on all cores.
    pub fn new(conditions: &[Conditions], grid: MapGrid, device: &Device) -> Self {
        let maps: Vec<WakeMaps> = in_parallel(conditions, |c| WakeMaps::new(c, grid));
        let (batch, coarse) = (conditions.len(), grid.size / PATCH);
        let numbers: Vec<f32> = conditions.iter().flat_map(features).collect();
        let mut waves = Vec::with_capacity(batch * WAVES * grid.size * grid.size);
        maps.iter()
            .for_each(|map| waves.extend(squares(&map.waves, grid.size)));
        let places: Vec<f32> = maps.into_iter().flat_map(|map| map.places).collect();
        let tensor =
            |numbers, shape: [usize; 4]| Tensor::from_data(TensorData::new(numbers, shape), device);
        Self {
            numbers: Tensor::from_data(TensorData::new(numbers, [batch, FEATURES]), device),
            waves: tensor(waves, [batch, WAVES * PATCH * PATCH, coarse, coarse]),
            places: tensor(places, [batch, PLACES, coarse, coarse]),
        }
    }

    /// The same for some scenes, and nothing known of the others.
    ///
    /// - `shown`: 1 or 0 for each scene, `[batch, 1]`
    pub fn only(self, shown: Tensor<2>) -> Self {
        let of_image = shown.clone().reshape([-1, 1, 1, 1]);
        Self {
            numbers: self.numbers * shown,
            waves: self.waves * of_image.clone(),
            places: self.places * of_image,
        }
    }
}

impl Words {
    /// Prompts as CLIP's ids, each of the same length.
    pub fn new(prompts: &[Vec<u32>], vocabulary: &Vocabulary, device: &Device) -> Self {
        let tokens = prompts.first().map_or(0, Vec::len);
        let ids: Vec<i64> = prompts
            .iter()
            .flatten()
            .map(|&id| vocabulary.compact(id) as i64)
            .collect();
        Self {
            ids: Tensor::from_data(TensorData::new(ids, [prompts.len(), tokens]), device),
        }
    }
}

/// Squares of pixels as channels, on the host: `[maps, size, size]` to `[maps · 64, size / 8, size / 8]`.
fn squares(maps: &[f32], size: usize) -> Vec<f32> {
    let coarse = size / PATCH;
    let mut out = Vec::with_capacity(maps.len());
    for map in maps.chunks(size * size) {
        for (i, j) in (0..PATCH * PATCH).map(|p| (p / PATCH, p % PATCH)) {
            for row in 0..coarse {
                let start = (row * PATCH + i) * size + j;
                out.extend(map[start..].iter().step_by(PATCH).take(coarse));
            }
        }
    }
    out
}

/// A function of every item, on as many threads as there are cores.
fn in_parallel<T: Sync, R: Send>(items: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let share = items.len().div_ceil(threads).max(1);
    let work = &work;
    std::thread::scope(|scope| {
        let parts: Vec<_> = items
            .chunks(share)
            .map(|part| scope.spawn(move || part.iter().map(work).collect::<Vec<R>>()))
            .collect();
        let joined = parts.into_iter().flat_map(|part| match part.join() {
            Ok(results) => results,
            Err(panic) => std::panic::resume_unwind(panic),
        });
        joined.collect()
    })
}

#[cfg(all(test, feature = "flex"))]
mod tests {
    use super::*;
    use crate::autoencoder::patch::space_to_depth;

    #[test]
    fn squares_on_the_host_are_those_of_the_tensor() {
        let values: Vec<f32> = (0..2 * 24 * 24).map(|i| i as f32).collect();
        let data = TensorData::new(values.clone(), [1, 2, 24, 24]);
        let expected = space_to_depth(Tensor::from_data(data, &Device::flex()), PATCH);
        let expected: Vec<f32> = expected.into_data().iter::<f32>().collect();
        assert_eq!(squares(&values, 24), expected);
    }

    #[test]
    fn work_in_parallel_keeps_the_order() {
        let items: Vec<usize> = (0..7).collect();
        assert_eq!(in_parallel(&items, |i| i * i), [0, 1, 4, 9, 16, 25, 36]);
        assert!(in_parallel(&[] as &[usize], |i| *i).is_empty());
    }
}
