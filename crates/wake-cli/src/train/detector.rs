//! `wake train detector`: the network learns from images made on the fly.

use std::path::PathBuf;

use clap::Args;
use wake_train::detector::{DetectorTraining, ImageRecipe, LabelledImages};

use super::options::{Pace, Place, Thrift};
use super::screen::Screen;
use crate::exit::Outcome;
use crate::named;

/// Defaults of the options that all runs have.
pub(crate) const DEFAULTS: &[(&str, &str)] = &[
    ("steps", "2500"),
    ("batch", "16"),
    ("rate", "2e-3"),
    ("every", "100"),
    ("out", "out/detector"),
];

/// Train the detector on images made on the fly.
#[derive(Args)]
pub(crate) struct Options {
    /// What the images show
    #[arg(long, default_value = ImageRecipe::Mixed.name(), value_parser = named::recipe())]
    recipe: ImageRecipe,
    /// Different images, which come again when all were seen; by default all are different
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u32).range(16..=1_000_000))]
    distinct: Option<u32>,
    /// Folder of labelled images (labels.json beside them) to learn from instead of a recipe
    #[arg(long, value_name = "DIR", conflicts_with_all = ["recipe", "distinct"])]
    labelled: Option<PathBuf>,
    /// Labelled image that is left out
    #[arg(long, value_name = "NAME", requires = "labelled")]
    without: Option<String>,
    /// Labelled images: the next ones by name after the one that is left out
    #[arg(long, value_name = "COUNT", requires = "labelled", value_parser = clap::value_parser!(u32).range(1..))]
    tiles: Option<u32>,
    /// Weights to begin with, by default random ones
    #[arg(long, value_name = "FILE")]
    weights: Option<PathBuf>,
    #[command(flatten)]
    pace: Pace,
    #[command(flatten)]
    place: Place,
    #[command(flatten)]
    thrift: Thrift,
}

/// Trains, and writes `detector.safetensors` (averaged weights) and what every run leaves in its folder.
pub(crate) fn run(options: &Options) -> Outcome<()> {
    let training = DetectorTraining {
        recipe: options.recipe,
        labelled: options.labelled.as_ref().map(|folder| LabelledImages {
            folder: folder.clone(),
            without: options.without.clone(),
            count: options.tiles.map(|count| count as usize),
        }),
        distinct: options.distinct.map(|count| count as usize),
        weights: options.weights.clone(),
        options: options.place.paced(&options.pace, &options.thrift)?,
    };
    let screen = Screen::saying(&options.place.out, |_, steps, out| {
        format!("{steps} steps, weights in {out}")
    });
    training.train(&options.place.out, &screen.watch())?;
    screen.end()
}
