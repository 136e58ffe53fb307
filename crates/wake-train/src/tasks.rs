//! Training tasks of the parts of the wake model.

use std::f32::consts::FRAC_PI_2;
use std::ops::Range;

use burn::tensor::{Device, Tensor, TensorData};
use rayon::prelude::*;
use wake_physics::Scene;

use super::latents::LatentSet;
use super::run::{Task, Terms, number};
use crate::error::Result;
use crate::prompts::Prompts;
use crate::streams;
use wake_dataset::shuffled;
use wake_ldm::conditioning::{MapGrid, Vocabulary, WEDGE, places, statement, tokens};
use wake_ldm::network::{
    ChannelWindows, ConditioningInputs, Flow, PatchTransform, Prior, PromptParser, SeaFields,
    windows,
};
use wake_nn::noise::NoiseSource;

/// The noise level of the image at a position of a run.
///
/// ```text
/// σ = 1/(1 + e^(−n)),  n normal
/// ```
///
/// # References
///
/// Esser et al. (2024), "Scaling Rectified Flow Transformers", section 3.1 (logit-normal).
pub(super) fn noise_level(random: NoiseSource, position: u64) -> f64 {
    let [a, b] = [0, 1].map(|i| random.uniform(streams::LEVELS, 2 * position + i));
    let normal = (-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos();
    1.0 / (1.0 + (-normal).exp())
}

/// Examples at some positions of a run; each epoch has another order.
pub(super) fn examples(
    seed: u64,
    positions: impl Iterator<Item = u64>,
    count: usize,
) -> Vec<usize> {
    positions
        .map(|position| shuffled(position, count as u64, seed) as usize)
        .collect()
}

/// The noise of one image of a run.
pub(super) fn noise_of(seed: u64, position: u64) -> NoiseSource {
    NoiseSource::new(seed ^ position.wrapping_mul(0x9E37_79B9_7F4A_7C15))
}

/// Task of the prompt parser: squared errors of each quantity, and of whether it is stated.
#[derive(Debug)]
pub(crate) struct ParserTask<'a> {
    /// The prompts.
    pub prompts: &'a Prompts,
    /// Token ids of the parser.
    pub vocabulary: &'a Vocabulary,
}

impl Task<PromptParser> for ParserTask<'_> {
    type Batch = Range<u64>;

    fn batch(&self, positions: Range<u64>) -> Result<Range<u64>> {
        Ok(positions)
    }

    fn loss(
        &self,
        model: &PromptParser,
        device: &Device,
        positions: &Range<u64>,
    ) -> (Tensor<1>, Terms) {
        let drawn = positions
            .clone()
            .filter_map(|position| self.prompts.prompt(position).ok());
        let (prompts, said): (Vec<_>, Vec<_>) = drawn
            .map(|(text, conditions)| (tokens(&text), statement(&conditions)))
            .unzip();
        let (windows, length) = windows(&prompts, self.vocabulary, device);
        statement_loss(model.forward(windows, length), said.concat())
    }
}

/// Loss of statements that were read from prompts: squared errors of the values that the prompt states, and of whether it does.
///
/// - `read`: `[prompts, 3 · QUANTITIES]`
/// - `said`: the right statements, one after another
pub(super) fn statement_loss(read: Tensor<2>, said: Vec<f32>) -> (Tensor<1>, Terms) {
    let count = said.len() / 3;
    let said: Tensor<2> = Tensor::from_data(TensorData::new(said, [count, 3]), &read.device());
    let error = (read.reshape([count, 3]) - said.clone()).square();
    let flags = said.narrow(1, 0, 1);
    let stated = error.clone().narrow(1, 0, 1).mean();
    let values = (error.narrow(1, 1, 2) * flags).mean();
    let terms = vec![("stated", number(&stated)), ("values", number(&values))];
    (stated + values, terms)
}

/// Latent pixels of an image in a step.
const CELLS: usize = 64;

/// Task of the prior: likelihood of the latents for mean and spread, squared error of the mean grey.
///
/// ```text
/// loss = mean[½ (z − μ)²/⌊s⌋] + mean[½ ((z − ⌊μ⌋)/s)² + ln s] + ½ (10 (grey − found))²
/// ```
///
/// ⌊ ⌋ stops the gradient. With the plain likelihood, ½ ((z − μ)/s)² in the first mean, a wake not yet learnt would be taken
/// for a rough sea, and would hardly be learnt any more. A batch has many scenes and few pixels of each: the network sees one
/// latent pixel at a time.
///
/// # References
///
/// Nix & Weigend (1994), "Estimating the Mean and Variance of the Target Probability Distribution", Eq. 4; Seitzer et
/// al. (2022), "On the Pitfalls of Heteroscedastic Uncertainty Estimation with Probabilistic Neural Networks", Eq. 5,
/// β = ½.
#[derive(Debug)]
pub(crate) struct PriorTask<'a> {
    /// The latents.
    pub set: &'a LatentSet,
    /// Seed of the order and of the pixels.
    pub seed: u64,
}

impl PriorTask<'_> {
    /// Draws latent pixels to train on: half of them anywhere, half inside the Kelvin wedge if there is one.
    fn cells(&self, scene: &Scene, position: u64) -> Vec<usize> {
        let random = NoiseSource::new(self.seed);
        let all = MapGrid::of(&scene.grid).cells();
        let places = places(scene, &all);
        let inside = &places[WEDGE * all.len()..][..all.len()];
        let wedge: Vec<usize> = all.iter().copied().filter(|&c| inside[c] > 0.5).collect();
        let draw = |i: usize| {
            let from = if i.is_multiple_of(2) && !wedge.is_empty() {
                &wedge
            } else {
                &all
            };
            let at = random.uniform(streams::CELLS, position * CELLS as u64 + i as u64);
            from[(at * from.len() as f64) as usize]
        };
        (0..CELLS).map(draw).collect()
    }
}

impl Task<Prior> for PriorTask<'_> {
    type Batch = Range<u64>;

    fn batch(&self, positions: Range<u64>) -> Result<Range<u64>> {
        Ok(positions)
    }

    fn loss(&self, model: &Prior, device: &Device, positions: &Range<u64>) -> (Tensor<1>, Terms) {
        let indices = examples(self.seed, positions.clone(), self.set.len());
        let scenes = self.set.scenes(&indices);
        let cells: Vec<Vec<usize>> = scenes
            .iter()
            .zip(positions.clone())
            .map(|(scene, position)| self.cells(scene, position))
            .collect();
        let tensor = |pixels: fn(&LatentSet, usize, &[usize]) -> Vec<f32>| -> Tensor<4> {
            let pairs = indices.iter().zip(&cells);
            let numbers = pairs.flat_map(|(&i, cells)| pixels(self.set, i, cells));
            let shape = [indices.len(), self.set.shape()[0], CELLS, 1];
            Tensor::from_data(TensorData::new(numbers.collect(), shape), device)
        };
        let wake = tensor(LatentSet::expected_pixels);
        let deviations = self.set.log_deviations(&indices);
        let expected = model.forward(&ConditioningInputs::of_cells(
            &scenes,
            &cells,
            wake,
            &deviations,
        ));
        let latents = tensor(LatentSet::pixels);
        let off = latents - expected.mean;
        let error = number(&off.clone().square().mean());
        let log_std = expected.log_std;
        let spread = log_std.clone().detach().exp();
        let steady = (off.clone().square() / spread).mean() * 0.5;
        let scaled = off.detach() * log_std.clone().neg().exp();
        let nll = (scaled.square() * 0.5 + log_std).mean();
        let greys: Vec<f32> = indices.iter().map(|&i| self.set.example(i).grey).collect();
        let count = greys.len();
        let greys: Tensor<2> = Tensor::from_data(TensorData::new(greys, [count, 1]), device);
        let grey = (expected.grey - greys).square().mean();
        let terms = vec![
            ("nll", number(&nll)),
            ("error", error),
            ("grey", number(&grey)),
        ];
        (steady + nll + grey * 50.0, terms)
    }
}

/// Mixes data r and noise n at noise levels σ into x = cos φ r + sin φ n; returns x, its velocity cos φ n − sin φ r, and σ;
/// φ = πσ/2.
pub(super) fn interpolate(
    data: Tensor<4>,
    noise: Tensor<4>,
    levels: &[f32],
) -> (Tensor<4>, Tensor<4>, Tensor<1>) {
    let levels = TensorData::new(levels.to_vec(), [levels.len()]);
    let levels: Tensor<1> = Tensor::from_data(levels, &data.device());
    let angle = (levels.clone() * FRAC_PI_2).reshape([-1, 1, 1, 1]);
    let (cos, sin) = (angle.clone().cos(), angle.sin());
    let x = data.clone() * cos.clone() + noise.clone() * sin.clone();
    (x, noise * cos - data * sin, levels)
}

/// Task of the flow: squared error of its velocity.
///
/// ```text
/// φ = πσ/2,    x = cos φ r + sin φ n,    loss = |v(x, σ, numbers) − (cos φ n − sin φ r)|²
/// ```
///
/// with n Gaussian noise like the scene's sea; noise that cannot be made is an error of the batch.
///
/// # References
///
/// Albergo, Boffi & Vanden-Eijnden (2023), "Stochastic Interpolants"; Salimans & Ho (2022), "Progressive
/// Distillation for Fast Sampling of Diffusion Models" (v).
#[derive(Debug)]
pub(crate) struct FlowTask<'a> {
    /// The residuals of the latents.
    pub set: &'a LatentSet,
    /// Transform that encoded them, outside autodiff.
    pub patches: &'a PatchTransform,
    /// Seed of order, noise and noise levels.
    pub seed: u64,
}

/// Data of a step of the flow, except the latents.
#[derive(Debug)]
pub(crate) struct FlowBatch {
    /// Indices of the examples.
    indices: Vec<usize>,
    /// Their noise levels.
    levels: Vec<f32>,
    /// Their noise, `[examples, channels, rows, columns]`.
    noise: TensorData,
}

impl Task<Flow> for FlowTask<'_> {
    type Batch = FlowBatch;

    /// Draws the noise on all cores.
    fn batch(&self, positions: Range<u64>) -> Result<FlowBatch> {
        let random = NoiseSource::new(self.seed);
        let indices = examples(self.seed, positions.clone(), self.set.len());
        let levels = positions.clone().map(|p| noise_level(random, p) as f32);
        let scenes = indices.iter().map(|&i| &self.set.example(i).scene);
        let pairs: Vec<(&Scene, u64)> = scenes.zip(positions).collect();
        let windows = ChannelWindows::new(self.patches);
        let noise = pairs.par_iter().map(|&(scene, position)| {
            let (scenes, sources) = (std::slice::from_ref(scene), [noise_of(self.seed, position)]);
            let seas = SeaFields::new(scenes, &sources, &windows)?;
            Ok(seas.noise(scenes, &sources, self.patches))
        });
        let noise = Tensor::cat(noise.collect::<Result<Vec<_>>>()?, 0).into_data();
        Ok(FlowBatch {
            levels: levels.collect(),
            indices,
            noise,
        })
    }

    fn loss(&self, model: &Flow, device: &Device, batch: &FlowBatch) -> (Tensor<1>, Terms) {
        let noise: Tensor<4> = Tensor::from_data(batch.noise.clone(), device);
        let residual = self.set.latents(&batch.indices, device);
        let (x, target, levels) = interpolate(residual, noise, &batch.levels);
        let inputs = model.cached(&self.set.inputs(&batch.indices, device));
        let error = model.velocity(x, levels, &inputs) - target;
        let loss = error.square().mean();
        let terms = vec![("flow", number(&loss))];
        (loss, terms)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_round_takes_every_example_once_in_another_order() {
        let rounds: Vec<Vec<usize>> = (0..3)
            .map(|round| examples(5, round * 24..(round + 1) * 24, 24))
            .collect();
        for round in &rounds {
            let mut sorted = round.clone();
            sorted.sort_unstable();
            assert_eq!(sorted, (0..24).collect::<Vec<_>>());
        }
        assert_ne!(rounds[0], rounds[1]);
    }
}
