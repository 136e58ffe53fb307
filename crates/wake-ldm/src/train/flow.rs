//! The flow learns to turn noise into residuals.

use std::ops::Range;

use burn::tensor::{Device, Tensor, TensorData};

use super::latents::LatentSet;
use super::loss::noise_level;
use super::order::{examples, noise_of};
use super::run::{Task, Terms, number};
use crate::conditioning::{Conditions, MapGrid};
use crate::noise::{NoiseSource, normal_batch};
use crate::small::{Flow, Known};

/// Stream of the noise that images are mixed with.
const NOISE_STREAM: u32 = 2002;

/// Learning the velocity of the flow by its squared error.
///
/// ```text
/// x = (1 − σ) r + σ n,    loss = |v(x, σ, numbers) − (n − r)|²
/// ```
///
/// # References
///
/// Lipman et al. (2023), "Flow Matching for Generative Modeling", Eq. 23.
#[derive(Debug)]
pub struct FlowTask<'a> {
    /// The residuals.
    pub set: &'a LatentSet,
    /// Pixels of the images.
    pub grid: MapGrid,
    /// Seed of order, noise and noise levels.
    pub seed: u64,
}

impl Task<Flow> for FlowTask<'_> {
    fn loss(&self, model: &Flow, device: &Device, positions: Range<u64>) -> (Tensor<1>, Terms) {
        let random = NoiseSource::new(self.seed);
        let indices = examples(self.seed, positions.clone(), self.set.len());
        let conditions: Vec<Conditions> = indices
            .iter()
            .map(|&i| self.set.example(i).conditions)
            .collect();
        let levels: Vec<f32> = positions
            .clone()
            .map(|p| noise_level(random, p) as f32)
            .collect();
        let sources: Vec<NoiseSource> = positions.map(|p| noise_of(self.seed, p)).collect();
        let noise = normal_batch(&sources, NOISE_STREAM, self.set.shape(), device);
        let residual = self.set.latents(&indices, device);
        let count = levels.len();
        let sigma: Tensor<1> = Tensor::from_data(TensorData::new(levels, [count]), device);
        let level = sigma.clone().reshape([-1, 1, 1, 1]);
        let x = residual.clone() * (level.clone().neg() + 1.0) + noise.clone() * level;
        let told = model.told(&Known::new(&conditions, self.grid, device));
        let error = model.velocity(x, sigma, &told) - (noise - residual);
        let loss = error.square().mean();
        let terms = vec![("flow", number(&loss))];
        (loss, terms)
    }
}
