//! `wake train wake-model`: the stages of the wake model.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use wake_ldm::network::WakeModelConfig;
use wake_train::{LatentSet, StageOptions, WakeStage, WakeTraining};

use super::options::{Place, Thrift};
use super::screen::Screen;
use super::source::{check_memory, fitting, pairs};
use crate::exit::{self, Outcome};

/// Defaults of the options that all runs have.
pub(crate) const DEFAULTS: &[(&str, &str)] = &[("every", "500"), ("out", "out/train")];

/// A stage of the wake model.
#[derive(Clone, Copy, ValueEnum)]
enum Stage {
    /// Fit the patch transform, in closed form
    Autoencoder,
    /// Train the reader of prompts
    Words,
    /// Train mean and spread of the latents
    Mean,
    /// Train the flow that draws the sea
    Diffusion,
}

/// Train the wake model, stage by stage.
///
/// A stage runs the earlier ones first, or to their end, where their weights are not in --out yet; so `diffusion`, the last,
/// trains the whole model. Writes `config.json`, `patches.safetensors`, `reader.safetensors`, `prior.safetensors`,
/// `flow.safetensors` (averaged weights, 16 bits), `shares.json`, a log `STAGE.jsonl` of each stage, `sheet.png`, `run.json`,
/// and `checkpoints/`.
#[derive(Args, Clone)]
pub(crate) struct Options {
    /// The stage to reach
    #[arg(value_enum, default_value_t = Stage::Diffusion)]
    stage: Stage,
    /// Folder that `wake dataset` wrote; without it, pairs are simulated first
    #[arg(long, value_name = "DIR")]
    pub(crate) data: Option<PathBuf>,
    /// paper, ranges, detector or model, or a recipe file: the pairs to simulate where there is no --data
    #[arg(long, default_value = "model", conflicts_with = "data")]
    pub(crate) recipe: String,
    /// Pairs to simulate where there is no --data
    #[arg(long, default_value_t = 2000, value_parser = clap::value_parser!(u64).range(8..=10_000_000))]
    pub(crate) count: u64,
    /// JSON file with the widths of the model [default: those of the model that ships]
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Steps of the whole stage [default: words 4000, mean 6000, diffusion 6000]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    steps: Option<u32>,
    /// Examples of a batch [default: words 128, mean 32, diffusion 8]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    batch: Option<u16>,
    /// Largest step of the optimizer [default: words 1e-3, mean 2e-3, diffusion 1e-3]
    #[arg(long)]
    rate: Option<f64>,
    #[command(flatten)]
    pub(crate) place: Place,
    #[command(flatten)]
    thrift: Thrift,
}

/// Runs a stage, after those that it needs.
pub(crate) fn run(options: &Options) -> Outcome<()> {
    let stage = match options.stage {
        Stage::Autoencoder => WakeStage::Autoencoder,
        Stage::Words => WakeStage::Words,
        Stage::Mean => WakeStage::Mean,
        Stage::Diffusion => WakeStage::Diffusion,
    };
    let constants = StageOptions {
        steps: options.steps.map(|steps| steps as usize),
        batch: options.batch.map(usize::from),
        rate: options.rate,
        ..options.place.stage(&options.thrift)?
    };
    let config = config(options)?;
    let pairs = match stage {
        WakeStage::Words => None,
        _ => Some(fitting(options, &config)?),
    };
    if let (Some(pairs), WakeStage::Mean | WakeStage::Diffusion) = (&pairs, stage) {
        check_memory(pairs.len(), LatentSet::bytes(&config, pairs.len()))?;
    }
    let out = options.place.out.clone();
    let screen = Screen::new(&out);
    let progress = screen.watch();
    let mut training =
        WakeTraining::open(out.clone(), (stage, constants), config, pairs, &progress)?;
    match stage {
        WakeStage::Autoencoder => {
            let shares = training.autoencoder()?;
            let line = |channels| {
                let (kept, psnr) = (100.0 * shares.kept(channels), shares.psnr(channels));
                format!("{channels:2} channels: {kept:.2} % of the variance, {psnr:.2} dB")
            };
            exit::say(&[4, 8, 16].map(line).join("\n"))?;
        }
        WakeStage::Words => training.words()?,
        WakeStage::Mean => training.mean()?,
        WakeStage::Diffusion => training.diffusion()?,
    }
    screen.end()
}

/// The widths of the model: those of --config, else those in --out, else the standard ones for the pairs.
fn config(options: &Options) -> Outcome<WakeModelConfig> {
    let written = options.place.out.join("config.json");
    let file = match &options.config {
        Some(file) => Some(file),
        None => Some(&written).filter(|file| file.exists()),
    };
    Ok(match file {
        Some(file) => WakeModelConfig::read(file)?,
        None => pairs(options)?.model()?,
    })
}
