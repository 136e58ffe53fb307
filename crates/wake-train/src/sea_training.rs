//! Training of the sea texture of real images, in a run folder.

use std::path::Path;

use serde_json::Value;

use super::folder::RunFolder;
use super::progress::Progress;
use super::run::{Run, RunOptions};
use super::sea::{SeaPatches, SeaTask};
use super::stage::Stage;
use super::stage_options::{StageDefaults, StageOptions};
use crate::error::{Error, Result};
use wake_ldm::sea_texture::{SeaFlow, SeaTexture};

/// Name of the stage, its checkpoints and its log.
const STAGE: &str = "sea";
/// Defaults of the stage.
const DEFAULTS: StageDefaults = StageDefaults {
    steps: 1200,
    batch: 16,
    rate: 1e-3,
};
/// Warm-up steps and EMA decay, smaller than in longer runs.
const WARMUP: usize = 50;
const EMA_DECAY: f64 = 0.995;
/// Files that are written: the sea, and a picture of it drawn by the caller.
const WEIGHTS: &str = "sea.safetensors";
const SHEET: &str = "sea.png";

/// Training of a learnt sea on patches of unlabelled images.
#[derive(Debug, Clone)]
pub struct SeaTraining<'a> {
    /// Training patches, at least one.
    pub patches: &'a SeaPatches,
    /// Pixel spacing of the patches \[m\], if known; scenes with another spacing are then refused.
    pub spacing: Option<f64>,
    /// Identity of the images; a checkpoint with another is refused.
    pub identity: Value,
    /// Options of the run.
    pub options: StageOptions,
}

impl SeaTraining<'_> {
    /// Checks the options before any image is read.
    ///
    /// # Errors
    ///
    /// As [`RunOptions::validate`].
    pub fn check(options: &StageOptions) -> Result<()> {
        constants(options, Value::Null).validate(options.devices.len())
    }

    /// Runs the training; a killed run can be resumed from its last checkpoint.
    ///
    /// Writes `sea.safetensors`, which [`SeaTexture::load`] reads, a log, `config.json`, `run.json` and `checkpoints/`.
    ///
    /// - `draw`: draws the current sea into a file, `sea.png`, after every checkpoint
    ///
    /// # Errors
    ///
    /// Errors of `draw`, and as [`check`](Self::check), [`SeaTexture::new`]; [`wake_nn::Error::InvalidOption`] for a folder of
    /// another run.
    pub fn train<E: From<Error>>(
        &self,
        out: &Path,
        progress: &dyn Fn(Progress),
        draw: impl Fn(&SeaTexture, &Path) -> Result<(), E>,
    ) -> Result<(), E> {
        let (options, shape) = (&self.options, SeaFlow::shape());
        let styles = self.patches.styles();
        // Patches that cannot make a sea are refused before the first step.
        SeaTexture::new(SeaFlow::new(&options.device()), &styles, self.spacing)
            .map_err(Error::from)?;
        let begin = (STAGE, options.resume);
        let mut folder = RunFolder::open(out, &shape, &self.identity, begin)?;
        let constants = constants(options, self.identity.clone());
        let learning = options.learning_devices()?;
        let run = Run::of(STAGE, &shape, SeaFlow::new, constants, learning)?;
        let task = SeaTask {
            patches: self.patches,
            seed: options.seed,
        };
        let show = |run: &Run<SeaFlow>| -> Result<(), E> {
            let texture =
                SeaTexture::new(run.averaged(), &styles, self.spacing).map_err(Error::from)?;
            texture.save(&out.join(WEIGHTS)).map_err(Error::from)?;
            draw(&texture, &out.join(SHEET))
        };
        let stage = Stage {
            name: STAGE,
            resume: options.resume,
            every: options.every,
            keep: options.keep,
            steps: options.steps(&DEFAULTS),
            results: &[WEIGHTS, SHEET],
        };
        stage.train(&mut folder, run, &task, progress, show)
    }
}

fn constants(options: &StageOptions, identity: Value) -> RunOptions {
    let mut constants = options.run(&DEFAULTS, identity);
    constants.trainer.rate.warmup = WARMUP;
    constants.trainer.ema_decay = EMA_DECAY;
    constants
}
