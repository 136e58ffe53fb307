//! `wake evaluate`: compares every figure with the simulator's own, on scenes that no training set has.

mod ablation;
mod calibration;
mod common;
mod curve;
mod detector;
mod domain;
mod domain_report;
mod effects;
mod estimate;
mod judged;
mod model;
mod options;
mod pipeline;
mod plot;
mod report;
mod schedulers;
mod sea;
mod sea_report;
mod timing;

pub(crate) use options::Arguments;

use judged::Judged;
use options::Task;
use wake_nn::device_named;
use wake_train::evaluation::{Baseline, Evaluation, HeldOut, Told, View};

use crate::exit::Outcome;

pub(crate) fn run(arguments: &Arguments) -> Outcome<()> {
    match &arguments.task {
        None => models(arguments),
        Some(Task::Pipeline(options)) => pipeline::run(options),
        Some(Task::Domain(options)) => domain::run(options),
        Some(Task::Sea(options)) => sea::run(options),
        Some(Task::Detector(options)) => detector::run(options),
        Some(Task::Calibration(options)) => calibration::run(options),
        Some(Task::Estimate(options)) => estimate::run(options),
    }
}

/// Writes `report.json`, `report.md`, `ablation.png`, `spectrum.svg` and `wake_correlation.svg`;
/// `docs/reports/evaluation.md` explains the figures.
fn models(arguments: &Arguments) -> Outcome<()> {
    let common = &arguments.common;
    let device = device_named(&common.device)?;
    let perceptual = common.perceptual(&device)?;
    let model = match arguments.simulator_only {
        true => None,
        false => {
            let folder = arguments.weights.as_deref();
            Some(model::load(folder, arguments.steps, &device)?)
        }
    };
    let simulator = Evaluation {
        source: &Baseline::OtherSea,
        name: "simulator with another random sea",
        has_network: false,
        beside: Vec::new(),
        held_out: HeldOut::default(),
        view: View::default(),
        scenes: common.count as usize,
        conditions: Vec::new(),
    };
    let evaluation = match &model {
        Some(model) => Evaluation {
            source: model,
            name: "model",
            has_network: true,
            conditions: vec![Told::Text, Told::Numbers, Told::Paraphrase],
            ..simulator
        },
        None => simulator,
    };
    let judged = Judged {
        evaluation,
        wake_model: model.as_ref(),
        text_to_image: None,
        perceptual: &perceptual,
    };
    let report = judged.report(&device, &common.out)?;
    report.write(common)
}
