//! Trains the small wake model on simulated pairs.
//!
//! ```text
//! cargo run --release --example train -- diffusion --data out/make_dataset
//! cargo run --release --example train -- diffusion --data out/make_dataset --resume
//! ```
//!
//! Four stages, each with its own subcommand: `autoencoder` fits the patch transform in closed form, `words` trains the
//! reader of prompts, `mean` the mean and spread of the latents, and `diffusion` the flow that draws the rest. A stage
//! runs the earlier ones first, or to their end, where their weights are not in `--out` yet. Writes there: `config.json`,
//! `patches.safetensors`, `reader.safetensors`, `prior.safetensors`, `flow.safetensors` (averaged weights, 16 bits),
//! `shares.json`, a log `STAGE.jsonl` for each stage, `sheet.png`, `run.json`, and `checkpoints/`. A run that was killed
//! goes on from its last checkpoint with `--resume`; what it promises is then made again where it is missing or older. A
//! folder belongs to one run: other data, another model, seed, rate or batch, and a new beginning, are refused by name.
//!
//! ```text
//! cargo run --release --example train -- sea --images chips --spacing 10
//! ```
//!
//! `sea` learns the sea of real radar images that nobody labelled ([data sets](../../docs/dataset.md)) and writes
//! `sea.safetensors`, which `generate --sea` and `make_dataset --sea` draw scenes on.
//!
//! ```text
//! cargo run --release --example train -- fine-tune --weights stable-diffusion-v1-4 --data out/make_dataset --rank 8
//! ```
//!
//! `fine-tune` changes a model in diffusers layout (as Stable Diffusion v1.4) instead, and writes the same layout.
//!
//! ```text
//! cargo run --release --example train -- text-to-image --count 4000
//! ```
//!
//! `text-to-image` learns a small model of that layout from nothing, from images and prompts alone: the autoencoder, then
//! text encoder and U-Net together. `generate --weights`, `evaluate --text-to-image` and `fine-tune` read it.

#[path = "../common/exit.rs"]
mod exit;
mod fine_tune;
mod options;
#[path = "../common/progress.rs"]
mod progress;
mod screen;
mod sea;
#[path = "../common/sea_images.rs"]
mod sea_images;
mod source;
mod stages;
mod text_to_image;

use std::error::Error;
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use options::defaults;
use wake_ldm::train::WakeStage;

type Outcome<T> = Result<T, Box<dyn Error>>;

/// Train the small wake model.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(subcommand)]
    stage: Stage,
}

#[derive(Subcommand)]
enum Stage {
    /// Fit the patch transform, in closed form.
    #[command(mut_args(defaults(stages::DEFAULTS)))]
    Autoencoder(stages::Options),
    /// Train the reader of prompts.
    #[command(mut_args(defaults(stages::DEFAULTS)))]
    Words(stages::Options),
    /// Train mean and spread of the latents.
    #[command(mut_args(defaults(stages::DEFAULTS)))]
    Mean(stages::Options),
    /// Train the flow that draws the sea.
    #[command(mut_args(defaults(stages::DEFAULTS)))]
    Diffusion(stages::Options),
    /// Learn the sea of a folder of real images, without labels.
    #[command(mut_args(defaults(sea::DEFAULTS)))]
    Sea(sea::Options),
    /// Learn a model of Stable Diffusion's kind from nothing.
    #[command(mut_args(defaults(text_to_image::DEFAULTS)))]
    TextToImage(text_to_image::Options),
    /// Fit a model in diffusers layout to simulated pairs: its U-Net, or low-rank changes of it.
    #[command(mut_args(defaults(fine_tune::DEFAULTS)))]
    FineTune(fine_tune::Options),
}

fn main() -> ExitCode {
    exit::code(|| match Arguments::parse().stage {
        Stage::Autoencoder(options) => stages::run(WakeStage::Autoencoder, &options),
        Stage::Words(options) => stages::run(WakeStage::Words, &options),
        Stage::Mean(options) => stages::run(WakeStage::Mean, &options),
        Stage::Diffusion(options) => stages::run(WakeStage::Diffusion, &options),
        Stage::Sea(options) => sea::run(&options),
        Stage::TextToImage(options) => text_to_image::run(&options),
        Stage::FineTune(options) => fine_tune::run(&options),
    })
}
