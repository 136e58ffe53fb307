//! Finds ship wakes in radar images with a small network that has never seen a real one.
//!
//! ```text
//! cargo run --release --example detector -- detect FILE|DIR... --json
//! cargo run --release --example detector -- train --images 40000 --out out/detector
//! cargo run --release --example detector -- evaluate --real DIR
//! ```
//!
//! `detect` tells every wake by tip, axis, half-angle, visible length and score, and draws the wakes of `NAME` into
//! `NAME.wakes.png` in `--out`; `--method radon` does the same by the classical transform. Files of a folder that cannot be
//! read are named, and the others are searched. `train` makes its images on the fly, and a run
//! that was killed goes on when it is started again. `evaluate` measures both methods on held-out images and on real
//! tiles with labels, and writes `report.md`. Without a command, wakes are found in a few simulated images and drawn
//! into `out/detector/simulated.png`.

#![warn(clippy::print_stdout, clippy::print_stderr)]

mod detect;
mod evaluate;
#[path = "../common/exit.rs"]
mod exit;
mod named;
mod picture;
#[path = "../common/progress.rs"]
mod progress;
mod real;
mod real_sea;
mod recall;
mod report;
mod show;
mod train;

use std::path::Path;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Find ship wakes in radar images.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Subcommand)]
enum Command {
    /// Train the network on images made on the fly
    Train(train::Options),
    /// Search images for wakes
    Detect(detect::Options),
    /// Measure how well wakes are found
    Evaluate(evaluate::Options),
}

fn main() -> ExitCode {
    exit::code(|| match Arguments::parse().command {
        Some(Command::Train(options)) => train::run(&options),
        Some(Command::Detect(options)) => detect::detect(&options),
        Some(Command::Evaluate(options)) => evaluate::evaluate(&options),
        None => show::show(Path::new("out/detector")),
    })
}
