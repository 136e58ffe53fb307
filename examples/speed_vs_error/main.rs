//! Every fast method against its oracle: seconds, error, and the frontier.
//!
//! ```text
//! cargo run --release --example speed_vs_error
//! cargo run --release --example speed_vs_error -- --part model
//! ```
//!
//! Writes `report.json`, `simulator.md`, `spacing.md`, `model.md`, `frontier.svg` and `model.svg` (log-log).
//!
//! The first part is the simulator. Sea and wake get the 10⁴ strongest waves of the default scene, the paper's own method
//! and scale; the oracle of both is the harmonic sum, the strong baseline the same sum as a matrix product. Where an
//! oracle is too slow for all pixels it runs on random ones of the same size, as many as the table says, and its time is
//! scaled up; that of the whole scene stage by stage. One image on finer and finer pixels shows what its spacing does. The
//! second part is the model, where it is built in: steps, batch
//! size and weights against many steps from the same noise.

#[path = "../common/exit.rs"]
mod exit;
#[cfg(feature = "ldm")]
mod model;
mod plot;
#[path = "../common/progress.rs"]
mod progress;
#[cfg(feature = "ldm")]
mod rounding;
mod row;
mod satellite;
mod spacing;
mod stages;

use clap::{Parser, ValueEnum};
use row::Row;
use serde_json::json;
use stages::{Memo, STAGES, has_tolerance, measure};
use std::cmp::Ordering;
use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;
use wake_physics::output;

/// Sizes of the sweep at the default tolerance.
const SIZES: [usize; 5] = [128, 256, 512, 1024, 2048];
/// Tolerances of the sweep at [`plot::FRONTIER_SIZE`].
const TOLERANCES: [f64; 5] = [1e-1, 1e-2, 1e-3, 1e-4, 1e-5];
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
    /// What to measure
    #[arg(long, value_enum, default_value = "all")]
    part: Part,
    /// Stages of the simulator alone, without spacing and model [repeatable; default: all]
    #[arg(long, value_name = "STAGE", value_parser = STAGES)]
    stage: Vec<String>,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Part {
    All,
    /// The fast methods of the simulator
    Simulator,
    /// The model, where it is built in
    Model,
}

fn main() -> ExitCode {
    exit::code(|| run(&Arguments::parse()))
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let out = &arguments.out;
    output::make_folder(out)?;
    let (mut rows, mut parts) = (Vec::new(), Vec::new());
    if arguments.part != Part::Model {
        let measured = simulator(arguments.largest as usize, &arguments.stage)?;
        plot::draw(&out.join("frontier.svg"), &plot::SIMULATOR, &measured)?;
        parts.push(("simulator.md", table(&measured)));
        for row in measured {
            rows.push(serde_json::to_value(row)?);
        }
    }
    let all = arguments.stage.is_empty();
    if all && arguments.part != Part::Model {
        let bar = progress::bar(spacing::COUNT, "rows of the spacing");
        let measured = spacing::measure(|| bar.inc(1))?;
        bar.finish_and_clear();
        parts.push(("spacing.md", spacing::table(&measured)));
        for row in measured {
            rows.push(serde_json::to_value(row)?);
        }
    }
    #[cfg(feature = "ldm")]
    if all && arguments.part != Part::Simulator {
        let bar = progress::bar(model::PARTS as u64, "rows of the model");
        let measured = model::measure(|| bar.inc(1))?;
        bar.finish_and_clear();
        plot::draw(
            &out.join("model.svg"),
            &plot::MODEL,
            &model::steps(&measured),
        )?;
        parts.push(("model.md", model::table(&measured)));
        for row in measured {
            rows.push(serde_json::to_value(row)?);
        }
    }
    if rows.is_empty() {
        return Err("--part model needs the feature flex, or another backend".into());
    }
    let report = json!({ "rows": rows });
    output::write_json(&out.join("report.json"), &report)?;
    for (name, table) in &parts {
        output::write_atomically(&out.join(name), table.as_bytes())?;
    }
    if arguments.json {
        exit::say(&report.to_string())?;
    } else {
        let tables: Vec<&str> = parts.iter().map(|(_, table)| table.as_str()).collect();
        exit::say(&format!(
            "{}\nwritten to {}",
            tables.join("\n"),
            out.display()
        ))?;
    }
    Ok(())
}

/// The rows of some stages of the simulator, of all where none is named.
fn simulator(largest: usize, stages: &[String]) -> wake_physics::Result<Vec<Row>> {
    let mut cases: Vec<(usize, f64)> = TOLERANCES.map(|t| (plot::FRONTIER_SIZE, t)).to_vec();
    let sizes = SIZES.into_iter().filter(|&n| n <= largest);
    cases.extend(
        sizes
            .filter(|&n| n != plot::FRONTIER_SIZE)
            .map(|n| (n, DEFAULT_TOLERANCE)),
    );
    let bar = progress::bar((cases.len() * STAGES.len()) as u64, "rows of the simulator");
    let (mut rows, mut memo) = (Vec::new(), Memo::default());
    let named = |stage: &&str| stages.is_empty() || stages.iter().any(|named| named == stage);
    for stage in STAGES.into_iter().filter(named) {
        for &(size, tolerance) in &cases {
            if has_tolerance(stage) || tolerance == DEFAULT_TOLERANCE {
                rows.push(measure(stage, size, tolerance, &mut memo)?);
            }
            bar.inc(1);
        }
    }
    bar.finish_and_clear();
    rows.sort_by(|a, b| {
        let tolerances = b.tolerance.partial_cmp(&a.tolerance);
        (a.stage, a.size)
            .cmp(&(b.stage, b.size))
            .then(tolerances.unwrap_or(Ordering::Equal))
    });
    Ok(rows)
}

/// The rows as a table in Markdown, under the instruction set that they were measured with.
fn table(rows: &[Row]) -> String {
    let threads = rayon::current_num_threads();
    let mut text = format!(
        "{} threads, {}.\n\n\
         | stage | size | tolerance | fast ms | oracle s | product ms | ratio | pixels | max error | rms error |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n",
        threads,
        row::instruction_set()
    );
    for r in rows {
        let tolerance = r.tolerance.map_or(String::new(), |t| format!("{t:.0e}"));
        let product = r
            .matrix_product_seconds
            .map_or(String::new(), |s| figures(1e3 * s));
        text += &format!(
            "| {} | {} | {tolerance} | {} | {}{} | {product} | {} | {} | {:.1e} | {:.1e} |\n",
            r.stage,
            r.size,
            figures(1e3 * r.fast_seconds),
            figures(r.oracle_seconds),
            if r.extrapolated() { "*" } else { "" },
            figures(r.ratio),
            r.pixels,
            r.max_error,
            r.rms_error
        );
    }
    text + "\n\\* extrapolated: the oracle ran at that many random pixels of this size, where the errors are measured.\n"
}

/// A number in at most three figures, so that none seems surer than it is.
fn figures(value: f64) -> String {
    let decimals = match value {
        _ if value >= 1e3 => return format!("{value:.2e}"),
        _ if value >= 100.0 => 0,
        _ if value >= 10.0 => 1,
        _ if value >= 1.0 => 2,
        _ if value >= 0.1 => 3,
        _ => return format!("{value:.1e}"),
    };
    format!("{value:.decimals$}")
}
