//! `wake train wake-model`: trains the parts of the wake model.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use wake_ldm::network::{Part, WakeModelConfig};
use wake_train::{StageOptions, WakeTraining};

use super::options::{Place, Thrift};
use super::screen::Screen;
use super::source::{Pairs, check_memory};
use crate::exit::Outcome;

/// Defaults of the options that all trainings have.
pub(crate) const DEFAULTS: &[(&str, &str)] = &[("every", "500"), ("out", "out/train")];

/// Part of the wake model, as [`Part`].
#[derive(Clone, Copy, ValueEnum)]
enum Trained {
    /// Linear autoencoder, fitted in closed form
    Patches,
    /// Prompt parser
    Parser,
    /// Mean and standard deviation of the latents
    Prior,
    /// Flow
    Flow,
}

/// Train the wake model, part by part.
///
/// First completes the parts before the selected one if their weights are not in --out, so `flow`, the last, trains the
/// whole model. Writes `config.json`, `PART.safetensors` (EMA weights, 16 bits) and a log `PART.jsonl` for each part,
/// `explained_variance.json`, `sheet.png`, `run.json`, and `checkpoints/`.
#[derive(Args, Clone)]
pub(crate) struct Options {
    /// Part to train
    #[arg(value_enum, default_value_t = Trained::Flow)]
    part: Trained,
    #[command(flatten)]
    pairs: Pairs,
    /// JSON file with the widths of the model [default: widths of the shipped model]
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Training steps [default: parser 4000, prior 6000, flow 6000]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    steps: Option<u32>,
    /// Examples per batch [default: parser 128, prior 32, flow 8]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    batch: Option<u16>,
    /// Peak learning rate [default: parser 1e-3, prior 2e-3, flow 1e-3]
    #[arg(long)]
    rate: Option<f64>,
    #[command(flatten)]
    place: Place,
    #[command(flatten)]
    thrift: Thrift,
}

/// Trains a part after the parts that it needs.
pub(crate) fn run(options: &Options) -> Outcome<()> {
    let part = match options.part {
        Trained::Patches => Part::Patches,
        Trained::Parser => Part::Parser,
        Trained::Prior => Part::Prior,
        Trained::Flow => Part::Flow,
    };
    let constants = StageOptions {
        steps: options.steps.map(|steps| steps as usize),
        batch: options.batch.map(usize::from),
        rate: options.rate,
        ..options.place.stage(&options.thrift)?
    };
    let config = config(options)?;
    let pairs = match part {
        Part::Parser => None,
        _ => Some(options.pairs.fitting(&config, options.place.seed)?),
    };
    if let Some(pairs) = &pairs {
        check_memory(
            pairs.len(),
            WakeTraining::memory(&config, pairs.len(), part),
        )?;
    }
    let out = options.place.out.clone();
    let screen = Screen::new(&out);
    let progress = screen.watch();
    WakeTraining::open(out.clone(), (part, constants), config, pairs, &progress)?.run()?;
    screen.end()
}

/// The widths of the model: from --config, else from --out, else the standard ones for the pairs.
fn config(options: &Options) -> Outcome<WakeModelConfig> {
    let written = options.place.out.join(WakeModelConfig::FILE);
    let file = match &options.config {
        Some(file) => Some(file),
        None => Some(&written).filter(|file| file.exists()),
    };
    Ok(match file {
        Some(file) => WakeModelConfig::read(file)?,
        None => options.pairs.of(options.place.seed)?.model()?,
    })
}
