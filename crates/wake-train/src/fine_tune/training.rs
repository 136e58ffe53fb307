//! Fine-tuning in a run folder.

use std::collections::BTreeMap;
use std::path::Path;

use burn::module::Module;
use serde_json::{Value, json};

use super::super::folder::RunFolder;
use super::super::progress::Progress;
use super::super::run::{Run, RunOptions};
use super::super::stage::Stage;
use super::super::stage_options::{StageDefaults, StageOptions};
use super::{FineTuneTask, Frozen, PromptedPairs};
use crate::error::{Error, Result};
use wake_dataset::Folder;
use wake_ldm::lora::LowRank;
use wake_ldm::pipeline::{Pipeline, PipelineParts};
use wake_ldm::scheduler::{NoiseSchedule, Prediction};
use wake_ldm::unet::UNet;
use wake_nn::weights::files::{Stored, WeightFiles};
use wake_nn::weights::{Layout, Precision};
use whole_files::fingerprint;

/// The paper's recipe: batch 16, rate 1e-5.
const DEFAULTS: StageDefaults = StageDefaults {
    steps: 1000,
    batch: 16,
    rate: 1e-5,
};
/// Warm-up steps of the learning rate.
const WARMUP: usize = 20;
/// Name of the stage, its checkpoints and its log.
const STAGE: &str = "fine_tune";
/// Files that are written: the model, and the low-rank changes if these are trained.
const INDEX: &str = "model_index.json";
const UNET: &str = "unet/diffusion_pytorch_model.safetensors";
const CHANGES: &str = "pytorch_lora_weights.safetensors";

/// Fine-tuning of a model in diffusers layout on the pairs of a folder: its whole U-Net, or low-rank changes of it.
#[derive(Debug, Clone)]
pub struct FineTuning<'a> {
    /// Folder of the initial model.
    pub weights: &'a Path,
    /// Training data: the pairs of its `trainset.txt`.
    pub data: &'a Folder,
    /// Rank of the changes of the attention layers; `None`: the whole U-Net is trained.
    pub rank: Option<usize>,
    /// γ of the weights by signal-to-noise ratio, Hang et al. (2023), "Efficient Diffusion Training via Min-SNR Weighting
    /// Strategy".
    pub snr_gamma: Option<f64>,
    /// Options of the run.
    pub options: StageOptions,
}

impl FineTuning<'_> {
    /// Runs the training; a killed run can be resumed from its last checkpoint.
    ///
    /// Writes the model, `pytorch_lora_weights.safetensors` for low-rank changes, a log, `config.json`, `run.json` and
    /// `checkpoints/`.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::InvalidOption`] for images of a size that the autoencoder does not take, a set without training pairs
    /// and a folder of another run; [`wake_nn::Error::Unsupported`] for a scheduler without a noise schedule, or flow
    /// prediction; else as [`Pipeline::load`], [`RunOptions::validate`].
    pub fn train(&self, out: &Path, progress: &dyn Fn(Progress)) -> Result<()> {
        let constants = self.constants()?;
        let device = self.options.device();
        let parts = Pipeline::load(self.weights, &device)?.into_parts();
        let (schedule, prediction) = what_is_learnt(&parts)?;
        let pairs = PromptedPairs::new(self.data, parts.tokenizer.as_ref(), self.options.seed);
        check_size(self.data, pairs.len(), parts.autoencoder.downsampling())?;
        let model = json!({
            "unet": parts.unet.config().to_json(), "rank": self.rank, "snr_gamma": self.snr_gamma,
            "prediction": format!("{prediction:?}"),
        });
        let begin = (STAGE, self.options.resume);
        let mut folder = RunFolder::open(out, &model, &constants.identity, begin)?;
        let frozen = Frozen {
            text: parts.text_encoder.clone(),
            autoencoder: parts.autoencoder.clone(),
        };
        let devices = self.options.learning_devices()?;
        let how = (schedule, prediction);
        let task = FineTuneTask::new(pairs, &frozen, how, self.options.seed, &devices)?
            .with_snr_gamma(self.snr_gamma);
        let save = |unet: UNet| {
            let parts = PipelineParts {
                unet,
                ..parts.clone()
            };
            Ok(Pipeline::new(parts, &device)?.save(out, Precision::F32)?)
        };
        let stage = |results| Stage {
            name: STAGE,
            resume: self.options.resume,
            every: self.options.every,
            keep: self.options.keep,
            steps: self.options.steps(&DEFAULTS),
            results,
        };
        let unet = parts.unet.clone();
        match self.rank {
            None => {
                let init = |_: &_| unet.train();
                let run = Run::of(STAGE, &model, init, constants, devices)?;
                let show = |run: &Run<UNet>| save(run.averaged());
                stage(&[INDEX, UNET]).train(&mut folder, run, &task, progress, show)
            }
            Some(rank) => {
                let task = task.with_base(&unet);
                devices[0].seed(self.options.seed);
                let base = unet.clone().no_grad().train().fork(&devices[0]);
                let changes = LowRank::of_attentions(&base, Layout::Diffusers, rank)?;
                let run = Run::of(STAGE, &model, |_| changes, constants, devices)?;
                let show = |run: &Run<LowRank>| {
                    let changes = run.averaged();
                    save(changes.merged(unet.clone()))?;
                    Ok(changes.save("unet", &out.join(CHANGES))?)
                };
                stage(&[INDEX, UNET, CHANGES]).train(&mut folder, run, &task, progress, show)
            }
        }
    }

    /// Bytes on disk of a checkpoint, and of the model written beside it.
    ///
    /// A checkpoint of a whole U-Net holds its weights, their averages and the two averages of the optimizer in 32 bits; low-rank
    /// changes are counted as nothing.
    ///
    /// # Errors
    ///
    /// When weight files cannot be read.
    pub fn disk(&self) -> Result<[u64; 2]> {
        let numbers = |part: &str| -> Result<u64> {
            let files = WeightFiles::open(&self.weights.join(part))?;
            let tensors = files.tensors()?;
            let count = |stored: &Stored<'_>| stored.shape().iter().product::<usize>() as u64;
            Ok(tensors.values().map(count).sum())
        };
        let unet = numbers("unet")?;
        let all = unet + numbers("vae")? + numbers("text_encoder")?;
        Ok([if self.rank.is_none() { 16 * unet } else { 0 }, 4 * all])
    }

    /// Constants of the run, validated before any file is read.
    fn constants(&self) -> Result<RunOptions> {
        let mut constants = self.options.run(&DEFAULTS, Value::Null);
        constants.trainer.rate.warmup = WARMUP;
        constants.validate(self.options.devices.len())?;
        constants.identity = self.identity()?;
        Ok(constants)
    }

    /// Identity of the training data: files of the initial model, and the data set.
    fn identity(&self) -> Result<Value> {
        let mut files = BTreeMap::new();
        for part in ["unet", "vae", "text_encoder", "scheduler"] {
            let folder = self.weights.join(part);
            let Ok(paths) = whole_files::entries(&folder) else {
                continue;
            };
            for path in paths {
                let name = path.file_name().unwrap_or_default();
                let name = name.to_string_lossy();
                // Downloads also hold the same weights in other formats.
                let read = name.ends_with(".json") || name.ends_with(".safetensors");
                if path.is_file() && read && !name.starts_with('.') {
                    files.insert(format!("{part}/{name}"), fingerprint(&path)?);
                }
            }
        }
        let set = self.data.manifest();
        Ok(json!({"weights": files, "data": set, "shard": set.shard}))
    }
}

/// The noise schedule of a model, and what its U-Net predicts.
fn what_is_learnt(parts: &PipelineParts) -> Result<(NoiseSchedule, Prediction)> {
    let scheduler = &parts.scheduler;
    let schedule = scheduler.noise_schedule().cloned();
    let schedule = schedule.ok_or_else(|| {
        Error::Value(wake_nn::Error::Unsupported {
            option: "scheduler of a fine-tuned model".to_owned(),
            value: scheduler.class().to_owned(),
            supported: "schedulers with a noise schedule, such as DDIMScheduler".to_owned(),
        })
    })?;
    let prediction = match scheduler.to_json()["prediction_type"].as_str() {
        Some("v_prediction") => Prediction::Velocity,
        Some("sample") => Prediction::Sample,
        Some("epsilon") | None => Prediction::Epsilon,
        _ => Prediction::Flow,
    };
    Ok((schedule, prediction))
}

/// Refuses an empty set, and images whose sides are not multiples of the autoencoder's downsampling.
fn check_size(data: &Folder, count: usize, down: usize) -> Result<()> {
    let grid = &data.manifest().recipe.scene.grid;
    if grid.rows.is_multiple_of(down) && grid.columns.is_multiple_of(down) && count > 0 {
        return Ok(());
    }
    Err(Error::Value(wake_nn::Error::InvalidOption {
        option: "data".to_owned(),
        value: format!(
            "{count} images of {} x {} pixels in trainset.txt",
            grid.rows, grid.columns
        ),
        expected: format!("at least one, with rows and columns that are multiples of {down}"),
    }))
}
