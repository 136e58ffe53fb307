//! Fine-tuning in a folder: checkpoints, the model in the layout of diffusers, and a log.

use std::collections::BTreeMap;
use std::path::Path;

use burn::tensor::Device;
use serde_json::{Value, json};

use super::super::checkpoint::Checkpoint;
use super::super::folder::check_begin;
use super::super::log::Metrics;
use super::super::progress::Progress;
use super::super::stage_options::{StageOptions, Usual};
use super::super::trainer::TrainerOptions;
use super::{FineTune, FineTuneOptions, Frozen, PromptedBatches};
use crate::error::{Error, Result};
use wake_dataset::Folder;
use wake_ldm::pipeline::{Pipeline, PipelineParts};
use wake_ldm::scheduler::Prediction;
use wake_nn::weights::Precision;
use whole_files::fingerprint;
use whole_files::read_text;

/// The paper's recipe: batch 16, rate 1e-5.
const USUAL: Usual = Usual {
    steps: 1000,
    batch: 16,
    rate: 1e-5,
};
/// Steps over which the rate rises to its largest.
const WARMUP: usize = 20;
/// What the work is called.
const NAME: &str = "fine-tuning";
/// Where the checkpoints lie.
const CHECKPOINTS: &str = "checkpoints";
/// After how many steps the model in the folder was written.
const RECORD: &str = "fine_tune.json";

/// How a model in the layout of diffusers is fitted to the pairs of a folder: its whole U-Net and nothing else, or low-rank
/// changes of that.
#[derive(Debug, Clone)]
pub struct FineTuning<'a> {
    /// Folder of the model that is begun with.
    pub weights: &'a Path,
    /// What it learns from.
    pub data: &'a Folder,
    /// Rank of the changes of the attentions; `None`: the whole U-Net learns.
    pub rank: Option<usize>,
    /// γ of the weights by signal-to-noise ratio, see [`FineTuneOptions`].
    pub snr_gamma: Option<f64>,
    /// How it runs, on one device.
    pub options: StageOptions,
}

impl FineTuning<'_> {
    /// Makes all steps. Writes the model, `pytorch_lora_weights.safetensors` where changes are what learns,
    /// `fine_tune.jsonl`, `fine_tune.json` and `checkpoints/`; a run that was killed goes on from its last checkpoint.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::InvalidOption`] for images of another size than the autoencoder takes, a set without pairs, a folder in which
    /// there is nothing to resume or where a new beginning would lose something; [`wake_nn::Error::Unsupported`] for several devices, or
    /// a scheduler without a noise schedule; else as [`Pipeline::load`], [`FineTune::whole`], [`FineTune::step`], and for files that cannot be written.
    pub fn train(&self, out: &Path, progress: &dyn Fn(Progress)) -> Result<()> {
        if self.options.devices.len() > 1 {
            return Err(Error::Value(wake_nn::Error::Unsupported {
                option: "devices of a fine-tuned model".to_owned(),
                value: self.options.devices.len().to_string(),
                supported: "1".to_owned(),
            }));
        }
        let (device, steps) = (self.options.device(), self.options.steps(&USUAL));
        let parts = Pipeline::load(self.weights, &device)?.into_parts();
        check_size(self.data, parts.autoencoder.downsampling())?;
        let mut run = self.begin(&parts)?;
        let checkpoints = out.join(CHECKPOINTS);
        check_begin(out, &checkpoints, NAME, self.options.resume)?;
        if let Some(checkpoint) = Checkpoint::newest(&checkpoints)? {
            run.resume(checkpoint)?;
        }
        let _lock = whole_files::lock_folder(out)?;
        // A kill after the checkpoint leaves the model of the one before.
        if run.steps() > 0 && written_after(out) != Some(run.steps() as u64) {
            save(&run, &parts, &device, out)?;
        }
        let mut metrics = Metrics::open(&out.join("fine_tune.jsonl"), run.steps())?;
        let batches = PromptedBatches {
            data: self.data,
            parts: &parts,
            batch: self.options.batch.unwrap_or(USUAL.batch),
            seed: self.options.seed,
        };
        progress(Progress::Begin {
            what: NAME,
            of: steps as u64,
        });
        while run.steps() < steps {
            let (images, ids) = batches.of_step(run.steps(), &device)?;
            let report = run.step(images, ids)?;
            metrics.write(run.steps(), steps, report, &json!({}))?;
            progress(Progress::Step {
                step: run.steps(),
                loss: report.loss,
            });
            if run.steps().is_multiple_of(self.options.every.max(1)) || run.steps() == steps {
                run.checkpoint(&checkpoints)?;
                save(&run, &parts, &device, out)?;
            }
        }
        progress(Progress::Made {
            stage: NAME,
            steps: run.steps(),
        });
        Ok(())
    }

    fn begin(&self, parts: &PipelineParts) -> Result<FineTune> {
        let scheduler = &parts.scheduler;
        let schedule = scheduler.noise_schedule().cloned();
        let schedule = schedule.ok_or_else(|| {
            Error::Value(wake_nn::Error::Unsupported {
                option: "scheduler of a fine-tuned model".to_owned(),
                value: scheduler.class().to_owned(),
                supported: "those with a noise schedule to train with".to_owned(),
            })
        })?;
        let prediction = match scheduler.to_json()["prediction_type"].as_str() {
            Some("v_prediction") => Prediction::Velocity,
            Some("sample") => Prediction::Sample,
            Some("epsilon") | None => Prediction::Epsilon,
            _ => Prediction::Flow,
        };
        let mut trainer: TrainerOptions = self.options.run(&USUAL, Value::Null).trainer;
        trainer.rate.warmup = WARMUP;
        let constants = FineTuneOptions {
            prediction,
            snr_gamma: self.snr_gamma,
            seed: self.options.seed,
            identity: self.identity()?,
            trainer,
        };
        let frozen = Frozen {
            text: parts.text_encoder.clone(),
            autoencoder: parts.autoencoder.clone(),
            schedule,
        };
        let learning = self.options.learning_devices()?.into_iter().next();
        let (unet, learning) = (parts.unet.clone(), learning.unwrap_or_default());
        match self.rank {
            None => FineTune::whole(unet, frozen, constants, &learning),
            Some(rank) => FineTune::low_rank(unet, rank, frozen, constants, &learning),
        }
    }

    /// What a run learns from: the files of the model it begins with, and the set.
    fn identity(&self) -> Result<Value> {
        let mut files = BTreeMap::new();
        for part in ["unet", "vae", "text_encoder", "scheduler"] {
            let folder = self.weights.join(part);
            let Ok(entries) = std::fs::read_dir(&folder) else {
                continue;
            };
            for entry in entries {
                let path = entry
                    .map_err(|source| crate::log::unreadable(&folder, source))?
                    .path();
                let name = path.file_name().unwrap_or_default();
                let name = name.to_string_lossy();
                if path.is_file() && !name.starts_with('.') {
                    files.insert(format!("{part}/{name}"), fingerprint(&path)?);
                }
            }
        }
        let set = self.data.manifest();
        Ok(json!({"weights": files, "data": set, "shard": set.shard}))
    }
}

/// Refuses images that the autoencoder cannot halve as often as it does.
fn check_size(data: &Folder, down: usize) -> Result<()> {
    let grid = &data.manifest().recipe.scene.grid;
    if grid.rows.is_multiple_of(down) && grid.columns.is_multiple_of(down) && !data.is_empty() {
        return Ok(());
    }
    Err(Error::Value(wake_nn::Error::InvalidOption {
        option: "data".to_owned(),
        value: format!(
            "{} images of {} x {} pixels",
            data.len(),
            grid.rows,
            grid.columns
        ),
        expected: format!("one or more, of multiples of {down} pixels"),
    }))
}

/// After how many steps the model in a folder was written.
fn written_after(folder: &Path) -> Option<u64> {
    let text = read_text(&folder.join(RECORD)).ok()?;
    let record: Value = serde_json::from_str(&text).ok()?;
    record["results_after"].as_u64()
}

/// Writes the whole model, and the changes alone where they are what learns.
fn save(run: &FineTune, parts: &PipelineParts, device: &Device, out: &Path) -> Result<()> {
    let parts = PipelineParts {
        unet: run.unet(),
        ..parts.clone()
    };
    Pipeline::new(parts, device)?.save(out, Precision::F32)?;
    if let Some(changes) = run.changes() {
        changes.save("unet", &out.join("pytorch_lora_weights.safetensors"))?;
    }
    let record = json!({"results_after": run.steps()});
    Ok(whole_files::write_json(&out.join(RECORD), &record)?)
}
