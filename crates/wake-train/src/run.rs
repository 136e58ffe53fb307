//! A run: one part of a model learns one task, step by step, and can be stopped and continued.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use burn::module::Module;
use burn::tensor::{Device, Tensor};
use serde_json::{Value, json};

use super::checkpoint::Checkpoint;
use super::trainer::{StepReport, Trainer, TrainerOptions};
use crate::error::{Error, Result};
use wake_ldm::network::WakeModelConfig;

/// Parts of a loss by name.
pub type Terms = Vec<(&'static str, f64)>;

/// What a part of a model learns.
///
/// A step of batch b takes the positions b · batch … (b + 1) · batch − 1, whatever the number of devices: what is
/// drawn for a position follows from the position.
pub trait Task<M>: Sync {
    /// The mean loss over some positions, and its terms.
    fn loss(&self, model: &M, device: &Device, positions: Range<u64>) -> (Tensor<1>, Terms);
}

/// Constants of a [`Run`].
#[derive(Debug, Clone, PartialEq)]
pub struct RunOptions {
    /// Examples of a batch.
    pub batch: usize,
    /// Seed of everything that is drawn.
    pub seed: u64,
    /// What the run learns from, such as the manifest of its data set: a checkpoint of another is refused.
    pub identity: Value,
    /// The loop.
    pub trainer: TrainerOptions,
}

impl RunOptions {
    /// Checks that batches can be cut and steps be made.
    ///
    /// # Errors
    ///
    /// As [`TrainerOptions::validate`], and [`wake_nn::Error::InvalidOption`] for a batch that cannot be cut evenly.
    pub fn validate(&self, devices: usize) -> Result<()> {
        self.trainer.validate()?;
        let parts = devices * self.trainer.accumulation;
        if parts > 0 && self.batch > 0 && self.batch.is_multiple_of(parts) {
            return Ok(());
        }
        Err(Error::Value(wake_nn::Error::InvalidOption {
            option: "batch".to_owned(),
            value: self.batch.to_string(),
            expected: format!("a multiple of the {parts} parts that devices and accumulation make"),
        }))
    }
}

/// A run that trains one part of a model, such as a [`WakeModel`](wake_ldm::network::WakeModel).
#[derive(Debug)]
pub struct Run<M> {
    trainer: Trainer<M>,
    options: RunOptions,
    state: Value,
}

impl<M: Module> Run<M> {
    /// A run from random weights.
    ///
    /// - `part`: which part of the model learns; a checkpoint of another part is refused
    /// - `init`: draws its weights
    /// - `devices`: autodiff devices, at least one; each takes its share of every batch
    ///
    /// # Errors
    ///
    /// As [`WakeModelConfig::validate`] and [`RunOptions::validate`].
    pub fn new(
        part: &str,
        config: &WakeModelConfig,
        init: impl FnOnce(&WakeModelConfig, &Device) -> M,
        options: RunOptions,
        devices: Vec<Device>,
    ) -> Result<Self> {
        config.validate()?;
        Self::of(
            part,
            &json!(config),
            |device| init(config, device),
            options,
            devices,
        )
    }

    /// A run of a model of any kind from random weights.
    ///
    /// - `part`, `devices`: as in [`new`](Self::new)
    /// - `model`: what shapes it
    ///
    /// # Errors
    ///
    /// As [`RunOptions::validate`].
    pub fn of(
        part: &str,
        model: &Value,
        init: impl FnOnce(&Device) -> M,
        options: RunOptions,
        devices: Vec<Device>,
    ) -> Result<Self> {
        options.validate(devices.len())?;
        devices[0].seed(options.seed);
        let weights = init(&devices[0]);
        Ok(Self {
            trainer: Trainer::new(weights, options.trainer, devices),
            state: json!({
                "part": part, "model": model, "seed": options.seed, "batch": options.batch,
                "identity": options.identity, "trainer": options.trainer.state(),
            }),
            options,
        })
    }

    /// Goes on where a checkpoint left off.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::InvalidOption`] with the first value in which the checkpoint's run differs from this one.
    pub fn resume(&mut self, checkpoint: Checkpoint) -> Result<()> {
        self.trainer.restore(checkpoint, &self.state)
    }

    /// Writes a checkpoint.
    ///
    /// # Errors
    ///
    /// [`Error::Diverged`] for weights that are no finite numbers, else as [`Checkpoint::write`].
    pub fn checkpoint(&self, folder: &Path) -> Result<PathBuf> {
        self.trainer.checkpoint(&self.state)?.write(folder)
    }

    /// Steps made so far.
    pub fn steps(&self) -> usize {
        self.trainer.steps()
    }

    /// The part with averaged weights, outside autodiff.
    pub fn averaged(&self) -> M {
        self.trainer.averaged()
    }

    /// One step on the next batch; the terms are means over the batch.
    ///
    /// # Errors
    ///
    /// [`Error::Diverged`] when many steps in a row, or all of the run, had no finite loss and gradient.
    pub fn step(&mut self, task: &impl Task<M>) -> Result<(StepReport, Terms)> {
        let parts = self.trainer.parts();
        let each = (self.options.batch / parts) as u64;
        let first = (self.trainer.steps() * self.options.batch) as u64;
        let terms = Mutex::new(vec![Terms::new(); parts]);
        let report = self.trainer.step(|model, device, part| {
            let begin = first + part as u64 * each;
            let (loss, found) = task.loss(model, device, begin..begin + each);
            terms.lock().unwrap_or_else(PoisonError::into_inner)[part] = found;
            loss
        });
        let terms = terms.into_inner().unwrap_or_else(PoisonError::into_inner);
        self.trainer.check()?;
        Ok((report, mean_terms(&terms)))
    }
}

/// Means over the parts of a batch.
fn mean_terms(parts: &[Terms]) -> Terms {
    let names = parts.first().into_iter().flatten().map(|&(name, _)| name);
    let mean = |i: usize| parts.iter().map(|terms| terms[i].1).sum::<f64>() / parts.len() as f64;
    names.enumerate().map(|(i, name)| (name, mean(i))).collect()
}

/// A loss as a number.
pub(super) fn number(loss: &Tensor<1>) -> f64 {
    f64::from(loss.clone().inner().into_scalar::<f32>())
}
