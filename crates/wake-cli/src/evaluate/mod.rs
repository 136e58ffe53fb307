//! `wake evaluate`: every figure beside the simulator's own, on scenes that no training set holds.

mod ablation;
mod calibration;
mod detector;
mod domain;
mod domain_report;
mod model;
mod options;
mod plot;
mod report;
mod sea;
mod sea_report;
mod text_to_image;
mod timing;

pub(crate) use options::Arguments;

use indicatif::{ProgressBar, ProgressStyle};
use options::Task;
use report::Report;
use text_to_image::TextToImage;
use wake_nn::device_named;
use wake_train::evaluation::{Baseline, Evaluation, ImageSource, Told, held_out};

use crate::exit::{self, Outcome};

/// The held-out scene that every kind of image shows.
const PICTURED: u64 = 2;

pub(crate) fn run(arguments: &Arguments) -> Outcome<()> {
    match &arguments.task {
        None => models(arguments),
        Some(Task::Domain(options)) => domain::run(options),
        Some(Task::Sea(options)) => sea::run(options),
        Some(Task::Detector(options)) => detector::run(options),
        Some(Task::Calibration(options)) => calibration::run(options),
    }
}

/// Writes `report.json`, `report.md`, `ablation.png`, `spectrum.svg` and `wake_correlation.svg`; `docs/evaluation.md` says what
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
        Some(model) => Evaluation {
            source: model,
            name: "model",
            has_network: true,
            text_to_image: beside,
            scenes: arguments.count as usize,
            conditions: vec![Told::Text, Told::Numbers, Told::Paraphrase],
        },
        None => Evaluation {
            source: &Baseline::OtherSea,
            name: "simulator with another random sea",
            has_network: false,
            text_to_image: beside,
            scenes: arguments.count as usize,
            conditions: Vec::new(),
        },
    };
    let bar = ProgressBar::new(judged.steps());
    bar.set_style(ProgressStyle::with_template(
        "{msg:20} {bar:30} {pos}/{len}, {eta} left",
    )?);
    let figures = judged.figures(lpips.as_ref(), &device, &|what, more| {
        bar.set_message(what);
        bar.inc(more);
    })?;
    bar.set_message("seconds");
    let report = Report {
        figures,
        seconds: timing::timings(judged.source, judged.text_to_image)?,
        paper: report::PAPER,
    };
    bar.finish_and_clear();
    let text = report::markdown(&report);
    whole_files::write_json(&arguments.out.join("report.json"), &report)?;
    whole_files::write_atomically(&arguments.out.join("report.md"), text.as_bytes())?;
    ablation::picture(&held_out(PICTURED), &judged)?.write(&arguments.out.join("ablation.png"))?;
    plot::spectrum(&arguments.out.join("spectrum.svg"), &report)?;
    plot::wake(&arguments.out.join("wake_correlation.svg"), &report)?;
    if arguments.json {
        exit::say(&serde_json::to_string_pretty(&report)?)?;
    } else {
        exit::say(&format!("{text}\nwritten to {}", arguments.out.display()))?;
    }
    Ok(())
}
