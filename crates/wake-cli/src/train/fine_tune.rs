//! `wake train fine-tune`: fine-tunes a model in Stable Diffusion's layout on wake images.

use std::path::PathBuf;

use clap::Args;
use wake_dataset::Folder;
use wake_train::{FineTuning, StageOptions};

use super::options::{Pace, Place, Thrift};
use super::screen::Screen;
use crate::exit::{self, Outcome};

/// Defaults of the options that all trainings have; batch and rate are the paper's.
pub(crate) const DEFAULTS: &[(&str, &str)] = &[
    ("steps", "1000"),
    ("batch", "16"),
    ("rate", "1e-5"),
    ("every", "250"),
    ("out", "out/fine_tune"),
];

/// Checkpoint size from which a warning is printed \[bytes\].
const UNWARNED: u64 = 1 << 30;

/// Fine-tune a model in diffusers layout on simulated pairs: the whole U-Net, or a low-rank adaptation (LoRA).
///
/// Reads the layout of the Stable Diffusion download: `unet`, `vae`, `text_encoder`, `tokenizer` and `scheduler`, each
/// with its `config.json` and `*.safetensors`; other files are ignored. `docs/paper.md` repeats the paper's experiment.
#[derive(Args)]
pub(crate) struct Options {
    /// Folder of the model in diffusers layout
    #[arg(long, value_name = "DIR")]
    weights: PathBuf,
    /// Folder of a data set of `wake dataset`
    #[arg(long, value_name = "DIR")]
    data: PathBuf,
    /// Rank of a low-rank adaptation of the attention layers [default: train the whole U-Net]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    rank: Option<u16>,
    /// Epochs, instead of --steps; the paper uses 4000
    #[arg(long, conflicts_with = "steps", value_parser = epochs)]
    epochs: Option<f64>,
    /// γ of the min-SNR loss weights [default: equal weights]
    #[arg(long, value_name = "GAMMA")]
    snr_gamma: Option<f64>,
    #[command(flatten)]
    pace: Pace,
    #[command(flatten)]
    place: Place,
    #[command(flatten)]
    thrift: Thrift,
}

fn epochs(text: &str) -> Result<f64, String> {
    let number: f64 = text.parse().map_err(|_| "expected a number".to_owned())?;
    match number > 0.0 && number <= 1e6 {
        true => Ok(number),
        false => Err("expected a number above 0, up to 1e6".to_owned()),
    }
}

pub(crate) fn run(options: &Options) -> Outcome<()> {
    let data = Folder::open(&options.data)?;
    let stage = options.place.paced(&options.pace, &options.thrift)?;
    let steps = options.epochs.map(|epochs| {
        let steps = epochs * data.trainset().len() as f64 / f64::from(options.pace.batch);
        (steps.ceil() as usize).max(1)
    });
    let tuning = FineTuning {
        weights: &options.weights,
        data: &data,
        rank: options.rank.map(usize::from),
        snr_gamma: options.snr_gamma,
        options: StageOptions {
            steps: steps.or(stage.steps),
            ..stage
        },
    };
    warn_of_disk(&tuning)?;
    let screen = Screen::saying(&options.place.out, |_, steps, out| {
        format!("{steps} steps, model in {out}")
    });
    tuning.train(&options.place.out, &screen.watch())?;
    screen.end()
}

/// Prints the disk space that checkpoints take, if it is large.
fn warn_of_disk(tuning: &FineTuning<'_>) -> Outcome<()> {
    let [checkpoint, model] = tuning.disk()?;
    let keep = tuning.options.keep as u64;
    let most = (keep + 1) * checkpoint + model;
    if checkpoint >= UNWARNED {
        let gb = |bytes: u64| bytes as f64 * 1e-9;
        exit::note(&format!(
            "note: a checkpoint takes {:.1} GB and the model {:.1} GB; with --keep {keep}, up to {:.0} GB are \
             needed (a checkpoint every {} steps)",
            gb(checkpoint),
            gb(model),
            gb(most),
            tuning.options.every
        ));
    }
    Ok(())
}
