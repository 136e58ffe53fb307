//! Arguments of `wake evaluate estimate`.

use std::path::PathBuf;

use clap::Args;

/// Estimate ship and wind on simulated images, and compare errors with error bars and bounds.
///
/// Writes `estimates.jsonl` (a line per image), `report.json` and `report.md` into the folder. An interrupted run
/// continues where it stopped; delete the folder after a change of the program.
#[derive(Args)]
pub(crate) struct Options {
    /// Number of scenes of the paper's ranges
    #[arg(long, default_value_t = 200, value_parser = clap::value_parser!(u32).range(1..=65536))]
    pub(super) count: u32,
    /// Number of scenes of the recipe detector
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u32).range(0..=65536))]
    pub(super) satellites: u32,
    /// Number of images of each other set: detected wakes, images of the wake model, wrong assumptions, known parts of
    /// the estimate, sea without ships
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u32).range(0..=65536))]
    pub(super) others: u32,
    /// Folder of real tiles with labels.json; only headings are compared
    #[arg(long, value_name = "DIR")]
    pub(super) real: Option<PathBuf>,
    /// Device of the detector and the wake model: flex, ndarray, wgpu or cuda, if compiled in
    #[arg(long, default_value = "flex")]
    pub(super) device: String,
    /// Number of images estimated in parallel, each with a share of the threads
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub(super) jobs: u32,
    /// Folder for the results, created if absent
    #[arg(long, value_name = "DIR", default_value = "out/evaluate_estimate")]
    pub(super) out: PathBuf,
    /// Print the report as JSON on standard output, and nothing else
    #[arg(long)]
    pub(super) json: bool,
}
