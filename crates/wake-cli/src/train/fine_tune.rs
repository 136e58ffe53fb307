//! A Stable Diffusion-layout model learns to draw wakes.

use std::path::PathBuf;

use clap::Args;
use wake_dataset::Folder;
use wake_train::FineTuning;

use super::options::{Pace, Place, Thrift};
use super::screen::Screen;
use crate::exit::Outcome;

/// Defaults of the options that all runs have; batch and rate are the paper's.
pub(crate) const DEFAULTS: &[(&str, &str)] = &[
    ("steps", "1000"),
    ("batch", "16"),
    ("rate", "1e-5"),
    ("every", "250"),
    ("out", "out/fine_tune"),
];

/// Fit a model in diffusers layout to simulated pairs: its U-Net, or low-rank changes of it.
#[derive(Args)]
pub(crate) struct Options {
    /// Folder of the model in diffusers layout
    #[arg(long, value_name = "DIR")]
    weights: PathBuf,
    /// Folder that `wake dataset` wrote
    #[arg(long, value_name = "DIR")]
    data: PathBuf,
    /// Learn changes of this rank of the attentions, and leave all else [default: the whole U-Net learns]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    rank: Option<u16>,
    /// γ of the weights by signal-to-noise ratio [default: all steps count the same]
    #[arg(long, value_name = "GAMMA")]
    snr_gamma: Option<f64>,
    #[command(flatten)]
    pace: Pace,
    #[command(flatten)]
    place: Place,
    #[command(flatten)]
    thrift: Thrift,
}

pub(crate) fn run(options: &Options) -> Outcome<()> {
    let tuning = FineTuning {
        weights: &options.weights,
        data: &Folder::open(&options.data)?,
        rank: options.rank.map(usize::from),
        snr_gamma: options.snr_gamma,
        options: options.place.paced(&options.pace, &options.thrift)?,
    };
    let screen = Screen::saying(&options.place.out, |_, steps, out| {
        format!("{steps} steps, model in {out}")
    });
    tuning.train(&options.place.out, &screen.watch())?;
    screen.end()
}
