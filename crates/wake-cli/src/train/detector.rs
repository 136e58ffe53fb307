//! `wake train detector`: trains the network on images made on the fly, or on a data set.

use std::path::PathBuf;

use clap::Args;
use wake_train::detector::{
    DetectorTraining, ImageRecipe, LabelledImages, MadeImages, TrainingImages,
};

use super::options::{Pace, Place, Thrift};
use super::screen::Screen;
use crate::exit::Outcome;
use crate::named;

/// Defaults of the options that all trainings have.
pub(crate) const DEFAULTS: &[(&str, &str)] = &[
    ("steps", "2500"),
    ("batch", "16"),
    ("rate", "2e-3"),
    ("every", "100"),
    ("out", "out/detector"),
];

/// Train the detector on images made on the fly, or on a data set.
#[derive(Args)]
pub(crate) struct Options {
    /// Recipe of the training images, with --labelled of every other one [default: mixed, with --labelled none]
    #[arg(long, value_parser = named::recipe())]
    recipe: Option<ImageRecipe>,
    /// Number of different images of the recipe, which repeat in turn; in mixed and full only of simulated images, painted ones are new [default: no image repeats]
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u32).range(16..=1_000_000))]
    distinct: Option<u32>,
    /// Folder of a data set of `wake dataset` with images of 256 x 256 pixels, instead of a recipe
    #[arg(long, value_name = "DIR", conflicts_with_all = ["recipe", "distinct"])]
    data: Option<PathBuf>,
    /// Folder of labelled images with labels.json, instead of a recipe, or beside the one given
    #[arg(long, value_name = "DIR", conflicts_with = "data")]
    labelled: Option<PathBuf>,
    /// Labelled images to leave out, separated by commas
    #[arg(
        long,
        value_name = "NAMES",
        value_delimiter = ',',
        requires = "labelled"
    )]
    without: Vec<String>,
    /// Number of labelled images, in order of name after the first one left out [default: all]
    #[arg(long, value_name = "COUNT", requires = "labelled", value_parser = clap::value_parser!(u32).range(1..))]
    tiles: Option<u32>,
    /// Initial weights [default: random]
    #[arg(long, value_name = "FILE")]
    weights: Option<PathBuf>,
    #[command(flatten)]
    pace: Pace,
    #[command(flatten)]
    place: Place,
    #[command(flatten)]
    thrift: Thrift,
}

impl Options {
    /// The training images; clap rejects conflicting options.
    fn images(&self) -> TrainingImages {
        let made = MadeImages {
            recipe: self.recipe.unwrap_or_default(),
            distinct: self.distinct.map(|count| count as usize),
        };
        let labelled = |folder: &PathBuf| LabelledImages {
            folder: folder.clone(),
            without: self.without.clone(),
            count: self.tiles.map(|count| count as usize),
        };
        let beside = self.recipe.is_some() || self.distinct.is_some();
        match (&self.labelled, &self.data) {
            (Some(folder), _) if beside => TrainingImages::Both(labelled(folder), made),
            (Some(folder), _) => TrainingImages::Labelled(labelled(folder)),
            (None, Some(folder)) => TrainingImages::Data(folder.clone()),
            (None, None) => TrainingImages::Recipe(made),
        }
    }
}

/// Trains, and writes `detector.safetensors` (EMA weights) and the standard files of a run.
pub(crate) fn run(options: &Options) -> Outcome<()> {
    let training = DetectorTraining {
        images: options.images(),
        weights: options.weights.clone(),
        options: options.place.paced(&options.pace, &options.thrift)?,
    };
    let screen = Screen::saying(&options.place.out, |_, steps, out| {
        format!("{steps} steps, weights in {out}")
    });
    training.train(&options.place.out, &screen.watch())?;
    screen.end()
}
