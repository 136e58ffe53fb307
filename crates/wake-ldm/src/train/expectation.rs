//! The prior learns mean and spread of the latents.

use std::ops::Range;

use burn::tensor::{Device, Tensor, TensorData};

use super::latents::LatentSet;
use super::order::examples;
use super::run::{Task, Terms, number};
use crate::conditioning::{Conditions, MapGrid, WEDGE, places};
use crate::network::{Known, Prior};
use crate::noise::NoiseSource;

/// Stream that latent pixels are drawn from.
const CELL_STREAM: u32 = 2001;
/// Latent pixels of an image that a step looks at.
const CELLS: usize = 64;

/// Learning mean and spread by the likelihood of the latents, and the mean grey by its squared error.
///
/// ```text
/// loss = mean[½ (z − μ)²/⌊s⌋] + mean[½ ((z − ⌊μ⌋)/s)² + ln s] + ½ (10 (grey − found))²
/// ```
///
/// ⌊ ⌋ counts as a constant. With the likelihood alone, ½ ((z − μ)/s)² in the first mean, a wake not yet learnt would be
/// taken for a rough sea, and hardly be learnt any more. Many scenes, few pixels of each: the network sees one latent
/// pixel at a time.
///
/// # References
///
/// Nix & Weigend (1994), "Estimating the Mean and Variance of the Target Probability Distribution", Eq. 4; Seitzer et
/// al. (2022), "On the Pitfalls of Heteroscedastic Uncertainty Estimation with Probabilistic Neural Networks", Eq. 5,
/// β = ½.
#[derive(Debug)]
pub struct PriorTask<'a> {
    /// The latents.
    pub set: &'a LatentSet,
    /// Pixels of the images.
    pub grid: MapGrid,
    /// Seed of the order.
    pub seed: u64,
}

impl PriorTask<'_> {
    /// Latent pixels to learn from: half of them anywhere, half inside the wedge, if there is one.
    fn cells(&self, conditions: &Conditions, position: u64) -> Vec<usize> {
        let random = NoiseSource::new(self.seed);
        let all = self.grid.cells();
        let places = places(conditions, self.grid, &all);
        let inside = &places[WEDGE * all.len()..][..all.len()];
        let wedge: Vec<usize> = all.iter().copied().filter(|&c| inside[c] > 0.5).collect();
        let draw = |i: usize| {
            let from = if i.is_multiple_of(2) && !wedge.is_empty() {
                &wedge
            } else {
                &all
            };
            let at = random.uniform(CELL_STREAM, position * CELLS as u64 + i as u64);
            from[(at * from.len() as f64) as usize]
        };
        (0..CELLS).map(draw).collect()
    }
}

impl Task<Prior> for PriorTask<'_> {
    fn loss(&self, model: &Prior, device: &Device, positions: Range<u64>) -> (Tensor<1>, Terms) {
        let indices = examples(self.seed, positions.clone(), self.set.len());
        let conditions: Vec<Conditions> = indices
            .iter()
            .map(|&i| self.set.example(i).conditions)
            .collect();
        let cells: Vec<Vec<usize>> = conditions
            .iter()
            .zip(positions)
            .map(|(conditions, position)| self.cells(conditions, position))
            .collect();
        let tensor = |pixels: fn(&LatentSet, usize, &[usize]) -> Vec<f32>| -> Tensor<4> {
            let pairs = indices.iter().zip(&cells);
            let numbers = pairs.flat_map(|(&i, cells)| pixels(self.set, i, cells));
            let shape = [indices.len(), self.set.shape()[0], CELLS, 1];
            Tensor::from_data(TensorData::new(numbers.collect(), shape), device)
        };
        let wake = tensor(LatentSet::expected_pixels);
        let expected = model.forward(&Known::of_cells(&conditions, self.grid, &cells, wake));
        let latents = tensor(LatentSet::pixels);
        let off = latents - expected.mean;
        let error = number(&off.clone().square().mean());
        let log_spread = expected.log_spread;
        let spread = log_spread.clone().detach().exp();
        let steady = (off.clone().square() / spread).mean() * 0.5;
        let scaled = off.detach() * log_spread.clone().neg().exp();
        let surprise = (scaled.square() * 0.5 + log_spread).mean();
        let greys: Vec<f32> = indices.iter().map(|&i| self.set.example(i).grey).collect();
        let count = greys.len();
        let greys: Tensor<2> = Tensor::from_data(TensorData::new(greys, [count, 1]), device);
        let grey = (expected.grey - greys).square().mean();
        let terms = vec![
            ("surprise", number(&surprise)),
            ("error", error),
            ("grey", number(&grey)),
        ];
        (steady + surprise + grey * 50.0, terms)
    }
}
