//! `wake train text-to-image`: trains a small model of Stable Diffusion's kind from scratch, on images and prompts.

use std::path::PathBuf;

use clap::Args;
use wake_dataset::Recipe;
use wake_train::{LatentShape, PipelineTraining, TrainingPairs};

use super::options::{Pace, Place, Thrift};
use super::screen::Screen;
use super::source::{check_memory, folder};
use crate::exit::Outcome;

/// Recipe of the pairs that are simulated without `--data`.
const RECIPE: &str = include_str!("text_to_image.toml");

/// Defaults of the options that all trainings have.
pub(crate) const DEFAULTS: &[(&str, &str)] = &[
    ("steps", "5000"),
    ("batch", "16"),
    ("rate", "5e-4"),
    ("every", "1000"),
    ("out", "out/text_to_image"),
];

/// Train a small text-to-image model in Stable Diffusion's layout from scratch, on images and prompts.
///
/// Fits the autoencoder in closed form, trains the text encoder alone, then text encoder and U-Net together. `wake generate
/// --weights`, `wake evaluate pipeline --weights` and `wake train fine-tune --weights` read the model.
#[derive(Args)]
pub(crate) struct Options {
    /// Folder of a data set of `wake dataset` [default: simulate pairs first]
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Number of pairs to simulate without --data
    #[arg(long, default_value_t = 4000, value_parser = clap::value_parser!(u64).range(8..=10_000_000))]
    count: u64,
    /// Training steps of the text encoder alone, on the values that prompts state; --steps is for text encoder and U-Net
    #[arg(long, default_value_t = 2500, value_parser = clap::value_parser!(u32).range(1..))]
    text_steps: u32,
    /// Stop after this many of --steps; continue with --resume
    #[arg(long, value_name = "STEPS", value_parser = clap::value_parser!(u32).range(1..))]
    stop_after: Option<u32>,
    /// Pixels per latent pixel along each axis
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u16).range(1..=16))]
    downsampling: u16,
    /// Channels of the latents, at most the square of --downsampling
    #[arg(long, default_value_t = 32, value_parser = clap::value_parser!(u16).range(1..=256))]
    latents: u16,
    #[command(flatten)]
    pace: Pace,
    #[command(flatten)]
    place: Place,
    #[command(flatten)]
    thrift: Thrift,
}

pub(crate) fn run(options: &Options) -> Outcome<()> {
    let constants = options.place.paced(&options.pace, &options.thrift)?;
    let pairs = match &options.data {
        Some(path) => TrainingPairs::folder(folder(path)?),
        None => {
            let recipe = Recipe::from_toml(RECIPE)?;
            TrainingPairs::simulated(recipe, options.place.seed, options.count)?
        }
    };
    let training = PipelineTraining {
        pairs: &pairs,
        text_steps: Some(options.text_steps as usize),
        latents: LatentShape {
            channels: usize::from(options.latents),
            downsampling: usize::from(options.downsampling),
        },
        stop_after: options.stop_after.map(|steps| steps as usize),
        options: constants,
    };
    training.check()?;
    check_memory(pairs.len(), training.bytes())?;
    let screen = Screen::new(&options.place.out);
    training.train(&options.place.out, &screen.watch())?;
    screen.end()
}
