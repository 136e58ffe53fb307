//! Arguments of `wake evaluate`.

use super::common::Common;
use super::{calibration, detector, domain, estimate, pipeline, sea};
use clap::{Args, Subcommand};
use std::path::PathBuf;

/// Evaluate the models against the simulator.
#[derive(Args)]
#[command(args_conflicts_with_subcommands = true)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) task: Option<Task>,
    /// Evaluate the simulator with another random sea instead of a model: the score of a perfect model
    #[arg(long)]
    pub(crate) simulator_only: bool,
    /// Folder of a small model of `wake train` [default: the shipped model]
    #[arg(long, value_name = "DIR", conflicts_with = "simulator_only")]
    pub(crate) weights: Option<PathBuf>,
    /// Sampling steps [default: the model's own]
    #[arg(long, conflicts_with = "simulator_only")]
    pub(crate) steps: Option<usize>,
    #[command(flatten)]
    pub(crate) common: Common,
}

#[derive(Subcommand)]
pub(crate) enum Task {
    Pipeline(pipeline::Options),
    Domain(domain::Options),
    Sea(sea::Options),
    Detector(detector::Options),
    Calibration(calibration::Options),
    Estimate(estimate::Options),
}
