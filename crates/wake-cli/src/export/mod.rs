//! `wake export`: models for other programs.

mod hub;
mod onnx;

use clap::Subcommand;

use crate::exit::Outcome;

/// Export models for other programs.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    Onnx(onnx::Arguments),
    Hub(hub::Arguments),
}

pub(crate) fn run(arguments: &Arguments) -> Outcome<()> {
    match &arguments.what {
        What::Onnx(arguments) => onnx::run(arguments),
        What::Hub(arguments) => hub::run(arguments),
    }
}
