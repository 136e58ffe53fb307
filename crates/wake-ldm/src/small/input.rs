//! Batches of conditions as tensors.

use burn::module::Module;
use burn::tensor::{Device, Tensor, TensorData};

use super::patches::PatchTransform;
use crate::conditioning::{
    Conditions, FEATURES, MapGrid, PATCH, PLACES, WAVES, features, places, wave_squares,
};

/// Latent pixels whose phases one thread computes at a time.
const CELLS_AT_ONCE: usize = 128;

/// Numbers of a batch, and where its latent pixels lie.
#[derive(Debug, Clone)]
pub struct Known {
    /// `[batch, FEATURES]`
    pub numbers: Tensor<2>,
    /// `[batch, PLACES, rows, columns]` of the latents.
    pub places: Tensor<4>,
}

impl Known {
    /// The numbers of some scenes, and the places of all their latent pixels.
    pub fn new(conditions: &[Conditions], grid: MapGrid, device: &Device) -> Self {
        let coarse = grid.size / PATCH;
        let cells = vec![grid.cells(); conditions.len()];
        Self::of_cells(conditions, grid, &cells, [coarse, coarse], device)
    }

    /// The numbers of some scenes, and the places of some of their latent pixels.
    ///
    /// - `cells`: which, for each scene, `shape[0] · shape[1]` of them
    pub fn of_cells(
        conditions: &[Conditions],
        grid: MapGrid,
        cells: &[Vec<usize>],
        [rows, columns]: [usize; 2],
        device: &Device,
    ) -> Self {
        let batch = conditions.len();
        let numbers: Vec<f32> = conditions.iter().flat_map(features).collect();
        let scenes: Vec<_> = conditions.iter().zip(cells).collect();
        let places = in_parallel(&scenes, |(c, cells)| places(c, grid, cells)).concat();
        let shape = [batch, PLACES, rows, columns];
        Self {
            numbers: Tensor::from_data(TensorData::new(numbers, [batch, FEATURES]), device),
            places: Tensor::from_data(TensorData::new(places, shape), device),
        }
    }
}

/// Phases of the wakes of some scenes at some of their latent pixels, encoded as an image would be; made on all cores.
///
/// - `cells`, `shape`: as in [`Known::of_cells`]
///
/// # Shapes
///
/// `[batch, WAVES · channels, rows, columns]`, on the device of `patches`
pub fn encoded_phases(
    conditions: &[Conditions],
    grid: MapGrid,
    cells: &[Vec<usize>],
    [rows, columns]: [usize; 2],
    patches: &PatchTransform,
) -> Tensor<4> {
    let parts: Vec<(&Conditions, &[usize])> = conditions
        .iter()
        .zip(cells)
        .flat_map(|(c, cells)| cells.chunks(CELLS_AT_ONCE).map(move |part| (c, part)))
        .collect();
    let squares = in_parallel(&parts, |(c, cells)| wave_squares(c, grid, cells)).concat();
    let (batch, pixels) = (conditions.len(), PATCH * PATCH);
    let shape = [squares.len() / pixels, pixels];
    let device = patches.devices().into_iter().next().unwrap_or_default();
    let squares = Tensor::from_data(TensorData::new(squares, shape), &device);
    let latents: Tensor<2> = patches.encode_rows(squares);
    let [_, channels] = latents.dims();
    latents
        .reshape([batch, rows * columns, WAVES * channels])
        .swap_dims(1, 2)
        .reshape([batch, WAVES * channels, rows, columns])
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
