//! Pretraining of a text encoder: it learns to state the values of prompts.

use std::ops::Range;

use burn::module::Module;
use burn::nn::{Linear, LinearConfig};
use burn::tensor::{Device, Int, Tensor};

use super::run::{Task, Terms};
use super::tasks::{examples, statement_loss};
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

/// Task of the reader: squared errors of each quantity, and of whether it is stated.
///
/// Stable Diffusion's text encoder knows numbers and directions before the U-Net is trained. A random one learns them from the
/// loss of the U-Net far more slowly than from the values themselves.
///
/// The values are read from the mean over all tokens, padding included, because that is what the cross-attention of a U-Net with
/// random weights sees: each token gets the same attention. If only the last of 77 tokens knew the values, they would be a
/// hundredth of what the U-Net sees, and it would learn to ignore prompts.
#[derive(Debug)]
pub(crate) struct ReadingTask<'a> {
    /// Prompts as tokens, at least one.
    pub prompts: &'a [Vec<i32>],
    /// Their statements.
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
        statement_loss(model.statements(ids), said.collect())
    }
}

#[cfg(all(test, feature = "flex"))]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;
    use crate::{LrSchedule, Run, RunOptions, TrainerOptions};
    use serde_json::Value;
    use wake_ldm::conditioning::{said, statement};
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
            let read = said(read);
            let off = read.ship_heading.unwrap() - direction(n);
            let off = (off + 180.0).rem_euclid(360.0) - 180.0;
            assert!(off.abs() < 11.25, "{n}: {read:?}");
            assert_eq!(read.wind_toward, None);
        }
    }
}
