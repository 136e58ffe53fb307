//! Every fast method against its oracle: seconds, error, and the frontier.
//!
//! ```text
//! cargo run --release --example speed_vs_error
//! cargo run --release --example speed_vs_error -- --part model
//! cargo run --release --features wgpu --example speed_vs_error -- --part loader --device wgpu
//! ```
//!
//! Writes `report.json`, `simulator.md`, `spacing.md`, `model.md`, `loader.md`, `frontier.svg` and `model.svg` (log-log).
//!
//! The first part is the simulator. Sea and wake get the 10⁴ strongest waves of the default scene, the paper's own method
//! and scale; the oracle of both is the harmonic sum, the strong baseline the same sum as a matrix product. Where an
//! oracle is too slow for all pixels it runs on random ones of the same size, as many as the table says, and its time is
//! scaled up; that of the whole scene stage by stage. One image on finer and finer pixels shows what its spacing does. The
//! second part is the model, where it is built in: steps, batch size and weights against many steps from the same noise. The
//! third is the loader: images a second that a training loop gets of the simulator and of the model, by threads.

#[path = "../common/exit.rs"]
mod exit;
#[cfg(feature = "dataset")]
mod loader;
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
mod sweep;

use clap::{Parser, ValueEnum};
use serde_json::json;
use stages::STAGES;
use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;
use wake_physics::output;

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
    /// Where the loader's model computes: flex, ndarray, wgpu or cuda, where compiled in
    #[arg(long, default_value = "flex")]
    device: String,
    /// Stages of the simulator alone, without spacing, model and loader [repeatable; default: all]
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
    /// Images a second through the data set's loader, where it is built in
    Loader,
}

fn main() -> ExitCode {
    exit::code(|| run(&Arguments::parse()))
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let out = &arguments.out;
    output::make_folder(out)?;
    let (mut rows, mut parts) = (Vec::new(), Vec::new());
    let asked = |part| {
        let all = arguments.part == Part::All && arguments.stage.is_empty();
        all || arguments.part == part
    };
    if asked(Part::Simulator) || !arguments.stage.is_empty() {
        let measured = sweep::measure(arguments.largest as usize, &arguments.stage)?;
        plot::draw(&out.join("frontier.svg"), &plot::SIMULATOR, &measured)?;
        parts.push(("simulator.md", sweep::table(&measured)));
        add(&mut rows, &measured)?;
    }
    if asked(Part::Simulator) && arguments.stage.is_empty() {
        let bar = progress::bar(spacing::COUNT, "rows of the spacing");
        let measured = spacing::measure(|| bar.inc(1))?;
        bar.finish_and_clear();
        parts.push(("spacing.md", spacing::table(&measured)));
        add(&mut rows, &measured)?;
    }
    #[cfg(feature = "ldm")]
    if asked(Part::Model) {
        let bar = progress::bar(model::PARTS as u64, "rows of the model");
        let measured = model::measure(|| bar.inc(1))?;
        bar.finish_and_clear();
        let steps = model::steps(&measured);
        plot::draw(&out.join("model.svg"), &plot::MODEL, &steps)?;
        parts.push(("model.md", model::table(&measured)));
        add(&mut rows, &measured)?;
    }
    #[cfg(feature = "dataset")]
    if asked(Part::Loader) {
        let bar = progress::bar(loader::PARTS as u64, "rows of the loader");
        let measured = loader::measure(&arguments.device, || bar.inc(1))?;
        bar.finish_and_clear();
        parts.push(("loader.md", loader::table(&measured)));
        add(&mut rows, &measured)?;
    }
    if rows.is_empty() {
        return Err(
            "--part model and loader need the feature flex, or another backend, and loader dataset"
                .into(),
        );
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

/// Adds measured rows to those of the report.
fn add<T: serde::Serialize>(
    rows: &mut Vec<serde_json::Value>,
    measured: &[T],
) -> serde_json::Result<()> {
    for row in measured {
        rows.push(serde_json::to_value(row)?);
    }
    Ok(())
}
