//! The network learns from a source of images, step by step, and can be stopped and continued.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use crate::{AdamOptions, Checkpoint, Metrics, Rate, Trainer, TrainerOptions};
use burn::tensor::Device;
use rayon::prelude::*;
use serde_json::json;
use wake_dataset::{Batches, Loader, Source};
use wake_nn::device_named;
use wake_nn::weights::{Layout, Precision, load, save_as};

use super::draw::Draw;
use super::recipes::Recipe;
use super::repeated::Repeated;
use super::sample::Sample;
use super::targets::{Batch, Prepared};
use crate::error::{Error, Result};
use wake_detector::network::Network;
use wake_detector::self_check::self_check;

/// Images of a step.
const BATCH: usize = 16;
/// Rows and columns of an image.
const SIZE: usize = 256;

/// What a network learns from, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct Training {
    /// Images to learn from.
    pub images: usize,
    /// Different images, which come again when all were seen; without it all are different.
    pub distinct: Option<usize>,
    /// What the images show.
    pub recipe: Recipe,
    /// Weights to begin with; without them random ones.
    pub weights: Option<PathBuf>,
    /// Seed of images and first weights.
    pub seed: u64,
    /// Largest step of the optimizer.
    pub rate: f64,
    /// Steps between checkpoints.
    pub every: usize,
}

impl Default for Training {
    fn default() -> Self {
        Self {
            images: 40_000,
            distinct: None,
            recipe: Recipe::Mixed,
            weights: None,
            seed: 7,
            rate: 2e-3,
            every: 100,
        }
    }
}

impl Training {
    /// Steps of the whole run.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.images.div_ceil(BATCH)
    }

    fn trainer_options(&self) -> TrainerOptions {
        let steps = self.steps();
        TrainerOptions {
            rate: Rate {
                peak: self.rate,
                warmup: 100.min(steps),
                steps,
            },
            adam: AdamOptions {
                weight_decay: 1e-3,
                ..AdamOptions::default()
            },
            largest_norm: 5.0,
            average_decay: 0.995,
            ..TrainerOptions::default()
        }
    }
}

/// Trains, and writes `detector.safetensors` (averaged weights, which [`Detector::load`](wake_detector::Detector::load) takes),
/// `train.jsonl` and `checkpoints/` into a folder, which is made if absent. A run that was killed goes on from its last
/// checkpoint there.
///
/// - `done`: told the number of steps after each
///
/// # Errors
///
/// [`Error::Model`] for numbers out of range, a folder that cannot be written, checkpoints of another run, and gradients that
/// stay infinite; [`Error::WrongMaps`] for first weights as [`Detector::load`](crate::Detector::load).
pub fn train(
    training: &Training,
    device: &Device,
    out: &Path,
    mut done: impl FnMut(usize),
) -> Result<()> {
    let options = training.trainer_options();
    options.validate()?;
    let device = device.clone().autodiff();
    device.seed(training.seed);
    let steps = training.steps();
    let network = match &training.weights {
        Some(file) => {
            let network = load(Network::new(&device), Layout::Diffusers, file)?;
            self_check(&network, file, &device)?;
            network
        }
        None => Network::new(&device),
    };
    let mut trainer = Trainer::new(network, options, vec![device]);
    let state = json!({
        "seed": training.seed, "recipe": training.recipe.name(), "images": training.images, "batch": BATCH,
        "distinct": training.distinct, "size": SIZE, "rate": training.rate, "weights": training.weights,
    });
    let checkpoints = out.join("checkpoints");
    if let Some(checkpoint) = Checkpoint::newest(&checkpoints)? {
        trainer.restore(checkpoint, &state)?;
    }
    std::fs::create_dir_all(out).map_err(|source| wake_nn::Error::Io {
        action: "make",
        path: out.to_owned(),
        source,
    })?;
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let source = training.recipe.source(training.seed, SIZE)?;
    let source: Arc<dyn Source> = match training.distinct {
        Some(count) => Arc::new(Repeated::new(source, count)),
        None => source,
    };
    let mut batches = Loader::new(source)
        .batch(BATCH)
        .threads(threads)
        .start(trainer.steps() as u64)
        .on(&device_named("flex")?)?;
    let mut metrics = Metrics::open(&out.join("train.jsonl"), trainer.steps())?;
    let mut prepare = |step: usize| prepared(&mut batches, step, training.seed);
    let mut next = prepare(trainer.steps())?;
    while trainer.steps() < steps {
        let samples = std::mem::take(&mut next);
        let parts = Mutex::new([0.0f32; 4]);
        // The next images are made while the network learns from these.
        let (report, following) = {
            let step = trainer.steps() + 1;
            std::thread::scope(|scope| {
                let maker = scope.spawn(|| match step < steps {
                    true => prepare(step),
                    false => Ok(Vec::new()),
                });
                let report = trainer.step(|model, device, _| {
                    let batch = Batch::new(&samples, device);
                    let (loss, terms) = batch.loss(model.forward(batch.images.clone()));
                    let terms = terms.map(|term| term.inner().into_scalar::<f32>());
                    *parts.lock().unwrap_or_else(PoisonError::into_inner) = terms;
                    loss
                });
                let following = maker
                    .join()
                    .unwrap_or_else(|panic| std::panic::resume_unwind(panic));
                (report, following)
            })
        };
        trainer.check()?;
        next = following?;
        let [tips, lines, directions, extents] =
            parts.into_inner().unwrap_or_else(PoisonError::into_inner);
        let more =
            json!({"tips": tips, "lines": lines, "directions": directions, "extents": extents});
        metrics.write(trainer.steps(), steps, report, &more)?;
        done(trainer.steps());
        if trainer.steps().is_multiple_of(training.every.max(1)) || trainer.steps() == steps {
            trainer.checkpoint(&state)?.write(&checkpoints)?;
            save(&trainer.averaged(), &out.join("detector.safetensors"))?;
        }
    }
    Ok(())
}

/// Writes weights as they ship: 16 bits.
fn save(network: &Network, path: &Path) -> Result<()> {
    save_as(network, Layout::Diffusers, path, Precision::F16).map_err(Error::from)
}

/// The images of a step, turned and mirrored as the geometry of other passes would.
fn prepared(batches: &mut Batches, step: usize, seed: u64) -> Result<Vec<Prepared>> {
    let Some(batch) = batches.next().transpose()? else {
        return Ok(Vec::new());
    };
    let samples = Sample::of_batch(batch).into_par_iter().enumerate();
    let prepare = |(k, sample): (usize, Sample)| {
        let draw = &mut Draw::new(seed ^ 0x5151, (step * BATCH + k) as u64);
        Prepared::new(&sample.turned(draw))
    };
    Ok(samples.map(prepare).collect())
}
