//! The command line.

use std::path::PathBuf;

use clap::Args;

/// Estimate ship and wind on simulated images, and compare errors with error bars and bounds.
///
/// Writes `estimates.jsonl` (a line an image), `report.json` and `report.md` into the folder. An interrupted run continues where
/// it stopped: delete the folder after a change of the program.
#[derive(Args)]
pub(crate) struct Options {
    /// Scenes of the paper's ranges
    #[arg(long, default_value_t = 200, value_parser = clap::value_parser!(u32).range(1..=65536))]
    pub(super) count: u32,
    /// Scenes of the recipe detector
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u32).range(0..=65536))]
    pub(super) satellites: u32,
    /// Images of each other set: detected wakes, images of the wake model, wrong assumptions, parts of the estimate that are known, sea without ships
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u32).range(0..=65536))]
    pub(super) others: u32,
    /// Folder of real tiles with labels.json: headings alone are compared
    #[arg(long, value_name = "DIR")]
    pub(super) real: Option<PathBuf>,
    /// flex, ndarray, wgpu or cuda, where compiled in: of the detector and the wake model
    #[arg(long, default_value = "flex")]
    pub(super) device: String,
    /// Images that are estimated at once, with a part of the threads each
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub(super) jobs: u32,
    /// Folder of the results, made if absent
    #[arg(long, value_name = "DIR", default_value = "out/evaluate_estimate")]
    pub(super) out: PathBuf,
    /// Print the report as JSON on standard output, and nothing else
    #[arg(long)]
    pub(super) json: bool,
}
