//! `wake evaluate`: every figure beside the simulator's own, on scenes that no training set holds.

mod detector;
mod domain;
mod domain_report;
mod judge;
mod model;
mod options;
mod plot;
mod report;
mod rungs;
mod scenes;
mod sea;
mod sea_report;
mod text_to_image;
mod timing;

pub(crate) use options::Arguments;

use indicatif::{ProgressBar, ProgressStyle};
use judge::{Judged, Plan, judge};
use options::Task;
use text_to_image::TextToImage;
use wake_nn::device_named;
use wake_train::evaluation::{Baseline, ImageSource, Told};

use crate::exit::{self, Outcome};

/// The held-out scene that is shown on every rung.
const PICTURED: u64 = 2;

pub(crate) fn run(arguments: &Arguments) -> Outcome<()> {
    match &arguments.task {
        None => models(arguments),
        Some(Task::Domain(options)) => domain::run(options),
        Some(Task::Sea(options)) => sea::run(options),
        Some(Task::Detector(options)) => detector::run(options),
    }
}

/// Writes `report.json`, `report.md`, `rungs.png`, `spectrum.svg` and `wake_correlation.svg`; `docs/evaluation.md` says what
/// each figure means.
fn models(arguments: &Arguments) -> Outcome<()> {
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
    whole_files::make_folder(&arguments.out)?;
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
    whole_files::write_json(&arguments.out.join("report.json"), &report)?;
    whole_files::write_atomically(&arguments.out.join("report.md"), text.as_bytes())?;
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
