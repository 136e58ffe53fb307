//! `wake train`: trains the models.

mod detector;
mod fine_tune;
mod options;
mod screen;
mod sea;
mod source;
mod text_to_image;
mod wake_model;

use clap::{Args, Subcommand};
use options::defaults;

use crate::exit::Outcome;

/// Train the models; stopped runs can be continued.
///
/// Each folder belongs to one run. Other data, models, seeds, rates or batches, and new runs in a used folder, are rejected.
#[derive(Args)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    model: Model,
}

#[derive(Subcommand)]
#[expect(clippy::enum_variant_names, reason = "the wake model is called so")]
enum Model {
    #[command(mut_args(defaults(wake_model::DEFAULTS)))]
    WakeModel(wake_model::Options),
    #[command(mut_args(defaults(sea::DEFAULTS)))]
    Sea(sea::Options),
    #[command(mut_args(defaults(text_to_image::DEFAULTS)))]
    TextToImage(text_to_image::Options),
    #[command(mut_args(defaults(fine_tune::DEFAULTS)))]
    FineTune(fine_tune::Options),
    #[command(mut_args(defaults(detector::DEFAULTS)))]
    Detector(detector::Options),
}

pub(crate) fn run(arguments: &Arguments) -> Outcome<()> {
    match &arguments.model {
        Model::WakeModel(options) => wake_model::run(options),
        Model::Sea(options) => sea::run(options),
        Model::TextToImage(options) => text_to_image::run(options),
        Model::FineTune(options) => fine_tune::run(options),
        Model::Detector(options) => detector::run(options),
    }
}
