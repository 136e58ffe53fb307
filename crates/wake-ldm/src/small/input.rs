//! Batches of conditions as tensors.

use burn::tensor::{Tensor, TensorData};

use crate::conditioning::{Conditions, FEATURES, MapGrid, PLACES, features, places};

/// What is known of the scenes of a batch.
#[derive(Debug, Clone)]
pub struct Known {
    /// Their numbers, `[batch, FEATURES]`.
    pub numbers: Tensor<2>,
    /// Where the pixels of the latents lie, `[batch, PLACES, rows, columns]`.
    pub places: Tensor<4>,
    /// Latents of the images expected of them, `[batch, channels, rows, columns]`.
    pub wake: Tensor<4>,
}

impl Known {
    /// What is known of some scenes at all their latent pixels.
    ///
    /// - `wake`: see [`expected_latents`](super::expected_latents); its device is that of the result
    pub fn new(conditions: &[Conditions], grid: MapGrid, wake: Tensor<4>) -> Self {
        let cells = vec![grid.cells(); conditions.len()];
        Self::of_cells(conditions, grid, &cells, wake)
    }

    /// What is known of some scenes at some of their latent pixels.
    ///
    /// - `cells`: which, for each scene
    /// - `wake`: at these pixels, `[batch, channels, rows, columns]`
    pub fn of_cells(
        conditions: &[Conditions],
        grid: MapGrid,
        cells: &[Vec<usize>],
        wake: Tensor<4>,
    ) -> Self {
        let ([batch, _, rows, columns], device) = (wake.dims(), wake.device());
        let numbers: Vec<f32> = conditions.iter().flat_map(features).collect();
        let scenes: Vec<_> = conditions.iter().zip(cells).collect();
        let places = in_parallel(&scenes, |(c, cells)| places(c, grid, cells)).concat();
        let shape = [batch, PLACES, rows, columns];
        Self {
            numbers: Tensor::from_data(TensorData::new(numbers, [batch, FEATURES]), &device),
            places: Tensor::from_data(TensorData::new(places, shape), &device),
            wake,
        }
    }
}

/// A function of every item, on as many threads as there are cores.
pub(crate) fn in_parallel<T: Sync, R: Send>(items: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_in_parallel_keeps_the_order() {
        let items: Vec<usize> = (0..7).collect();
        assert_eq!(in_parallel(&items, |i| i * i), [0, 1, 4, 9, 16, 25, 36]);
        assert!(in_parallel(&[] as &[usize], |i| *i).is_empty());
    }
}
