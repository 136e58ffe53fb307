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

/// Train the models; a stopped run continues.
///
/// A folder belongs to one run: other data, another model, seed, rate or batch, and a new beginning, are refused by name.
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
