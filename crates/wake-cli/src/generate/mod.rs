//! `wake generate`: a sentence (or a scene) becomes a radar image with the diffusion model.

#![warn(clippy::print_stdout, clippy::print_stderr)]

mod diffusers;
mod wake_model;

#[cfg(feature = "train")]
pub(crate) use diffusers::scheduler_of;
use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::Value;
use wake_physics::Scene;

use crate::exit::{self, Outcome};

/// Generate an image from a prompt with a latent diffusion model.
#[derive(Args)]
#[command(after_help = "Scene keys with their units, ranges and defaults: docs/scene_keys.md")]
pub(crate) struct Arguments {
    /// What the image shows; without it and without --scene, the default scene in words.
    #[arg(long, value_name = "TEXT", conflicts_with = "scene")]
    prompt: Option<String>,
    /// Scene file (TOML) to put into words.
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    /// Change one value of the scene, such as ship.speed=8; may be repeated; without --scene, of the model's own scene
    #[arg(long, value_name = "KEY=VALUE", conflicts_with = "prompt")]
    set: Vec<String>,
    /// Folder of a model: one that `wake train` wrote, or one in diffusers layout [default: the model in `wake-ldm`]
    #[arg(long, value_name = "DIR")]
    weights: Option<PathBuf>,
    /// Diffusers layout: a low-rank adaptation that is merged into the model
    #[arg(long, value_name = "FILE", requires = "weights")]
    lora: Option<PathBuf>,
    /// Draw on a sea learnt from real images: a file that `wake train sea` wrote; not in diffusers layout
    #[arg(long, value_name = "FILE", conflicts_with = "steps")]
    sea: Option<PathBuf>,
    /// Steps from noise to image [default: 4, or 50 in diffusers layout]
    #[arg(long)]
    steps: Option<usize>,
    /// Diffusers layout: ddpm, ddim, pndm, euler, euler-ancestral, dpm++, heun, lms, unipc, lcm or flow-match-euler
    /// [default: the model's own]
    #[arg(long, value_name = "NAME")]
    scheduler: Option<String>,
    /// Diffusers layout: how strongly to follow the prompt; up to 1: as the model does by itself [default: 7.5]
    #[arg(long, allow_negative_numbers = true)]
    guidance: Option<f64>,
    /// Diffusers layout: what the image should not show.
    #[arg(long, value_name = "TEXT")]
    negative: Option<String>,
    /// Image k has this seed plus k.
    #[arg(long, default_value_t = 7)]
    seed: u64,
    /// Number of images.
    #[arg(long, default_value_t = 1)]
    count: usize,
    /// flex, ndarray, wgpu or cuda, where compiled in; a GPU's number may follow, as in cuda:1.
    #[arg(long, default_value = "flex")]
    device: String,
    /// Also write the images with boxes, arms and tips drawn on them.
    #[arg(long)]
    overlay: bool,
    /// Folder of the results, made if absent.
    #[arg(long, value_name = "DIR", default_value = "out/generate")]
    out: PathBuf,
    /// Print the report as JSON on standard output, and nothing else.
    #[arg(long)]
    json: bool,
}

/// Writes `image.png` (`image-0.png`, `image-1.png`, … and all of them as `sheet.png` with `--count`) and `report.json`; the
/// wake model also writes the labels of each image (`labels.json`, `labels-0.json`, …), and says which scene it drew (what
/// the prompt states, and the default values of what it leaves open) and which parts of the prompt it did not read. A prompt
/// that states nothing of a scene is an error.
pub(crate) fn run(arguments: &Arguments) -> Outcome<()> {
    match arguments.weights.as_deref() {
        None => wake_model::run(arguments),
        Some(folder) if folder.join("unet").is_dir() => match &arguments.sea {
            None => diffusers::run(arguments, folder),
            Some(_) => Err("--sea is for the wake model; leave it out, or --weights".into()),
        },
        Some(_) if arguments.lora.is_some() => {
            Err("--lora is for a model in diffusers layout; leave it out".into())
        }
        Some(folder) if folder.join("config.json").is_file() => wake_model::run(arguments),
        Some(folder) => Err(format!(
            "--weights {}: no model there; a folder that `wake train` wrote holds config.json, one in diffusers layout unet/",
            folder.display()
        )
        .into()),
    }
}

/// The scene that is asked for as one, on the base of a model's own where no file is named.
fn scene(
    arguments: &Arguments,
    base: impl FnOnce() -> Scene,
) -> wake_physics::Result<Option<Scene>> {
    let scene = match &arguments.scene {
        Some(path) => Scene::read(path)?,
        None if arguments.set.is_empty() => return Ok(None),
        None => base(),
    };
    scene.with_assignments(&arguments.set).map(Some)
}

/// The prompt as given, or a scene in words, by default the default scene.
fn prompt(arguments: &Arguments, scene: Option<&Scene>) -> wake_text::Result<String> {
    match &arguments.prompt {
        Some(prompt) => Ok(prompt.clone()),
        None => wake_text::prompt(scene.unwrap_or(&Scene::default())),
    }
}

/// The name of file `k` of `count` of one kind.
fn numbered(stem: &str, k: usize, count: usize, ending: &str) -> String {
    match count {
        1 => format!("{stem}.{ending}"),
        _ => format!("{stem}-{k}.{ending}"),
    }
}

/// Writes the report and says what was made.
fn finish(arguments: &Arguments, report: &Value) -> Outcome<()> {
    let out: &Path = &arguments.out;
    whole_files::write_json(&out.join("report.json"), report)?;
    if arguments.json {
        return Ok(exit::say(&format!("{report:#}"))?);
    }
    let files = report["files"].as_array().into_iter().flatten();
    let files: Vec<&str> = files.filter_map(Value::as_str).collect();
    let seconds = report["seconds"]["total"].as_f64().unwrap_or_default();
    let (files, out) = (files.join(", "), out.display());
    Ok(exit::say(&format!("{files} in {out}, {seconds:.2} s"))?)
}
