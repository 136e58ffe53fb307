//! The flow learns to turn noise into residuals.

use std::f32::consts::FRAC_PI_2;
use std::ops::Range;

use burn::tensor::{Device, Tensor, TensorData};
use rayon::prelude::*;

use super::latents::LatentSet;
use super::loss::noise_level;
use super::order::{examples, noise_of};
use super::run::{Task, Terms, number};
use crate::conditioning::Conditions;
use crate::network::{Flow, Known, PatchTransform, WakeModelConfig, sea_noise};
use crate::noise::NoiseSource;

/// Learning the velocity of the flow by its squared error.
///
/// ```text
/// φ = πσ/2,    x = cos φ r + sin φ n,    loss = |v(x, σ, numbers) − (cos φ n − sin φ r)|²
/// ```
///
/// with n Gaussian noise like the scene's sea. A batch whose noise cannot be made has a loss that is not a number, and is passed over.
///
/// # References
///
/// Albergo, Boffi & Vanden-Eijnden (2023), "Stochastic Interpolants"; Salimans & Ho (2022), "Progressive
/// Distillation for Fast Sampling of Diffusion Models" (v).
#[derive(Debug)]
pub struct FlowTask<'a> {
    /// The residuals.
    pub set: &'a LatentSet,
    /// What they were encoded with, outside autodiff.
    pub patches: &'a PatchTransform,
    /// The model.
    pub config: &'a WakeModelConfig,
    /// Seed of order, noise and noise levels.
    pub seed: u64,
}

impl FlowTask<'_> {
    /// The noise at some positions, made on all cores.
    fn noise(&self, conditions: &[Conditions], positions: Range<u64>) -> Tensor<4> {
        let pairs: Vec<(&Conditions, u64)> = conditions.iter().zip(positions).collect();
        let [channels, rows, columns] = self.set.shape();
        let base = self.config.base_scene();
        let noise = pairs.par_iter().map(|&(conditions, position)| {
            let scene = conditions.onto(&base);
            sea_noise(&[scene], &[noise_of(self.seed, position)], self.patches).unwrap_or_else(
                |_| Tensor::full([1, channels, rows, columns], f32::NAN, &Device::default()),
            )
        });
        Tensor::cat(noise.collect(), 0)
    }
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
        let noise = self.noise(&conditions, positions);
        let noise = Tensor::from_inner(noise.to_device(&device.clone().inner()));
        let residual = self.set.latents(&indices, device);
        let count = levels.len();
        let angles: Vec<f32> = levels.iter().map(|level| FRAC_PI_2 * level).collect();
        let tensor =
            |numbers| -> Tensor<1> { Tensor::from_data(TensorData::new(numbers, [count]), device) };
        let angle = tensor(angles).reshape([-1, 1, 1, 1]);
        let (cos, sin) = (angle.clone().cos(), angle.sin());
        let x = residual.clone() * cos.clone() + noise.clone() * sin.clone();
        let target = noise * cos - residual * sin;
        let wake = self.set.expected(&indices, device);
        let known = model.prepared(&Known::new(&conditions, self.config.grid(), wake));
        let error = model.velocity(x, tensor(levels), &known) - target;
        let loss = error.square().mean();
        let terms = vec![("flow", number(&loss))];
        (loss, terms)
    }
}
