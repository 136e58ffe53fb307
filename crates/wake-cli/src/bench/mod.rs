//! `wake bench`: measures speed and error of every fast method against its oracle.
//!
//! The first part is the simulator. Sea and wake use the 10⁴ strongest waves of the default scene, the paper's own
//! method and scale; the oracle of both is the harmonic sum, and the strong baseline is the same sum as a matrix
//! product. An oracle that is too slow for all pixels runs on random pixels of the image, as many as the table says,
//! and its time is scaled up; the time of the whole scene is scaled stage by stage. One image on finer and finer pixels
//! shows the effect of the spacing. The second part is the model: steps, batch size and weights against many steps from
//! the same noise. The third is the loader: images per second of the simulator and of the model in a training loop, by
//! threads. The fourth is Stable Diffusion's schedulers, on a problem with a known answer.

#![warn(clippy::print_stdout, clippy::print_stderr)]

mod arguments;
mod device;
mod loader;
mod model;
mod model_row;
mod plot;
mod reference;
mod rounding;
mod row;
mod schedulers;
mod spacing;
mod stages;
mod sweep;

pub(crate) use arguments::Arguments;

use arguments::Part;
use serde::Serialize;
use serde_json::{Value, json};

use crate::exit::{self, Outcome};
use crate::progress;

/// Writes `report.json`, `simulator.md`, `simulator.csv`, `spacing.md`, `model.md`, `loader.md`, `schedulers.md`,
/// `frontier.svg` and `model.svg` (log-log); with `--part device`, `device.json` and `device.md`.
pub(crate) fn run(arguments: &Arguments) -> Outcome<()> {
    let out = &arguments.out;
    whole_files::make_folder(out)?;
    let (mut rows, mut parts) = (Vec::new(), Vec::new());
    let asked = |part| {
        let all = arguments.part == Part::All && arguments.stage.is_empty();
        all || arguments.part == part
    };
    if asked(Part::Simulator) || !arguments.stage.is_empty() {
        let measured = sweep::measure(arguments.largest as usize, &arguments.stage)?;
        plot::draw(&out.join("frontier.svg"), &plot::SIMULATOR, &measured)?;
        parts.push(("simulator.md", sweep::table(&measured)));
        let all = sweep::csv(&measured);
        whole_files::write_atomically(&out.join("simulator.csv"), all.as_bytes())?;
        add(&mut rows, &measured)?;
    }
    if asked(Part::Simulator) && arguments.stage.is_empty() {
        let bar = progress::bar(spacing::COUNT, "spacing runs");
        let measured = spacing::measure(|| bar.inc(1))?;
        bar.finish_and_clear();
        parts.push(("spacing.md", spacing::table(&measured)));
        add(&mut rows, &measured)?;
    }
    if asked(Part::Model) {
        let bar = progress::bar(model::PARTS as u64, "model runs");
        let measured = model::measure(|| bar.inc(1))?;
        bar.finish_and_clear();
        let steps = model_row::steps(&measured);
        plot::draw(&out.join("model.svg"), &plot::MODEL, &steps)?;
        parts.push(("model.md", model_row::table(&measured)));
        add(&mut rows, &measured)?;
    }
    if asked(Part::Loader) {
        let bar = progress::bar(loader::parts(), "loader runs");
        let measured = loader::measure(&arguments.device, || bar.inc(1))?;
        bar.finish_and_clear();
        parts.push(("loader.md", loader::table(&measured)));
        add(&mut rows, &measured)?;
    }
    if asked(Part::Schedulers) {
        let bar = progress::bar(schedulers::PARTS as u64, "scheduler runs");
        let measured = schedulers::measure(|| bar.inc(1))?;
        bar.finish_and_clear();
        parts.push(("schedulers.md", schedulers::table(&measured)));
        add(&mut rows, &measured)?;
    }
    if arguments.part == Part::Device {
        let bar = progress::bar(device::parts(&arguments.block), "device blocks");
        let mut lines = Vec::new();
        let measured = device::measure(&arguments.device, &arguments.block, |of_block| {
            bar.inc(1);
            lines.extend_from_slice(of_block);
            // Results so far are kept even if a driver ends the process.
            Ok(whole_files::write_json(&out.join("device.json"), &lines)?)
        })?;
        bar.finish_and_clear();
        let checks = device::checks(&arguments.device)?;
        parts.push(("device.md", device::table(&measured, &checks)));
        add(&mut rows, &measured)?;
        add(&mut rows, &checks)?;
    }
    let report = json!({ "rows": rows });
    whole_files::write_json(&out.join("report.json"), &report)?;
    for (name, table) in &parts {
        whole_files::write_atomically(&out.join(name), table.as_bytes())?;
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

/// Adds measured rows to the report.
fn add(rows: &mut Vec<Value>, measured: &[impl Serialize]) -> serde_json::Result<()> {
    for row in measured {
        rows.push(serde_json::to_value(row)?);
    }
    Ok(())
}
