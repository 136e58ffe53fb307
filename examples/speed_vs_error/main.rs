//! Every fast method against its oracle: seconds, error, and the frontier.
//!
//! ```text
//! cargo run --release --example speed_vs_error
//! ```
//!
//! Writes `report.json`, `table.md` and `frontier.svg` (log-log). Sea and wake get the 10⁴ strongest waves of the
//! default scene, the paper's own method and scale; the oracle of both is the harmonic sum, the strong baseline the
//! same sum as a matrix product. Above 256 × 256 the oracles run on 4,096 random pixels and their times are scaled up.

#[path = "../common/exit.rs"]
mod exit;
mod plot;
#[path = "../common/progress.rs"]
mod progress;
mod row;
mod stages;

use clap::Parser;
use row::Row;
use serde_json::json;
use stages::{Memo, STAGES, measure};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use wake_physics::output;

/// Sizes of the sweep at the default tolerance.
const SIZES: [usize; 5] = [128, 256, 512, 1024, 2048];
/// Tolerances of the sweep at [`FRONTIER_SIZE`].
const TOLERANCES: [f64; 5] = [1e-1, 1e-2, 1e-3, 1e-4, 1e-5];
const FRONTIER_SIZE: usize = 512;
const DEFAULT_TOLERANCE: f64 = 1e-3;

/// Measure every fast method of the simulator against its slow oracle.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    /// Folder of the results, made if absent
    #[arg(long, value_name = "DIR", default_value = "out/speed_vs_error")]
    out: PathBuf,
    /// Print {"rows": [...]} on standard output, and nothing else
    #[arg(long)]
    json: bool,
    /// Largest size of the sweep over sizes, 128 to 2048 [pixels]
    #[arg(long, default_value_t = 2048, value_parser = clap::value_parser!(u32).range(128..=2048))]
    largest: u32,
}

fn main() -> ExitCode {
    exit::code(run(&Arguments::parse()))
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn std::error::Error>> {
    output::make_folder(&arguments.out)?;
    let mut cases: Vec<(usize, f64)> = TOLERANCES.map(|t| (FRONTIER_SIZE, t)).to_vec();
    let sizes = SIZES
        .into_iter()
        .filter(|&n| n <= arguments.largest as usize);
    cases.extend(
        sizes
            .filter(|&n| n != FRONTIER_SIZE)
            .map(|n| (n, DEFAULT_TOLERANCE)),
    );
    let bar = progress::bar((cases.len() * STAGES.len()) as u64, "rows");
    let (mut rows, mut memo) = (Vec::new(), Memo::default());
    for stage in STAGES {
        for &(size, tolerance) in &cases {
            rows.push(measure(stage, size, tolerance, &mut memo)?);
            bar.inc(1);
        }
    }
    bar.finish_and_clear();
    rows.sort_by(|a, b| {
        (a.stage, a.size)
            .cmp(&(b.stage, b.size))
            .then(b.tolerance.total_cmp(&a.tolerance))
    });
    write(&arguments.out, &rows)?;
    if arguments.json {
        println!("{}", json!({ "rows": rows }));
    } else {
        println!("{}\nwritten to {}", table(&rows), arguments.out.display());
    }
    Ok(())
}

fn write(folder: &Path, rows: &[Row]) -> Result<(), Box<dyn std::error::Error>> {
    output::write_json(&folder.join("report.json"), &json!({ "rows": rows }))?;
    output::write_atomically(&folder.join("table.md"), table(rows).as_bytes())?;
    plot::draw(&folder.join("frontier.svg"), rows, FRONTIER_SIZE)
}

/// The rows as a table in Markdown.
fn table(rows: &[Row]) -> String {
    let mut text = "| stage | size | tolerance | fast ms | oracle s | product ms | ratio | max error | rms error |\n\
                    | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n"
        .to_owned();
    for r in rows {
        let product = r
            .matrix_product_seconds
            .map_or(String::new(), |s| format!("{:.0}", 1e3 * s));
        text += &format!(
            "| {} | {} | {:.0e} | {:.2} | {:.3}{} | {product} | {:.0} | {:.1e} | {:.1e} |\n",
            r.stage,
            r.size,
            r.tolerance,
            1e3 * r.fast_seconds,
            r.oracle_seconds,
            if r.extrapolated { "*" } else { "" },
            r.ratio,
            r.max_error,
            r.rms_error
        );
    }
    text + "\n\\* run on 4,096 random pixels, time scaled up.\n"
}
