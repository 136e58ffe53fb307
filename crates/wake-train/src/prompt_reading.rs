//! Pretraining of a text encoder: it learns to state the values of prompts.

use std::ops::Range;

use burn::module::Module;
use burn::nn::{Linear, LinearConfig};
use burn::tensor::{Device, Int, Tensor, TensorData};

use super::run::{Task, Terms};
use super::tasks::examples;
use super::text_to_image::token_batch;
use crate::error::Result;
use wake_ldm::conditioning::QUANTITIES;
use wake_ldm::text::{ClipText, ClipTextConfig};

/// A text encoder, and a layer that states the values of a prompt.
#[derive(Module, Debug)]
pub(crate) struct PromptReader {
    /// The text encoder.
    pub text_encoder: ClipText,
    values: Linear,
}

impl PromptReader {
    /// Reader with random weights.
    pub(crate) fn new(config: &ClipTextConfig, device: &Device) -> Self {
        Self {
            text_encoder: config.init(device),
            values: LinearConfig::new(config.hidden_size, 3 * QUANTITIES).init(device),
        }
    }

    /// Statements of prompts, from the mean of the states of their tokens.
    ///
    /// # Shapes
    ///
    /// `ids`: `[prompts, tokens]`; result: `[prompts, 3 · QUANTITIES]`, see [`wake_ldm::conditioning::statement`]
    fn statements(&self, ids: Tensor<2, Int>) -> Tensor<2> {
        let states = self.text_encoder.last_hidden_state(ids);
        let mean: Tensor<2> = states.mean_dim(1).squeeze_dim(1);
        self.values.forward(mean)
    }
}

/// Task of the reader: squared errors of standardised statements.
///
/// Stable Diffusion's text encoder knows numbers and directions before the U-Net is trained. A random one learns them from the
/// loss of the U-Net far more slowly than from the values themselves.
///
/// The values are read from the mean over all tokens, padding included, because that is what the cross-attention of a U-Net with
/// random weights sees: each token gets the same attention. If only the last of 77 tokens knew the values, they would be a
/// hundredth of what the U-Net sees, and it would learn to ignore prompts. They are standardised over the prompts, because a range
/// that is narrow among all scenes, such as that of the incidence, would hardly count.
#[derive(Debug)]
pub(crate) struct ReadingTask<'a> {
    /// Prompts as tokens, at least one.
    pub prompts: &'a [Vec<i32>],
    /// Their statements, as [`standardised`] makes them.
    pub statements: &'a [Vec<f32>],
    /// Seed of the order.
    pub seed: u64,
}

impl Task<PromptReader> for ReadingTask<'_> {
    type Batch = Range<u64>;

    fn batch(&self, positions: Range<u64>) -> Result<Range<u64>> {
        Ok(positions)
    }

    fn loss(
        &self,
        model: &PromptReader,
        device: &Device,
        positions: &Range<u64>,
    ) -> (Tensor<1>, Terms) {
        let indices = examples(self.seed, positions.clone(), self.prompts.len());
        let ids = token_batch(indices.iter().map(|&i| &self.prompts[i]), device);
        let said = indices.iter().flat_map(|&i| self.statements[i].clone());
        let said = TensorData::new(said.collect(), [indices.len(), 3 * QUANTITIES]);
        let error = model.statements(ids) - Tensor::from_data(said, device);
        (error.square().mean(), Vec::new())
    }
}

/// Statements with mean 0 and variance 1 of each of their numbers; 0 for a number that is the same in all.
pub(crate) fn standardised(statements: &[Vec<f32>]) -> Vec<Vec<f32>> {
    let mut found = statements.to_vec();
    for n in 0..3 * QUANTITIES {
        let numbers = || statements.iter().map(|statement| f64::from(statement[n]));
        let mean = numbers().sum::<f64>() / statements.len() as f64;
        let variance = numbers().map(|x| (x - mean).powi(2)).sum::<f64>();
        let deviation = (variance / statements.len() as f64).sqrt();
        let scale = if deviation > 1e-6 {
            deviation.recip()
        } else {
            0.0
        };
        for (statement, x) in found.iter_mut().zip(numbers()) {
            statement[n] = ((x - mean) * scale) as f32;
        }
    }
    found
}

#[cfg(all(test, feature = "flex"))]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;
    use crate::{LrSchedule, Run, RunOptions, TrainerOptions};
    use serde_json::Value;
    use wake_ldm::conditioning::statement;
    use wake_text::PartialScene;

    /// Two tokens state sixteen directions: the first token the quadrant, the second one the part of it. After training, each is
    /// read within half of the distance to the next one.
    #[test]
    fn directions_are_read_from_tokens() {
        let device = Device::flex();
        let direction = |n: usize| 22.5 * n as f64;
        let prompts: Vec<Vec<i32>> = (0..16).map(|n| vec![0, 1 + n / 4, 5 + n % 4, 9]).collect();
        let statements: Vec<Vec<f32>> = (0..16)
            .map(|n| {
                statement(&PartialScene {
                    ship_heading: Some(direction(n)),
                    ..PartialScene::default()
                })
            })
            .collect();
        let statements = standardised(&statements);
        let config = ClipTextConfig::new()
            .with_vocab_size(10)
            .with_hidden_size(16)
            .with_intermediate_size(32)
            .with_layers(1)
            .with_heads(2);
        let steps = 400;
        let options = RunOptions {
            batch: 8,
            seed: 3,
            identity: Value::Null,
            trainer: TrainerOptions {
                rate: LrSchedule {
                    peak: 1e-2,
                    warmup: 5,
                    steps,
                },
                ema_decay: 0.9,
                ..TrainerOptions::default()
            },
        };
        let init = |device: &Device| PromptReader::new(&config, device);
        let devices = vec![device.clone().autodiff()];
        let mut run = Run::of("text-encoder", &Value::Null, init, options, devices).unwrap();
        let task = ReadingTask {
            prompts: &prompts,
            statements: &statements,
            seed: 3,
        };
        for _ in 0..steps {
            assert!(run.step(&task).unwrap().0.applied);
        }
        let ids = token_batch(prompts.iter(), &device);
        let read: Vec<f32> = run
            .averaged()
            .statements(ids)
            .into_data()
            .iter::<f32>()
            .collect();
        for (n, read) in read.chunks(3 * QUANTITIES).enumerate() {
            // Of the ship's heading, the third quantity, sine and cosine have the same deviation.
            let heading = read[7].atan2(read[8]).to_degrees();
            let off = f64::from(heading) - direction(n);
            let off = (off + 180.0).rem_euclid(360.0) - 180.0;
            assert!(off.abs() < 11.25, "{n}: {read:?}");
        }
    }

    /// The statement of a prompt is the mean of what each token states.
    #[test]
    fn all_tokens_state_the_values() {
        let device = Device::flex();
        let config = ClipTextConfig::new()
            .with_vocab_size(10)
            .with_hidden_size(16)
            .with_intermediate_size(32)
            .with_layers(1)
            .with_heads(2);
        let reader = PromptReader::new(&config, &device);
        let ids = token_batch([vec![0, 3, 7, 9]].iter(), &device);
        let states = reader.text_encoder.last_hidden_state(ids.clone());
        let of_token = |n: usize| reader.values.forward(states.clone().narrow(1, n, 1));
        let mean = Tensor::cat((0..4).map(of_token).collect(), 1).mean_dim(1);
        let off = mean.reshape([1, -1]) - reader.statements(ids);
        assert!(off.abs().max().into_scalar::<f32>() < 1e-5);
    }

    /// The numbers of narrow ranges count as much as others, those that are always the same not at all.
    #[test]
    fn statements_are_standardised() {
        let incidences: Vec<Vec<f32>> = [20.0, 21.0, 22.0]
            .map(|incidence| {
                statement(&PartialScene {
                    incidence: Some(incidence),
                    ..PartialScene::default()
                })
            })
            .to_vec();
        let found = standardised(&incidences);
        let (last, flag) = (3 * QUANTITIES - 2, 3 * QUANTITIES - 3);
        for (found, expected) in found.iter().zip([-1.5f32.sqrt(), 0.0, 1.5f32.sqrt()]) {
            assert!((found[last] - expected).abs() < 1e-5);
            assert!(found[flag].abs() < 1e-6 && found[0].abs() < 1e-6);
        }
    }
}
