//! Arguments of `wake bench`.

use super::stages::STAGES;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// Measure speed and error of the simulator's fast methods against their slow oracles.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Folder for the results, created if absent
    #[arg(long, value_name = "DIR", default_value = "out/bench")]
    pub(crate) out: PathBuf,
    /// Print {"rows": [...]} on standard output, and nothing else
    #[arg(long)]
    pub(crate) json: bool,
    /// Largest size of the sweep over sizes, 128 to 2048 (pixels)
    #[arg(long, default_value_t = 2048, value_parser = clap::value_parser!(u32).range(128..=2048))]
    pub(crate) largest: u32,
    /// Part to measure
    #[arg(long, value_enum, default_value = "all")]
    pub(crate) part: Part,
    /// Device of the loader's model and of the blocks: flex, ndarray, wgpu or cuda, if compiled in
    #[arg(long, default_value = "flex")]
    pub(crate) device: String,
    /// Measure only this stage of the simulator, without spacing, model, loader and schedulers [repeatable; default:
    /// all]
    #[arg(long, value_name = "STAGE", value_parser = STAGES)]
    pub(crate) stage: Vec<String>,
    /// With --part device: measure only blocks whose names contain this [repeatable; default: all]
    #[arg(long, value_name = "NAME")]
    pub(crate) block: Vec<String>,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Part {
    All,
    /// Fast methods of the simulator
    Simulator,
    /// The model
    Model,
    /// Images per second of the data set loader
    Loader,
    /// Schedulers of Stable Diffusion: steps against error on a problem with a known answer
    Schedulers,
    /// Blocks of the networks on --device against flex (not part of all)
    Device,
}
