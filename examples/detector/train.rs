//! `train`: the network learns from a source of images, step by step, and can be stopped and continued.

use std::error::Error;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde_json::json;
use std::sync::{Arc, Mutex};
use wake_ldm::dataset::{Batches, Loader, Source};
use wake_ldm::device_named;
use wake_ldm::train::{AdamOptions, Checkpoint, Metrics, Rate, Trainer, TrainerOptions};
use wake_ldm::weights::{Layout, Precision, load, save_as};

use super::network::Network;
use super::progress;
use super::recipes::Recipe;
use super::repeated::Repeated;
use super::sample::{Draw, Sample};
use super::targets::{Batch, Prepared};

/// Images of a step.
const BATCH: usize = 16;
/// Rows and columns of an image.
const SIZE: usize = 256;

#[derive(clap::Args, Debug, Clone)]
pub(crate) struct Options {
    /// Images to learn from
    #[arg(long, default_value_t = 40_000, value_parser = clap::value_parser!(u32).range(1..=100_000_000))]
    images: u32,
    /// Different images, which come again when all were seen; by default all are different
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u32).range(16..=1_000_000))]
    distinct: Option<u32>,
    /// What the images show
    #[arg(long, value_enum, default_value_t = Recipe::Mixed)]
    recipe: Recipe,
    /// Weights to begin with, by default random ones
    #[arg(long, value_name = "FILE")]
    weights: Option<PathBuf>,
    /// Seed of images and first weights
    #[arg(long, default_value_t = 7)]
    seed: u64,
    /// Largest step of the optimizer
    #[arg(long, default_value_t = 2e-3)]
    rate: f64,
    /// Steps between checkpoints
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..))]
    every: u32,
    /// flex, ndarray, wgpu or cuda, where compiled in
    #[arg(long, default_value = "flex")]
    device: String,
    /// Folder of the results; a run that was killed goes on from its last checkpoint there
    #[arg(long, value_name = "DIR", default_value = "out/detector")]
    out: PathBuf,
}

/// Trains, and writes `detector.safetensors` (averaged weights), `train.jsonl` and `checkpoints/` into the folder.
pub(crate) fn train(options: &Options) -> Result<(), Box<dyn Error>> {
    let device = device_named(&options.device)?.autodiff();
    device.seed(options.seed);
    let steps = (options.images as usize).div_ceil(BATCH);
    let trainer_options = TrainerOptions {
        rate: Rate {
            peak: options.rate,
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
    };
    let network = match &options.weights {
        Some(file) => load(Network::new(&device), Layout::Diffusers, file)?,
        None => Network::new(&device),
    };
    let mut trainer = Trainer::new(network, trainer_options, vec![device]);
    let state = json!({
        "seed": options.seed, "recipe": options.recipe.name(), "images": options.images, "batch": BATCH,
        "distinct": options.distinct, "size": SIZE, "rate": options.rate, "weights": options.weights,
    });
    let checkpoints = options.out.join("checkpoints");
    if let Some(checkpoint) = Checkpoint::newest(&checkpoints)? {
        trainer.restore(checkpoint, &state)?;
    }
    std::fs::create_dir_all(&options.out)
        .map_err(|error| format!("cannot make {}: {error}", options.out.display()))?;
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let source = options.recipe.source(options.seed, SIZE)?;
    let source: Arc<dyn Source> = match options.distinct {
        Some(count) => Arc::new(Repeated::new(source, count as usize)),
        None => source,
    };
    let mut batches = Loader::new(source)
        .batch(BATCH)
        .threads(threads)
        .start(trainer.steps() as u64)
        .on(&device_named("flex")?)?;
    let mut metrics = Metrics::open(&options.out.join("train.jsonl"), trainer.steps())?;
    let bar = progress::bar(steps as u64, "steps");
    let mut prepare = |step: usize| prepared(&mut batches, step, options.seed);
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
                    *parts
                        .lock()
                        .unwrap_or_else(std::sync::PoisonError::into_inner) = terms;
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
        let [tips, lines, directions, extents] = parts.into_inner().unwrap_or_default();
        let more =
            json!({"tips": tips, "lines": lines, "directions": directions, "extents": extents});
        metrics.write(trainer.steps(), steps, report, &more)?;
        bar.set_position(trainer.steps() as u64);
        if trainer.steps().is_multiple_of(options.every as usize) || trainer.steps() == steps {
            trainer.checkpoint(&state)?.write(&checkpoints)?;
            save(
                &trainer.averaged(),
                &options.out.join("detector.safetensors"),
            )?;
        }
    }
    bar.finish_and_clear();
    println!("{steps} steps, weights in {}", options.out.display());
    Ok(())
}

/// Writes weights as they ship: 16 bits.
fn save(network: &Network, path: &Path) -> wake_ldm::Result<()> {
    save_as(network, Layout::Diffusers, path, Precision::F16)
}

/// The images of a step, turned and mirrored as the geometry of other passes would.
fn prepared(batches: &mut Batches, step: usize, seed: u64) -> wake_ldm::Result<Vec<Prepared>> {
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
