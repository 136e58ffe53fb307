//! The command line.

use super::stages::STAGES;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// Measure every fast method of the simulator against its slow oracle.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Folder of the results, made if absent
    #[arg(long, value_name = "DIR", default_value = "out/bench")]
    pub(crate) out: PathBuf,
    /// Print {"rows": [...]} on standard output, and nothing else
    #[arg(long)]
    pub(crate) json: bool,
    /// Largest size of the sweep over sizes, 128 to 2048 [pixels]
    #[arg(long, default_value_t = 2048, value_parser = clap::value_parser!(u32).range(128..=2048))]
    pub(crate) largest: u32,
    /// What to measure
    #[arg(long, value_enum, default_value = "all")]
    pub(crate) part: Part,
    /// Where the loader's model and the blocks compute: flex, ndarray, wgpu or cuda, where compiled in
    #[arg(long, default_value = "flex")]
    pub(crate) device: String,
    /// Stages of the simulator alone, without spacing, model, loader and schedulers [repeatable; default: all]
    #[arg(long, value_name = "STAGE", value_parser = STAGES)]
    pub(crate) stage: Vec<String>,
    /// With --part device: blocks whose names contain this alone [repeatable; default: all]
    #[arg(long, value_name = "NAME")]
    pub(crate) block: Vec<String>,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Part {
    All,
    /// The fast methods of the simulator
    Simulator,
    /// The model
    Model,
    /// Images per second of the data set's loader
    Loader,
    /// Schedulers of Stable Diffusion, steps against error on a problem with a known answer
    Schedulers,
    /// Blocks of the networks on --device against flex (not part of all)
    Device,
}
