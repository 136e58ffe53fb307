//! A run: the training of one part of a model on one task, which can be stopped and resumed.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use burn::module::Module;
use burn::tensor::{Device, Tensor};
use serde_json::{Value, json};

use super::checkpoint::Checkpoint;
use super::self_check::check_once;
use super::trainer::{StepReport, Trainer, TrainerOptions};
use crate::error::{Error, Result};

/// Terms of a loss by name.
pub type Terms = Vec<(&'static str, f64)>;

/// Training task of a part of a model.
///
/// Step s takes the positions s · batch … (s + 1) · batch − 1, however many devices and parts share them: all random numbers
/// of a position depend on the position alone.
pub trait Task<M>: Sync {
    /// Data that the loss is computed from.
    type Batch: Send + Sync;

    /// Reads or makes the data of some positions.
    ///
    /// A stage calls it for the next step while the model trains on the current one.
    ///
    /// # Errors
    ///
    /// Errors of the data; they end the run.
    fn batch(&self, positions: Range<u64>) -> Result<Self::Batch>;

    /// The mean loss over a batch, and its terms.
    ///
    /// - `device`: autodiff device of the model
    fn loss(&self, model: &M, device: &Device, batch: &Self::Batch) -> (Tensor<1>, Terms);
}

/// How the positions of a step are divided into parts.
#[derive(Debug, Clone, Copy)]
pub(super) struct Parts {
    batch: usize,
    parts: usize,
}

impl Parts {
    /// Batches of a step, part by part.
    pub(super) fn of_step<M, T: Task<M>>(self, task: &T, step: usize) -> Result<Vec<T::Batch>> {
        let each = (self.batch / self.parts) as u64;
        let first = (step * self.batch) as u64;
        let begins = (0..self.parts as u64).map(|part| first + part * each);
        begins
            .map(|begin| task.batch(begin..begin + each))
            .collect()
    }
}

/// Constants of a [`Run`].
#[derive(Debug, Clone, PartialEq)]
pub struct RunOptions {
    /// Examples in a batch.
    pub batch: usize,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Identity of the training data, such as the manifest of a data set; a checkpoint with another is refused.
    pub identity: Value,
    /// Options of the training loop.
    pub trainer: TrainerOptions,
}

impl RunOptions {
    /// Checks the options, and that batches can be divided evenly.
    ///
    /// # Errors
    ///
    /// As [`TrainerOptions::validate`], and [`wake_nn::Error::InvalidOption`] for a batch that cannot be divided evenly.
    pub fn validate(&self, devices: usize) -> Result<()> {
        self.trainer.validate()?;
        let parts = devices * self.trainer.grad_accumulation_steps;
        if parts > 0 && self.batch > 0 && self.batch.is_multiple_of(parts) {
            return Ok(());
        }
        Err(Error::Value(wake_nn::Error::InvalidOption {
            option: "batch".to_owned(),
            value: self.batch.to_string(),
            expected: format!("a multiple of {parts}, devices times accumulation steps"),
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
    /// Run that starts from random weights.
    ///
    /// - `part`: name of the part that is trained; a checkpoint of another part is refused
    /// - `model`: configuration of the model
    /// - `init`: draws its weights
    /// - `devices`: autodiff devices, at least one; each takes its share of every batch
    ///
    /// # Errors
    ///
    /// As [`RunOptions::validate`]; [`wake_nn::Error::WrongNumbers`] for a device other than a CPU that fails
    /// [`self_check`](crate::self_check).
    pub fn of(
        part: &str,
        model: &Value,
        init: impl FnOnce(&Device) -> M,
        options: RunOptions,
        devices: Vec<Device>,
    ) -> Result<Self> {
        options.validate(devices.len())?;
        devices.iter().try_for_each(check_once)?;
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

    /// Resumes from a checkpoint.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::InvalidOption`] with the first value in which the checkpoint's run differs from this one.
    pub fn resume(&mut self, checkpoint: Checkpoint) -> Result<()> {
        self.trainer.restore(checkpoint, &self.state)
    }

    /// Writes a checkpoint and keeps the newest `keep`.
    ///
    /// # Errors
    ///
    /// [`Error::Diverged`] for weights that are not finite, else as [`Checkpoint::write`].
    pub fn checkpoint(&self, folder: &Path, keep: usize) -> Result<PathBuf> {
        self.trainer.checkpoint(&self.state)?.write(folder, keep)
    }

    /// Steps made so far.
    pub fn steps(&self) -> usize {
        self.trainer.steps()
    }

    /// The part with averaged weights, outside autodiff.
    pub fn averaged(&self) -> M {
        self.trainer.averaged()
    }

    /// How the positions of its steps are divided into parts.
    pub(super) fn parts(&self) -> Parts {
        Parts {
            batch: self.options.batch,
            parts: self.trainer.parts(),
        }
    }

    /// Makes one step on the next batch; the terms are means over the batch.
    ///
    /// # Errors
    ///
    /// As [`Task::batch`], and [`Error::Diverged`] when many steps in a row, or all of the run, had no finite loss and gradient.
    pub fn step(&mut self, task: &impl Task<M>) -> Result<(StepReport, Terms)> {
        let batches = self.parts().of_step(task, self.steps())?;
        self.step_on(task, &batches)
    }

    /// Makes one step on a batch whose parts are already made.
    pub(super) fn step_on<T: Task<M>>(
        &mut self,
        task: &T,
        batches: &[T::Batch],
    ) -> Result<(StepReport, Terms)> {
        let terms = Mutex::new(vec![Terms::new(); batches.len()]);
        let report = self.trainer.step(|model, device, part| {
            let (loss, found) = task.loss(model, device, &batches[part]);
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
