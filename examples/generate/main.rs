//! A sentence (or a scene) becomes a radar image with the diffusion model.
//!
//! ```text
//! cargo run --release --example generate
//! cargo run --release --example generate -- --prompt "a ship at 8 m/s toward 135 degrees, wind 5 m/s" --count 8
//! cargo run --release --example generate -- --weights stable-diffusion-v1-4 --steps 20
//! ```
//!
//! Writes `image.png` (`image-0.png`, `image-1.png`, … and all of them as `sheet.png` with `--count`) and
//! `report.json`; the model that lies in `wake-ldm` also writes `labels.json`.

mod small;

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use burn::tensor::{Device, Tensor};
use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::{Value, json};
use wake_ldm::pipeline::{Pipeline, Request, to_bytes};
use wake_ldm::scheduler::SchedulerConfig;
use wake_physics::Scene;

/// Generate an image from a prompt with a latent diffusion model.
#[derive(Parser)]
struct Arguments {
    /// What the image shows; without it and without --scene, the default scene in words.
    #[arg(long, value_name = "TEXT", conflicts_with = "scene")]
    prompt: Option<String>,
    /// Scene file (TOML) to put into words.
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    /// Folder of a model: one that `train` wrote, or one in diffusers layout [default: the model in `wake-ldm`]
    #[arg(long, value_name = "DIR")]
    weights: Option<PathBuf>,
    /// Steps from noise to image [default: 8, or 50 in diffusers layout]
    #[arg(long)]
    steps: Option<usize>,
    /// ddpm, ddim, pndm, euler, euler-ancestral, dpm++, heun, lms, unipc, lcm or flow-match-euler;
    /// without it, the model's own.
    #[arg(long, value_name = "NAME")]
    scheduler: Option<String>,
    /// How strongly to follow the prompt; up to 1: as the model does by itself.
    #[arg(long, default_value_t = 7.5, allow_negative_numbers = true)]
    guidance: f64,
    /// What the image should not show.
    #[arg(long, value_name = "TEXT", default_value = "")]
    negative: String,
    /// Image k has this seed plus k.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Number of images.
    #[arg(long, default_value_t = 1)]
    count: usize,
    /// flex, ndarray, wgpu or cuda, where compiled in; a GPU's number may follow, as in cuda:1.
    #[arg(long, default_value = "flex")]
    device: String,
    /// Folder of the results, made if absent.
    #[arg(long, value_name = "DIR", default_value = "out/generate")]
    out: PathBuf,
    /// Print the report as JSON on standard output, and nothing else.
    #[arg(long)]
    json: bool,
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    match &arguments.weights {
        Some(weights) if !small::is_small(weights) => diffusers(arguments, weights),
        _ => small::run(arguments),
    }
}

/// A model in the layout of diffusers.
fn diffusers(arguments: &Arguments, weights: &Path) -> Result<(), Box<dyn Error>> {
    let scene = arguments.scene.as_deref().map(Scene::read).transpose()?;
    let prompt = prompt(arguments, scene.as_ref())?;
    let device = device(&arguments.device)?;
    let begin = Instant::now();
    let pipeline = Pipeline::load(weights, &device)?;
    let load = begin.elapsed().as_secs_f64();
    check_grid(scene.as_ref(), pipeline.image_size())?;
    let request = request(arguments, &prompt, &pipeline)?;
    let (images, mut seconds) = generate(&pipeline, &request, arguments, &prompt)?;
    seconds["load"] = json!(load);
    seconds["total"] = json!(begin.elapsed().as_secs_f64());
    std::fs::create_dir_all(&arguments.out)?;
    let files = write_images(images, &arguments.out)?;
    let report = json!({
        "prompt": prompt, "negative": arguments.negative, "seed": arguments.seed,
        "steps": arguments.steps.unwrap_or(50), "guidance": arguments.guidance, "count": arguments.count,
        "scheduler": request_scheduler(arguments, &pipeline)?.to_json(),
        "device": arguments.device, "weights": weights, "files": files, "seconds": seconds,
    });
    finish(arguments, &report, &files)
}

/// Writes the report and says what was made.
fn finish(arguments: &Arguments, report: &Value, files: &[String]) -> Result<(), Box<dyn Error>> {
    std::fs::write(arguments.out.join("report.json"), format!("{report:#}\n"))?;
    if arguments.json {
        println!("{report:#}");
    } else {
        println!("{} in {}", files.join(", "), arguments.out.display());
    }
    Ok(())
}

/// The prompt as given, or a scene in words, by default the default scene.
fn prompt(arguments: &Arguments, scene: Option<&Scene>) -> wake_text::Result<String> {
    match &arguments.prompt {
        Some(prompt) => Ok(prompt.clone()),
        None => wake_text::prompt(scene.unwrap_or(&Scene::default())),
    }
}

/// Refuses a scene whose image has another size than the model's.
fn check_grid(scene: Option<&Scene>, [rows, columns]: [usize; 2]) -> Result<(), String> {
    match scene.map(|scene| &scene.grid) {
        Some(grid) if [grid.rows, grid.columns] != [rows, columns] => Err(format!(
            "the scene's grid is {} × {} pixels, but the model makes {rows} × {columns}; set grid.rows and \
             grid.columns to that",
            grid.rows, grid.columns
        )),
        _ => Ok(()),
    }
}

fn request_scheduler(
    arguments: &Arguments,
    pipeline: &Pipeline,
) -> wake_ldm::Result<SchedulerConfig> {
    let own = pipeline.scheduler().clone();
    match &arguments.scheduler {
        None => Ok(own),
        // A model's file may leave clipping to the default, which latents must not have.
        Some(name) => own.with("clip_sample", false)?.with_class(name),
    }
}

fn request(arguments: &Arguments, prompt: &str, pipeline: &Pipeline) -> wake_ldm::Result<Request> {
    Ok(Request::new(prompt)
        .with_negative(arguments.negative.as_str())
        .with_guidance(arguments.guidance)
        .with_steps(arguments.steps.unwrap_or(50))
        .with_scheduler(request_scheduler(arguments, pipeline)?)
        .with_count(arguments.count)
        .with_seed(arguments.seed))
}

/// Runs the stages, each with its seconds.
fn generate(
    pipeline: &Pipeline,
    request: &Request,
    arguments: &Arguments,
    prompt: &str,
) -> Result<(Tensor<4>, Value), Box<dyn Error>> {
    let begin = Instant::now();
    // Embeddings are remembered, so the run finds them ready.
    pipeline.embed(&[prompt, &arguments.negative]);
    let text = begin.elapsed().as_secs_f64();

    let begin = Instant::now();
    let mut sampling = pipeline.sample(request)?;
    let bar = progress_bar(sampling.len() as u64);
    for progress in sampling.by_ref() {
        bar.set_position(progress.done as u64);
    }
    bar.finish_and_clear();
    // Reading a number waits for the device.
    let latents = sampling.latents();
    latents.to_data();
    let denoise = begin.elapsed().as_secs_f64();

    let begin = Instant::now();
    let images = pipeline.decode(latents);
    images.to_data();
    let decode = begin.elapsed().as_secs_f64();
    Ok((
        images,
        json!({"text": text, "denoise": denoise, "decode": decode}),
    ))
}

fn progress_bar(steps: u64) -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:40} step {pos} of {len}, {eta} left");
    ProgressBar::new(steps).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

/// Writes one PNG per image and returns their names.
fn write_images(images: Tensor<4>, out: &Path) -> Result<Vec<String>, Box<dyn Error>> {
    let [count, channels, rows, columns] = images.dims();
    let color = if channels == 1 {
        image::ColorType::L8
    } else {
        image::ColorType::Rgb8
    };
    let mut names = Vec::new();
    for (k, bytes) in to_bytes(images).into_iter().enumerate() {
        let name = if count == 1 {
            "image.png".to_owned()
        } else {
            format!("image-{k}.png")
        };
        image::save_buffer(out.join(&name), &bytes, columns as u32, rows as u32, color)?;
        names.push(name);
    }
    Ok(names)
}

/// The device of a name, where its backend is compiled in.
fn device(name: &str) -> Result<Device, String> {
    let (kind, index) = name.split_once(':').unwrap_or((name, "0"));
    let index: usize = index
        .parse()
        .map_err(|_| format!("--device {name}: no number after ':'"))?;
    match kind {
        #[cfg(feature = "flex")]
        "flex" if index == 0 => Ok(Device::flex()),
        #[cfg(feature = "ndarray")]
        #[allow(deprecated, reason = "kept until burn drops it")]
        "ndarray" if index == 0 => Ok(Device::ndarray()),
        #[cfg(feature = "wgpu")]
        "wgpu" if name == "wgpu" => Ok(Device::wgpu(burn::tensor::DeviceKind::DefaultDevice)),
        #[cfg(feature = "wgpu")]
        "wgpu" => Ok(Device::wgpu(burn::tensor::DeviceKind::DiscreteGpu(index))),
        #[cfg(feature = "cuda")]
        "cuda" => Ok(Device::cuda(index)),
        _ => Err(format!(
            "--device {name} is none of this build's: use flex, or build with \
             --features ndarray, wgpu or cuda"
        )),
    }
}
