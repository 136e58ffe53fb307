//! `wake evaluate domain`: compares the model's images with simulated ones over all scenes of a recipe, before speckle
//! and with it.

use std::path::PathBuf;

use clap::Args;
use wake_dataset::{Recipe, Simulated};
use wake_nn::device_named;
use wake_physics::Scene;
use wake_train::evaluation::{Baseline, ImageSource, Views, other_sea};

use super::domain_report::{Report, markdown, sheet};
use super::model;
use crate::exit::{self, Outcome};
use crate::progress;

/// Seed of the scenes, which no training set has.
const SEED: u64 = 1 << 40;

/// Compare the model with the simulator over all scenes of a recipe.
#[derive(Args)]
pub(crate) struct Options {
    /// Recipe of the scenes: paper, ranges, satellites, detector, model, or a file
    #[arg(long, default_value = "satellites")]
    recipe: String,
    /// Folder of a small model of `wake train` [default: the shipped model]
    #[arg(long, value_name = "DIR")]
    weights: Option<PathBuf>,
    /// Sampling steps [default: the model's own]
    #[arg(long)]
    steps: Option<usize>,
    /// Number of scenes; the two-sample test needs at least four
    #[arg(long, default_value_t = 200, value_parser = clap::value_parser!(u32).range(1..=65536))]
    count: u32,
    /// Device: flex, ndarray, wgpu or cuda, if compiled in
    #[arg(long, default_value = "flex")]
    device: String,
    /// Folder for the results, created if absent
    #[arg(long, value_name = "DIR", default_value = "out/evaluate_domain")]
    out: PathBuf,
    /// Print the report as JSON on standard output, and nothing else
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(options: &Options) -> Outcome<()> {
    let device = device_named(&options.device)?;
    let sampler = model::load(options.weights.as_deref(), options.steps, &device)?;
    let recipe = Recipe::named_or_read(&options.recipe)?;
    let set = Simulated::new(recipe, SEED)?;
    let scenes = (0..u64::from(options.count)).map(|index| set.scene(index));
    let scenes: Vec<Scene> = scenes.collect::<wake_dataset::Result<_>>()?;
    scenes
        .iter()
        .try_for_each(|scene| sampler.check_scene(scene))?;
    whole_files::make_folder(&options.out)?;
    let baseline = |of: &'static Baseline| (of.name(), of as &dyn ImageSource);
    let kinds: [(&'static str, &dyn ImageSource); 4] = [
        baseline(&Baseline::Expected),
        baseline(&Baseline::Gaussian),
        ("model", &sampler),
        baseline(&Baseline::OtherSea),
    ];
    let bar = progress::bar(((kinds.len() + 1) * scenes.len()) as u64, "images");
    // A third random sea, which no other kind has.
    let third: Vec<Scene> = scenes.iter().map(|scene| other_sea(scene, 2)).collect();
    let simulated = Views::draw(&Baseline::Simulator, &third, |n| bar.inc(n))?;
    let (mut rows, mut pictures) = (Vec::new(), None);
    for (name, source) in kinds {
        let views = Views::draw(source, &scenes, |n| bar.inc(n))?;
        rows.push(views.row(name, &simulated, &device)?);
        if name == "model" {
            pictures = Some(sheet(&simulated, &views));
        }
    }
    bar.finish_and_clear();
    let report = Report {
        recipe: options.recipe.clone(),
        scenes: scenes.len(),
        rows,
    };
    let text = markdown(&report);
    whole_files::write_json(&options.out.join("domain.json"), &report)?;
    whole_files::write_atomically(&options.out.join("domain.md"), text.as_bytes())?;
    if let Some(pictures) = pictures {
        pictures.write(&options.out.join("domain.png"))?;
    }
    match options.json {
        true => exit::say(&serde_json::to_string_pretty(&report)?)?,
        false => exit::say(&format!("{text}\nwritten to {}", options.out.display()))?,
    }
    Ok(())
}
