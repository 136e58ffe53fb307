//! How good are generated images? Every figure beside the simulator's own, on scenes that no training set holds.
//!
//! ```text
//! cargo run --release --example evaluate
//! cargo run --release --example evaluate -- --simulator-only
//! cargo run --release --example evaluate -- domain --recipe detector
//! cargo run --release --example evaluate -- sea --real chips --weights out/sea/sea.safetensors
//! ```
//!
//! Writes `report.json`, `report.md`, `spectrum.svg` and `wake_correlation.svg`. `docs/evaluation.md` says what each
//! figure means. `domain` judges the model over a recipe and writes `domain.json`, `domain.md` and `domain.png`. `sea` sets a
//! learnt sea beside real images instead, and writes `report.json`, `report.md` and `learned_sea.png`.

#[path = "../common/exit.rs"]
mod exit;
mod domain;
mod domain_report;
mod judge;
mod model;
mod options;
mod plot;
#[path = "../common/progress.rs"]
mod progress;
mod report;
mod rungs;
mod scenes;
mod sea;
#[path = "../common/sea_images.rs"]
mod sea_images;
mod sea_report;
mod text_to_image;
mod timing;

use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};
use judge::{Judged, Plan, judge};
use options::{Arguments, Task};
use std::process::ExitCode;
use text_to_image::TextToImage;
use wake_ldm::device_named;
use wake_ldm::evaluation::{Baseline, ImageSource, Told};
use wake_physics::output;

/// Result of what may fail in this example.
type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// The held-out scene that is shown on every rung.
const PICTURED: u64 = 2;

fn main() -> ExitCode {
    exit::code(|| {
        let arguments = Arguments::parse();
        match &arguments.task {
            Some(Task::Domain(options)) => domain::run(options),
            Some(Task::Sea(options)) => sea::run(options),
            None => run(&arguments),
        }
    })
}

fn run(arguments: &Arguments) -> Result<()> {
    let device = device_named(&arguments.device)?;
    let lpips = arguments.lpips(&device)?;
    let model = match arguments.simulator_only {
        true => None,
        false => {
            let folder = arguments.weights.as_deref();
            Some(model::load(folder, arguments.steps, &device)?)
        }
    };
    let text_to_image = arguments.text_to_image.as_deref();
    let text_to_image = text_to_image.map(|folder| TextToImage::load(folder, &device));
    let text_to_image = text_to_image.transpose()?;
    let beside = text_to_image.as_ref().map(|s| s as &dyn ImageSource);
    // What cannot be read leaves no folder behind.
    output::make_folder(&arguments.out)?;
    let judged = match &model {
        Some(model) => Judged {
            source: model,
            name: "model",
            has_network: true,
            text_to_image: beside,
            conditions: vec![Told::Text, Told::Numbers, Told::Paraphrase],
        },
        None => Judged {
            source: &Baseline::OtherSea,
            name: "simulator with another random sea",
            has_network: false,
            text_to_image: beside,
            conditions: Vec::new(),
        },
    };
    let plan = Plan::of(arguments.count as usize);
    let bar = ProgressBar::new(plan.steps(&judged) as u64);
    bar.set_style(ProgressStyle::with_template(
        "{msg:20} {bar:30} {pos}/{len}, {eta} left",
    )?);
    let report = judge(&plan, &judged, lpips.as_ref(), &device, &bar)?;
    bar.finish_and_clear();
    let text = report::markdown(&report);
    output::write_json(&arguments.out.join("report.json"), &report)?;
    output::write_atomically(&arguments.out.join("report.md"), text.as_bytes())?;
    rungs::picture(&scenes::held_out(PICTURED), &judged)?
        .write(&arguments.out.join("rungs.png"))?;
    plot::spectrum(&arguments.out.join("spectrum.svg"), &report)?;
    plot::wake(&arguments.out.join("wake_correlation.svg"), &report)?;
    if arguments.json {
        exit::say(&serde_json::to_string_pretty(&report)?)?;
    } else {
        exit::say(&format!("{text}\nwritten to {}", arguments.out.display()))?;
    }
    Ok(())
}
