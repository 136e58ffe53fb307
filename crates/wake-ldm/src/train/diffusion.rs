//! The small wake model learns the flow from noise to latents.

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use burn::module::Module;
use burn::tensor::{Device, Tensor, TensorData};
use serde_json::{Value, json};

use super::checkpoint::{Checkpoint, Tensors};
use super::latents::{Example, LatentSet};
use super::loss::FlowDraw;
use super::tensors::names;
use super::trainer::{StepReport, Trainer, TrainerOptions};
use crate::conditioning::{Conditions, FEATURES, MapGrid, Vocabulary, features};
use crate::error::{Error, Result};
use crate::noise::{NoiseSource, normal_batch};
use crate::small::{Known, ModelInput, WakeModel, WakeModelConfig, Words};

/// Stream of the noise that images are mixed with.
const NOISE_STREAM: u32 = 2002;
/// Stream that the order of the examples is drawn from.
const ORDER_STREAM: u32 = 2003;
/// Stream that the wordings of prompts are drawn from.
const WORDING_STREAM: u32 = 2004;
/// Stream that the prompts to read are drawn from.
const READ_STREAM: u32 = 2005;
/// Places of the map that says where the wedge is.
const WEDGE: usize = 5;
/// Groups of a checkpoint's tensors.
const GROUPS: [&str; 4] = ["weights", "average", "first", "second"];

/// Constants of a [`Diffusion`] run.
#[derive(Debug, Clone, PartialEq)]
pub struct DiffusionOptions {
    /// Images of a batch.
    pub batch: usize,
    /// Prompts that are read for each image, beside its own: words are cheap, and slow to learn.
    pub prompts: usize,
    /// Seed of everything that is drawn.
    pub seed: u64,
    /// How much more an error inside the wake's wedge counts.
    pub wedge_weight: f64,
    /// The loop.
    pub trainer: TrainerOptions,
}

impl Default for DiffusionOptions {
    fn default() -> Self {
        Self {
            batch: 16,
            prompts: 4,
            seed: 0,
            wedge_weight: 1.0,
            trainer: TrainerOptions::default(),
        }
    }
}

/// Parts of the loss of a step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Losses {
    /// Weighted squared error of the velocity.
    pub flow: f64,
    /// Squared error of the mean grey, over 0.1².
    pub grey: f64,
    /// Squared error of the numbers read from words.
    pub words: f64,
}

/// A run that trains a [`WakeModel`].
#[derive(Debug)]
pub struct Diffusion {
    trainer: Trainer<WakeModel>,
    config: WakeModelConfig,
    options: DiffusionOptions,
    vocabulary: Vocabulary,
    /// The prompt that says nothing.
    nothing: Vec<u32>,
}

/// One part of a batch on its device.
struct Part {
    latents: Tensor<4>,
    noise: Tensor<4>,
    sigma: Tensor<1>,
    weights: Tensor<4>,
    known: Known,
    words: Words,
    /// Other prompts, and the numbers that they state.
    read: Words,
    said: Tensor<2>,
    grey: Tensor<2>,
}

impl Diffusion {
    /// A run from random weights.
    ///
    /// - `nothing`: CLIP's ids of the empty prompt
    /// - `devices`: autodiff devices, at least one; each takes its share of every batch
    ///
    /// # Errors
    ///
    /// As [`WakeModelConfig::validate`], and [`Error::InvalidOption`] for a batch that cannot be cut evenly.
    pub fn new(
        config: WakeModelConfig,
        options: DiffusionOptions,
        nothing: Vec<u32>,
        devices: Vec<Device>,
    ) -> Result<Self> {
        config.validate()?;
        let parts = devices.len() * options.trainer.accumulation;
        if parts == 0 || !options.batch.is_multiple_of(parts) || options.batch == 0 {
            return Err(Error::InvalidOption {
                option: "batch".to_owned(),
                value: options.batch.to_string(),
                expected: format!(
                    "a multiple of the {parts} parts that devices and accumulation make"
                ),
            });
        }
        let device = devices[0].clone();
        device.seed(options.seed);
        let model = config.init(&device);
        Ok(Self {
            trainer: Trainer::new(model, options.trainer, devices),
            vocabulary: Vocabulary::new(config.vocabulary.iter().copied()),
            config,
            options,
            nothing,
        })
    }

    /// The run as a checkpoint left it; `self` must have the same shape.
    ///
    /// # Errors
    ///
    /// [`Error::InvalidOption`] for a checkpoint of another model or another seed.
    pub fn resumed(self, checkpoint: Checkpoint) -> Result<Self> {
        let expected = self.state();
        if checkpoint.state != expected {
            return Err(Error::InvalidOption {
                option: "checkpoint".to_owned(),
                value: checkpoint.state.to_string(),
                expected: expected.to_string(),
            });
        }
        let mut tensors = checkpoint.tensors;
        let device = self.device().inner();
        let names = names(self.trainer.model());
        let mut group = |group: &str| -> Result<Vec<Tensor<1>>> {
            let take = |(name, shape): &(String, Vec<usize>)| {
                let name = format!("{group}.{name}");
                let found = tensors.remove(&name).filter(|(found, _)| found == shape);
                let (_, numbers) = found.ok_or_else(|| Error::InvalidOption {
                    option: "checkpoint".to_owned(),
                    value: format!("without {name} {shape:?}"),
                    expected: "all tensors of the model".to_owned(),
                })?;
                Ok(Tensor::from_data(
                    TensorData::new(numbers, [shape.iter().product::<usize>()]),
                    &device,
                ))
            };
            names.iter().map(take).collect()
        };
        let [a, b, c, d] = GROUPS;
        let state = [group(a)?, group(b)?, group(c)?, group(d)?];
        Ok(Self {
            trainer: self.trainer.resumed(state, checkpoint.step),
            ..self
        })
    }

    /// What a checkpoint must agree on.
    fn state(&self) -> Value {
        json!({"model": self.config, "seed": self.options.seed, "batch": self.options.batch})
    }

    /// Writes a checkpoint.
    ///
    /// # Errors
    ///
    /// As [`Checkpoint::write`].
    pub fn checkpoint(&self, folder: &Path) -> Result<PathBuf> {
        let names = names(self.trainer.model());
        let mut tensors = Tensors::new();
        for (group, values) in GROUPS.iter().zip(self.trainer.state()) {
            for ((name, shape), value) in names.iter().zip(values) {
                let numbers = value.into_data().iter::<f32>().collect();
                tensors.insert(format!("{group}.{name}"), (shape.clone(), numbers));
            }
        }
        let checkpoint = Checkpoint {
            step: self.steps(),
            state: self.state(),
            tensors,
        };
        checkpoint.write(folder)
    }

    /// Steps made so far.
    pub fn steps(&self) -> usize {
        self.trainer.steps()
    }

    /// The model with averaged weights, outside autodiff.
    pub fn averaged(&self) -> WakeModel {
        self.trainer.averaged()
    }

    /// The device of the model.
    fn device(&self) -> Device {
        let devices = self.trainer.model().devices();
        devices.into_iter().next().unwrap_or_default()
    }

    /// One step on the next batch of a set, which is walked in an order drawn anew for each round.
    ///
    /// # Panics
    ///
    /// When the set is empty, or its latents are not those of the model.
    pub fn step(&mut self, set: &LatentSet) -> (StepReport, Losses) {
        let parts = self.trainer.parts();
        let each = self.options.batch / parts;
        let first = (self.trainer.steps() * self.options.batch) as u64;
        let sums = Mutex::new(vec![Losses::default(); parts]);
        let this = BatchMaker {
            config: &self.config,
            options: &self.options,
            vocabulary: &self.vocabulary,
            nothing: &self.nothing,
        };
        let report = self.trainer.step(|model, device, part| {
            let positions = (0..each).map(|i| first + (part * each + i) as u64);
            let (loss, losses) = loss(model, this.part(set, positions, device));
            sums.lock()
                .unwrap_or_else(std::sync::PoisonError::into_inner)[part] = losses;
            loss
        });
        let sums = sums
            .into_inner()
            .unwrap_or_else(std::sync::PoisonError::into_inner);
        let mean = |value: fn(&Losses) -> f64| sums.iter().map(value).sum::<f64>() / parts as f64;
        let losses = Losses {
            flow: mean(|l| l.flow),
            grey: mean(|l| l.grey),
            words: mean(|l| l.words),
        };
        (report, losses)
    }
}

/// What a part of a batch is made from.
struct BatchMaker<'a> {
    config: &'a WakeModelConfig,
    options: &'a DiffusionOptions,
    vocabulary: &'a Vocabulary,
    nothing: &'a [u32],
}

impl BatchMaker<'_> {
    fn part(&self, set: &LatentSet, positions: impl Iterator<Item = u64>, device: &Device) -> Part {
        let random = NoiseSource::new(self.options.seed);
        let positions: Vec<u64> = positions.collect();
        let draws: Vec<FlowDraw> = positions
            .iter()
            .map(|&p| FlowDraw::new(random, p))
            .collect();
        let indices: Vec<usize> = positions
            .iter()
            .map(|&p| shuffled(random, p, set.len()))
            .collect();
        let examples: Vec<_> = indices.iter().map(|&i| set.example(i)).collect();
        let grid = MapGrid {
            size: self.config.image_size,
            spacing: self.config.spacing,
        };
        let all: Vec<Conditions> = examples.iter().map(|e| e.conditions).collect();
        let shown = draws
            .iter()
            .map(|d| if d.numbers { 1.0 } else { 0.0 })
            .collect();
        let prompts: Vec<Vec<u32>> = (examples.iter().zip(&draws).zip(&positions))
            .map(|((example, draw), &position)| {
                let chosen = wording(random, example, position).filter(|_| draw.words);
                chosen.map_or_else(|| self.nothing.to_vec(), Clone::clone)
            })
            .collect();
        let row = |numbers: Vec<f32>, width: usize| -> Tensor<2> {
            let rows = numbers.len() / width;
            Tensor::from_data(TensorData::new(numbers, [rows, width]), device)
        };
        let (read, said) = self.reading(set, &positions);
        let sources: Vec<NoiseSource> = positions
            .iter()
            .map(|&p| noise_of(self.options.seed, p))
            .collect();
        let known = Known::new(&all, grid, device);
        Part {
            latents: set.latents(&indices, device),
            noise: normal_batch(&sources, NOISE_STREAM, set.shape(), device),
            sigma: row(draws.iter().map(|d| d.sigma as f32).collect(), 1).squeeze_dim(1),
            weights: wedge_weights(known.places.clone(), self.options.wedge_weight),
            known: known.only(row(shown, 1)),
            words: Words::new(&prompts, self.vocabulary, device),
            read: Words::new(&read, self.vocabulary, device),
            said: row(said, FEATURES),
            grey: row(examples.iter().map(|e| e.grey).collect(), 1),
        }
    }

    /// Prompts of any examples, and the features of what they state.
    fn reading(&self, set: &LatentSet, positions: &[u64]) -> (Vec<Vec<u32>>, Vec<f32>) {
        let random = NoiseSource::new(self.options.seed);
        let count = self.options.prompts as u64;
        let (mut prompts, mut said) = (Vec::new(), Vec::new());
        for draw in positions.iter().flat_map(|&p| p * count..(p + 1) * count) {
            let at = random.uniform(READ_STREAM, draw) * set.len() as f64;
            let example = set.example(at as usize % set.len());
            if let Some(prompt) = wording(random, example, draw) {
                prompts.push(prompt.clone());
                said.extend(features(&Conditions {
                    ship_position: None,
                    ..example.conditions
                }));
            }
        }
        (prompts, said)
    }
}

/// One of the wordings of an example.
fn wording(random: NoiseSource, example: &Example, position: u64) -> Option<&Vec<u32>> {
    let draw = random.uniform(WORDING_STREAM, position);
    example
        .prompts
        .get((draw * example.prompts.len() as f64) as usize)
}

/// The noise of one image of a run.
fn noise_of(seed: u64, position: u64) -> NoiseSource {
    NoiseSource::new(seed ^ position.wrapping_mul(0x9E37_79B9_7F4A_7C15))
}

/// The example at a position: each round through the set is another stride through it.
fn shuffled(random: NoiseSource, position: u64, count: usize) -> usize {
    let count = count as u64;
    let (round, at) = (position / count, position % count);
    let draw = random.uniform(ORDER_STREAM, round);
    let start = (draw * count as f64) as u64;
    let mut stride = ((0.3 + 0.4 * draw) * count as f64) as u64 | 1;
    while gcd(stride, count) != 1 {
        stride += 1;
    }
    ((start + at * stride) % count) as usize
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// 1 + w inside the wedge and 1 outside, with mean 1 over the image.
fn wedge_weights(places: Tensor<4>, weight: f64) -> Tensor<4> {
    let weights = places.narrow(1, WEDGE, 1) * weight + 1.0;
    let mean = weights.clone().mean_dim(3).mean_dim(2);
    weights / mean
}

/// The loss of a part, and its terms.
fn loss(model: &WakeModel, part: Part) -> (Tensor<1>, Losses) {
    let (context, summary) = model.read(&part.words);
    let (_, read) = model.read(&part.read);
    let words = (model.numbers(read) - part.said).square().mean();
    let encoded = model.encode(part.known, context, summary);
    let grey = ((model.mean_grey(&encoded) - part.grey) * 10.0)
        .square()
        .mean();
    let level = part.sigma.clone().reshape([-1, 1, 1, 1]);
    let noisy = part.latents.clone() * (level.clone().neg() + 1.0) + part.noise.clone() * level;
    let input = ModelInput {
        latents: noisy,
        sigma: part.sigma,
    };
    let error = model.velocity(input, &encoded) - (part.noise - part.latents);
    let flow = (error.square() * part.weights).mean();
    let number = |x: &Tensor<1>| f64::from(x.clone().inner().into_scalar::<f32>());
    let losses = Losses {
        flow: number(&flow),
        grey: number(&grey),
        words: number(&words),
    };
    (flow + grey * 0.1 + words, losses)
}
