//! The stages of the wake model's training, in the folder of one run: patches, parser, prior, flow.

mod flow;
mod parser;
mod patches;
mod prior;

use std::path::PathBuf;
use std::sync::Arc;

use burn::module::Module;
use burn::tensor::Device;
use serde_json::{Value, json};

use super::checkpoint::Checkpoint;
use super::folder::RunFolder;
use super::latents::LatentSet;
use super::pairs::TrainingPairs;
use super::progress::{Progress, counted};
use super::run::Run;
use super::stage::Stage;
use super::stage_options::{StageDefaults, StageOptions};
use crate::error::{Error, Result};
use wake_ldm::network::{Part, PatchTransform, WakeModelConfig};
use wake_nn::weights::{Layout, Precision, load, save_as};
use whole_files::fingerprint;

/// Images of the pairs above images of the model.
const SHEET: &str = "sheet.png";
/// Images in a row of a sheet.
const ACROSS: u64 = 8;

/// Default options of a part; the patches need no steps.
fn defaults(part: Part) -> StageDefaults {
    let (steps, batch, rate) = match part {
        Part::Patches => (1, 1, 1e-3),
        Part::Parser => (4000, 128, 1e-3),
        Part::Prior => (6000, 32, 2e-3),
        Part::Flow => (6000, 8, 1e-3),
    };
    StageDefaults { steps, batch, rate }
}

/// Result files of a part.
fn results(part: Part) -> &'static [&'static str] {
    match part {
        Part::Patches => const { &[Part::Patches.file()] },
        Part::Parser => const { &[Part::Parser.file()] },
        Part::Prior => const { &[Part::Prior.file()] },
        Part::Flow => const { &[Part::Flow.file(), SHEET] },
    }
}

/// The training of one [`WakeModel`](wake_ldm::network::WakeModel) in a folder.
///
/// A stage first runs earlier stages that are missing or unfinished. Afterwards the folder holds what
/// [`WakeSampler::from_folder`](wake_ldm::WakeSampler::from_folder) reads (averaged weights, 16 bits),
/// `explained_variance.json`, a log `STAGE.jsonl` for each stage, `sheet.png`, `config.json`, `run.json` and `checkpoints/`.
///
/// ```no_run
/// use wake_dataset::Recipe;
/// use wake_ldm::network::Part;
/// use wake_train::{StageOptions, TrainingPairs, WakeTraining};
///
/// let pairs = TrainingPairs::simulated(Recipe::model()?, 7, 2000)?;
/// let config = pairs.model()?;
/// let flow = (Part::Flow, StageOptions::default());
/// WakeTraining::open("out/train".into(), flow, config, Some(pairs), &|_| {})?.run()?;
/// # Ok::<(), wake_train::Error>(())
/// ```
pub struct WakeTraining<'a> {
    folder: RunFolder,
    config: WakeModelConfig,
    pairs: Option<TrainingPairs>,
    part: Part,
    options: StageOptions,
    progress: &'a (dyn Fn(Progress) + Sync),
    /// Latents of all pairs, once computed.
    latents: Option<Arc<LatentSet>>,
}

impl std::fmt::Debug for WakeTraining<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("WakeTraining")
            .field("folder", &self.folder)
            .field("pairs", &self.pairs)
            .field("part", &self.part)
            .field("options", &self.options)
            .finish_non_exhaustive()
    }
}

impl<'a> WakeTraining<'a> {
    /// Opens the folder for one stage; all checks are made before anything is written.
    ///
    /// - `pairs`: training pairs, all with scenes and images that the model can have; only the parser needs none
    /// - `progress`: called with progress messages, from several threads while residuals are computed
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::InvalidOption`] for a folder of another run; else as
    /// [`RunOptions::validate`](super::RunOptions::validate) and [`StageOptions::learning_devices`].
    pub fn open(
        out: PathBuf,
        (part, options): (Part, StageOptions),
        config: WakeModelConfig,
        pairs: Option<TrainingPairs>,
        progress: &'a (dyn Fn(Progress) + Sync),
    ) -> Result<Self> {
        config.validate()?;
        let devices = options.learning_devices()?.len();
        if part != Part::Patches {
            let constants = options.run(&defaults(part), Value::Null);
            constants.validate(devices)?;
        }
        let identity = pairs.as_ref().map(TrainingPairs::identity);
        let begin = (part.name(), options.resume);
        Ok(Self {
            folder: RunFolder::open(&out, &config, &identity.unwrap_or_default(), begin)?,
            config,
            pairs,
            part,
            options,
            progress,
            latents: None,
        })
    }

    /// Memory that a part needs for its latents of `pairs` pairs \[bytes\].
    pub fn memory(config: &WakeModelConfig, pairs: u64, part: Part) -> u64 {
        let copies = match part {
            Part::Patches | Part::Parser => 0,
            Part::Prior => 1,
            // Latents, and their residuals in chunks and as a whole.
            Part::Flow => 3,
        };
        copies * LatentSet::bytes(config, pairs)
    }

    /// Trains the part, after earlier parts that are not trained yet.
    ///
    /// # Errors
    ///
    /// Errors of the pairs and of files; [`Error::Diverged`]; [`wake_nn::Error::InvalidOption`] without pairs for any part but
    /// the parser, and when an earlier part was begun with other values.
    pub fn run(&mut self) -> Result<()> {
        let options = self.options.clone();
        match self.part {
            Part::Patches => self.fit_patches(),
            Part::Parser => self.train_parser(&options),
            Part::Prior => self.train_prior(&options),
            Part::Flow => self.train_flow(&options),
        }
    }

    fn pairs(&self) -> Result<&TrainingPairs> {
        self.pairs.as_ref().ok_or_else(|| {
            Error::Value(wake_nn::Error::InvalidOption {
                option: "pairs".to_owned(),
                value: "none".to_owned(),
                expected: "training pairs; only the parser trains without them".to_owned(),
            })
        })
    }

    fn out(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Stage of a part, stored in the folder.
    fn stage(part: Part, options: &StageOptions) -> Stage<'static> {
        Stage {
            name: part.name(),
            resume: options.resume,
            every: options.every,
            keep: options.keep,
            steps: options.steps(&defaults(part)),
            results: results(part),
        }
    }

    /// Options of an earlier stage whose results are missing, older than its last checkpoint, or unfinished.
    fn earlier(&self, part: Part) -> Result<Option<StageOptions>> {
        let Some(left) = self.folder.unfinished(part.name(), results(part))? else {
            return Ok(None);
        };
        let checkpoint = Checkpoint::newest(&self.folder.checkpoints(part.name()))?;
        let state = checkpoint.map_or(Value::Null, |checkpoint| checkpoint.state);
        Ok(Some(self.options.before(left, &state)))
    }

    /// A run that trains a part.
    fn run_of<M: Module>(
        &self,
        part: Part,
        options: &StageOptions,
        identity: Value,
        init: impl FnOnce(&Device) -> M,
    ) -> Result<Run<M>> {
        let constants = options.run(&defaults(part), identity);
        let devices = options.learning_devices()?;
        Run::of(part.name(), &json!(self.config), init, constants, devices)
    }

    fn fingerprint(&self, part: Part) -> Result<String> {
        Ok(fingerprint(&self.out(part.file()))?)
    }

    /// A part of the model with the weights of an earlier stage.
    fn trained<M: Module>(&self, module: M, part: Part) -> Result<M> {
        Ok(load(module, Layout::Diffusers, &self.out(part.file()))?)
    }

    /// Encodes all pairs and the expected images of their scenes; the latents then stay in memory.
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

/// Writes a part of the model in 16 bits, as it ships.
fn keep(part: &impl Module, path: &std::path::Path) -> Result<()> {
    Ok(save_as(part, Layout::Diffusers, path, Precision::F16)?)
}
