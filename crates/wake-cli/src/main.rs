#![doc = include_str!("../README.md")]
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod exit;
#[cfg(any(feature = "simulate", feature = "detect"))]
mod progress;

#[cfg(feature = "locate")]
mod locate;

#[cfg(feature = "simulate")]
mod sheet;
#[cfg(feature = "simulate")]
mod estimate;
#[cfg(feature = "simulate")]
mod simulate;

#[cfg(feature = "prompt")]
mod prompt;

#[cfg(feature = "dataset")]
mod dataset;

#[cfg(feature = "generate")]
mod generate;

#[cfg(feature = "detect")]
mod detect;
#[cfg(feature = "detect")]
mod named;
#[cfg(feature = "detect")]
mod picture;

#[cfg(feature = "export")]
mod export;

#[cfg(feature = "train")]
mod sea_images;
#[cfg(feature = "train")]
mod train;

#[cfg(feature = "train")]
mod evaluate;

#[cfg(feature = "bench")]
mod bench;
#[cfg(feature = "bench")]
mod gallery;

mod shell;

use clap::{CommandFactory, Parser, Subcommand};
use std::process::ExitCode;

/// Simulate, generate and find ship wakes in radar images.
#[derive(Parser)]
#[command(name = "wake", version, propagate_version = true)]
struct Program {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    #[cfg(feature = "simulate")]
    Simulate(simulate::Arguments),
    #[cfg(feature = "prompt")]
    Prompt(prompt::Arguments),
    #[cfg(feature = "generate")]
    Generate(generate::Arguments),
    #[cfg(feature = "dataset")]
    Dataset(dataset::Arguments),
    #[cfg(feature = "train")]
    Train(train::Arguments),
    #[cfg(feature = "detect")]
    Detect(detect::Arguments),
    #[cfg(feature = "locate")]
    Locate(locate::Arguments),
    #[cfg(feature = "train")]
    Evaluate(evaluate::Arguments),
    #[cfg(feature = "simulate")]
    Estimate(estimate::Arguments),
    #[cfg(feature = "export")]
    Export(export::Arguments),
    #[cfg(feature = "bench")]
    Bench(bench::Arguments),
    #[cfg(feature = "bench")]
    #[command(hide = true)]
    Gallery(gallery::Arguments),
    Completions(shell::Completions),
    Man(shell::Man),
}

fn main() -> ExitCode {
    exit::code(|| match Program::parse().command {
        #[cfg(feature = "simulate")]
        Command::Simulate(arguments) => simulate::run(&arguments),
        #[cfg(feature = "prompt")]
        Command::Prompt(arguments) => prompt::run(&arguments),
        #[cfg(feature = "generate")]
        Command::Generate(arguments) => generate::run(&arguments),
        #[cfg(feature = "dataset")]
        Command::Dataset(arguments) => dataset::run(&arguments),
        #[cfg(feature = "train")]
        Command::Train(arguments) => train::run(&arguments),
        #[cfg(feature = "detect")]
        Command::Detect(arguments) => detect::run(&arguments),
        #[cfg(feature = "locate")]
        Command::Locate(arguments) => locate::run(&arguments),
        #[cfg(feature = "train")]
        Command::Evaluate(arguments) => evaluate::run(&arguments),
        #[cfg(feature = "simulate")]
        Command::Estimate(arguments) => estimate::run(&arguments),
        #[cfg(feature = "export")]
        Command::Export(arguments) => export::run(&arguments),
        #[cfg(feature = "bench")]
        Command::Bench(arguments) => bench::run(&arguments),
        #[cfg(feature = "bench")]
        Command::Gallery(arguments) => gallery::run(&arguments),
        Command::Completions(arguments) => shell::completions(&arguments, Program::command()),
        Command::Man(arguments) => shell::man(&arguments, Program::command()),
    })
}
