//! `wake train detector`: the network learns from images made on the fly, and can be stopped and continued.

use std::path::PathBuf;

use wake_nn::device_named;
use wake_train::detector::{Recipe, Training, train};

use crate::exit::{self, Outcome};
use crate::{named, progress};

/// Train the detector on images made on the fly; a run that was killed goes on when it is started again.
#[derive(clap::Args, Debug, Clone)]
pub(crate) struct Options {
    /// Images to learn from
    #[arg(long, default_value_t = 40_000, value_parser = clap::value_parser!(u32).range(1..=100_000_000))]
    images: u32,
    /// Different images, which come again when all were seen; by default all are different
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u32).range(16..=1_000_000))]
    distinct: Option<u32>,
    /// What the images show
    #[arg(long, default_value = Recipe::Mixed.name(), value_parser = named::recipe())]
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
pub(crate) fn run(options: &Options) -> Outcome<()> {
    let training = Training {
        images: options.images as usize,
        distinct: options.distinct.map(|count| count as usize),
        recipe: options.recipe,
        weights: options.weights.clone(),
        seed: options.seed,
        rate: options.rate,
        every: options.every as usize,
    };
    let steps = training.steps();
    let bar = progress::bar(steps as u64, "steps");
    let device = device_named(&options.device)?;
    train(&training, &device, &options.out, |step| {
        bar.set_position(step as u64);
    })?;
    bar.finish_and_clear();
    let out = options.out.display();
    Ok(exit::say(&format!("{steps} steps, weights in {out}"))?)
}
