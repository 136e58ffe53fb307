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
//! figure means. `domain` judges
//! the model over a recipe and writes `domain.json`, `domain.md` and `domain.png`. `sea` sets a learnt sea beside real images instead, and writes `report.json`, `report.md` and `learned_sea.png`.

#[path = "../common/exit.rs"]
mod exit;
mod domain;
mod judge;
mod measurements;
mod model;
mod pixels;
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
mod source;
mod statistics;
mod swaps;
mod text_to_image;
mod timing;
mod wake;

use burn::tensor::Device;
use clap::{Parser, Subcommand};
use indicatif::{ProgressBar, ProgressStyle};
use judge::{Judged, Plan, judge};
use model::Model;
use source::{ImageSource, OtherSea, Result, Told};
use std::path::PathBuf;
use std::process::ExitCode;
use text_to_image::TextToImage;
use wake_ldm::device_named;
use wake_ldm::metrics::{Lpips, LpipsNetwork};
use wake_physics::output;

/// The held-out scene that is shown on every rung.
const PICTURED: u64 = 2;

/// Judge generated images against the simulator.
#[derive(Parser)]
#[command(version, args_conflicts_with_subcommands = true)]
struct Arguments {
    #[command(subcommand)]
    task: Option<Task>,
    /// Judge the simulator itself, with another random sea, in the place of a model: what a perfect model would get
    #[arg(long)]
    simulator_only: bool,
    /// Folder of a small model that `train` wrote; without it, the model in the crate
    #[arg(long, value_name = "DIR", conflicts_with = "simulator_only")]
    weights: Option<PathBuf>,
    /// Steps from noise to image; without it, the sampler's own number
    #[arg(long, conflicts_with = "simulator_only")]
    steps: Option<usize>,
    /// Folder of a model that `train -- text-to-image` wrote, to stand beside the model
    #[arg(long, value_name = "DIR")]
    text_to_image: Option<PathBuf>,
    /// Held-out scenes
    #[arg(long, default_value_t = 200, value_parser = clap::value_parser!(u32).range(1..=65536))]
    count: u32,
    /// Weights of torchvision's alexnet as safetensors, for LPIPS; without them LPIPS is left out
    #[arg(long, value_name = "FILE", requires = "lpips_linear")]
    lpips_backbone: Option<PathBuf>,
    /// Linear weights of the package lpips as safetensors
    #[arg(long, value_name = "FILE", requires = "lpips_backbone")]
    lpips_linear: Option<PathBuf>,
    /// flex, ndarray, wgpu or cuda, where compiled in; a GPU's number may follow, as in cuda:1
    #[arg(long, default_value = "flex")]
    device: String,
    /// Folder of the results, made if absent
    #[arg(long, value_name = "DIR", default_value = "out/evaluate")]
    out: PathBuf,
    /// Print the report as JSON on standard output, and nothing else
    #[arg(long)]
    json: bool,
}

#[derive(Subcommand)]
enum Task {
    /// Judge the model over all scenes of a recipe
    Domain(domain::Options),
    /// Judge a sea that was learnt from real images against their other halves
    Sea(sea::Options),
}

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
    let lpips = lpips(arguments, &device)?;
    let model = match arguments.simulator_only {
        true => None,
        false => {
            let folder = arguments.weights.as_deref();
            Some(Model::load(folder, arguments.steps, &device)?)
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
            source: &OtherSea,
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

fn lpips(arguments: &Arguments, device: &Device) -> Result<Option<Lpips>> {
    let (Some(backbone), Some(linear)) = (&arguments.lpips_backbone, &arguments.lpips_linear)
    else {
        return Ok(None);
    };
    Ok(Some(Lpips::load(
        LpipsNetwork::Alex,
        backbone,
        linear,
        device,
    )?))
}
