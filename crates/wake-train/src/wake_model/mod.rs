//! The stages of the wake model's training, in the folder of one run: patch transform, words, mean, diffusion.

mod diffusion;
mod mean;
mod patches;
mod words;

use std::path::PathBuf;
use std::sync::Arc;

use burn::module::Module;
use serde_json::Value;

use super::checkpoint::Checkpoint;
use super::folder::RunFolder;
use super::latents::LatentSet;
use super::pairs::TrainingPairs;
use super::progress::{Progress, counted};
use super::stage::Stage;
use super::stage_options::{StageDefaults, StageOptions};
use crate::error::{Error, Result};
use wake_ldm::network::{PatchTransform, WakeModelConfig};
use wake_nn::weights::{Layout, Precision, load, save_as};
use whole_files::fingerprint;

/// Names of what the stages write.
const PATCHES: &str = "patches.safetensors";
const PARSER: &str = "reader.safetensors";
const PRIOR: &str = "prior.safetensors";
const FLOW: &str = "flow.safetensors";
const SHEET: &str = "sheet.png";
/// Images in a row of a sheet.
const ACROSS: u64 = 8;

/// One stage of the wake model's training.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WakeStage {
    /// The patch transform, in closed form.
    Autoencoder,
    /// The reader of prompts.
    Words,
    /// Mean and spread of the latents.
    Mean,
    /// The flow that draws the sea.
    Diffusion,
}

impl WakeStage {
    /// The name of its checkpoints and its log.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Autoencoder => "autoencoder",
            Self::Words => "words",
            Self::Mean => "mean",
            Self::Diffusion => "diffusion",
        }
    }

    /// What it takes where nothing else is asked for; the autoencoder takes no steps.
    #[must_use]
    pub fn usual(self) -> StageDefaults {
        let (steps, batch, rate) = match self {
            Self::Autoencoder => (1, 1, 1e-3),
            Self::Words => (4000, 128, 1e-3),
            Self::Mean => (6000, 32, 2e-3),
            Self::Diffusion => (6000, 8, 1e-3),
        };
        StageDefaults { steps, batch, rate }
    }

    /// What is there when it is done.
    fn results(self) -> &'static [&'static str] {
        match self {
            Self::Autoencoder => &[PATCHES],
            Self::Words => &[PARSER],
            Self::Mean => &[PRIOR],
            Self::Diffusion => &[FLOW, SHEET],
        }
    }
}

/// The training of one [`WakeModel`](wake_ldm::network::WakeModel) in a folder.
///
/// A stage runs the earlier ones first, or to their end, where their weights are not in the folder yet. They leave there
/// what [`WakeSampler::from_folder`](wake_ldm::WakeSampler::from_folder) reads (weights averaged, 16 bits),
/// `shares.json`, a log `STAGE.jsonl` for each stage, `sheet.png`, and what a [`RunFolder`] has.
///
/// ```no_run
/// use wake_dataset::Recipe;
/// use wake_train::{StageOptions, TrainingPairs, WakeStage, WakeTraining};
///
/// let pairs = TrainingPairs::simulated(Recipe::model()?, 7, 2000)?;
/// let config = pairs.model()?;
/// let stage = (WakeStage::Diffusion, StageOptions::default());
/// let mut training = WakeTraining::open("out/train".into(), stage, config, Some(pairs), &|_| {})?;
/// training.diffusion()?;
/// # Ok::<(), wake_train::Error>(())
/// ```
pub struct WakeTraining<'a> {
    folder: RunFolder,
    config: WakeModelConfig,
    pairs: Option<TrainingPairs>,
    options: StageOptions,
    progress: &'a (dyn Fn(Progress) + Sync),
    /// Of all pairs, once they were asked for.
    latents: Option<Arc<LatentSet>>,
}

impl std::fmt::Debug for WakeTraining<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("WakeTraining")
            .field("folder", &self.folder)
            .field("pairs", &self.pairs)
            .field("options", &self.options)
            .finish_non_exhaustive()
    }
}

impl<'a> WakeTraining<'a> {
    /// Takes the folder for one stage; whatever is refused is refused before anything is written.
    ///
    /// - `pairs`: what is learnt from, all of them scenes and images that the model can have; words alone need none
    /// - `progress`: told what is done; residuals are computed by several threads
    ///
    /// # Errors
    ///
    /// As [`RunFolder::open`], [`RunOptions::validate`](super::RunOptions::validate) and [`StageOptions::learning_devices`].
    pub fn open(
        out: PathBuf,
        (stage, options): (WakeStage, StageOptions),
        config: WakeModelConfig,
        pairs: Option<TrainingPairs>,
        progress: &'a (dyn Fn(Progress) + Sync),
    ) -> Result<Self> {
        let devices = options.learning_devices()?.len();
        if stage != WakeStage::Autoencoder {
            let constants = options.run(&stage.usual(), Value::Null);
            constants.validate(devices)?;
        }
        let identity = pairs.as_ref().map(TrainingPairs::identity);
        let begin = (stage.name(), options.resume);
        Ok(Self {
            folder: RunFolder::open(&out, &config, &identity.unwrap_or_default(), begin)?,
            config,
            pairs,
            options,
            progress,
            latents: None,
        })
    }

    fn pairs(&self) -> Result<&TrainingPairs> {
        self.pairs.as_ref().ok_or_else(|| {
            Error::Value(wake_nn::Error::InvalidOption {
                option: "pairs".to_owned(),
                value: "none".to_owned(),
                expected: "pairs to learn from: only words need none".to_owned(),
            })
        })
    }

    fn out(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// How a stage is kept in the folder.
    fn stage(stage: WakeStage, options: &StageOptions) -> Stage<'static> {
        Stage {
            name: stage.name(),
            resume: options.resume,
            every: options.every,
            steps: options.steps(&stage.usual()),
            results: stage.results(),
        }
    }

    /// What an earlier stage is told if its results are missing, older than its last checkpoint, or not done.
    fn earlier(&self, stage: WakeStage) -> Result<Option<StageOptions>> {
        let Some(left) = self.folder.unfinished(stage.name(), stage.results())? else {
            return Ok(None);
        };
        let checkpoint = Checkpoint::newest(&self.folder.checkpoints(stage.name()))?;
        let state = checkpoint.map_or(Value::Null, |checkpoint| checkpoint.state);
        Ok(Some(self.options.before(left, &state)))
    }

    fn fingerprint(&self, name: &str) -> Result<String> {
        Ok(fingerprint(&self.out(name))?)
    }

    /// A part of the model with the weights of an earlier stage.
    fn part<M: Module>(&self, module: M, name: &str) -> Result<M> {
        Ok(load(module, Layout::Diffusers, &self.out(name))?)
    }

    /// Encodes all pairs and the images expected of their scenes, which then stay in memory.
    fn latents(&mut self, transform: &PatchTransform) -> Result<Arc<LatentSet>> {
        if let Some(latents) = &self.latents {
            return Ok(latents.clone());
        }
        let (pairs, config) = (self.pairs()?, &self.config);
        let (source, count) = (pairs.source(), pairs.len());
        let set = counted("pairs", count, self.progress, |done| {
            LatentSet::of(source, count, config, transform, done)
        });
        let set = Arc::new(set?);
        self.latents = Some(set.clone());
        Ok(set)
    }
}

/// Writes a part of the model as it ships.
fn keep(part: &impl Module, path: &std::path::Path) -> Result<()> {
    Ok(save_as(part, Layout::Diffusers, path, Precision::F16)?)
}
