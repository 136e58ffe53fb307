//! Trains the small wake model on simulated pairs.
//!
//! ```text
//! cargo run --release --example train -- autoencoder
//! cargo run --release --example train -- diffusion --data out/make_dataset --steps 20000
//! cargo run --release --example train -- diffusion --data out/make_dataset --steps 20000 --resume
//! ```
//!
//! `autoencoder` fits the patch transform in closed form; `diffusion` does so too where there is none yet, and then
//! trains. Writes into `--out`: `patches.safetensors`, `shares.json`, `config.json`, `model.safetensors` (averaged
//! weights, 16 bits), `checkpoints/`, `metrics.jsonl` and `sheet.png`. A run that was killed goes on from its last
//! checkpoint with `--resume`.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use burn::tensor::Device;
use clap::{Parser, Subcommand};
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::json;
use wake_ldm::WakeSampler;
use wake_ldm::conditioning::{Vocabulary, tokens};
use wake_ldm::dataset::{Folder, Pair, Recipe, Simulated};
use wake_ldm::small::{PatchTransform, Shares, WakeModelConfig};
use wake_ldm::train::{
    Checkpoint, Diffusion, DiffusionOptions, Example, LatentSet, Metrics, Rate, TrainerOptions,
};
use wake_ldm::weights::{Layout, Precision, load, save_as};
use wake_physics::Scene;
use wake_text::Wording;

/// Images that the patch transform is fitted to.
const FITTED: u64 = 400;
/// Images of a sheet.
const SHEET: u64 = 8;

/// Train the small wake model.
#[derive(Parser)]
struct Arguments {
    #[command(subcommand)]
    stage: Stage,
}

#[derive(Subcommand)]
enum Stage {
    /// Fit the patch transform, in closed form.
    Autoencoder(Options),
    /// Train the U-Net and the text transformer.
    Diffusion(Options),
}

#[derive(Parser)]
struct Options {
    /// Folder that make_dataset wrote; without it, pairs are simulated first
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Pairs to simulate where there is no --data
    #[arg(long, default_value_t = 2000, value_parser = clap::value_parser!(u64).range(8..))]
    count: u64,
    /// JSON file with the widths of the model [default: those of the model that ships]
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Go on from the newest checkpoint in --out
    #[arg(long)]
    resume: bool,
    /// Steps of the whole run
    #[arg(long, default_value_t = 20_000, value_parser = clap::value_parser!(u32).range(1..))]
    steps: u32,
    /// Images of a batch
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u16).range(1..))]
    batch: u16,
    /// Parts of a batch that are computed one after the other, to save memory
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    accumulation: u16,
    /// Largest step of the optimizer
    #[arg(long, default_value_t = 1e-3)]
    rate: f64,
    /// Steps between checkpoints and sheets
    #[arg(long, default_value_t = 500, value_parser = clap::value_parser!(u32).range(1..))]
    every: u32,
    /// Seed of the run, and of simulated pairs
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Keep less for the way back through the model, and compute it again; slower
    #[arg(long)]
    checkpointing: bool,
    /// flex, ndarray, wgpu or cuda, where compiled in; a comma between several
    #[arg(long, default_value = "flex")]
    device: String,
    /// Folder of the results, made if absent
    #[arg(long, value_name = "DIR", default_value = "out/train")]
    out: PathBuf,
}

fn main() -> ExitCode {
    let result = match Arguments::parse().stage {
        Stage::Autoencoder(options) => autoencoder(&options),
        Stage::Diffusion(options) => diffusion(&options),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

/// Pairs on disk or simulated.
enum Source {
    Disk(Folder),
    Endless(Simulated),
}

impl Source {
    fn new(options: &Options) -> wake_ldm::Result<Self> {
        Ok(match &options.data {
            Some(path) => Self::Disk(Folder::open(path)?),
            None => {
                let recipe = Recipe::default().with_assignments(&["paraphrase = true"])?;
                Self::Endless(Simulated::new(recipe, options.seed)?)
            }
        })
    }

    fn pair(&self, index: u64) -> wake_ldm::Result<Pair> {
        match self {
            Self::Disk(folder) => folder.pair(index),
            Self::Endless(simulated) => simulated.pair(index),
        }
    }

    fn len(&self, options: &Options) -> u64 {
        match self {
            Self::Disk(folder) => folder.len(),
            Self::Endless(_) => options.count,
        }
    }
}

fn autoencoder(options: &Options) -> Result<(), Box<dyn Error>> {
    let config = config(options)?;
    let device = devices(&options.device)?.remove(0);
    let (_, shares) = fit(options, &Source::new(options)?, &config, &device)?;
    for channels in [4, 8, 16] {
        println!(
            "{channels:2} channels: {:.2} % of the variance, {:.2} dB",
            100.0 * shares.kept(channels),
            shares.psnr(channels)
        );
    }
    Ok(())
}

/// Fits the patch transform and writes it with what it keeps.
fn fit(
    options: &Options,
    source: &Source,
    config: &WakeModelConfig,
    device: &Device,
) -> Result<(PatchTransform, Shares), Box<dyn Error>> {
    let count = source.len(options).min(FITTED);
    let bar = progress_bar(count, "images for the patch transform");
    let mut images = Vec::new();
    for index in 0..count {
        images.push(source.pair(index)?.image.pixels);
        bar.inc(1);
    }
    bar.finish_and_clear();
    let pixels = images.iter().map(Vec::as_slice);
    let (transform, shares) =
        PatchTransform::fit(pixels, config.image_size, config.latent_channels, device);
    let path = options.out.join("patches.safetensors");
    save_as(&transform, Layout::Diffusers, &path, Precision::F32)?;
    let rows: Vec<_> = (1..=64)
        .map(|c| json!({"channels": c, "variance": shares.kept(c), "psnr_db": finite(shares.psnr(c))}))
        .collect();
    std::fs::write(
        options.out.join("shares.json"),
        format!("{:#}\n", json!(rows)),
    )?;
    Ok((transform, shares))
}

/// JSON has no infinity: all 64 components lose nothing.
fn finite(number: f64) -> Option<f64> {
    Some(number).filter(|number| number.is_finite())
}

fn config(options: &Options) -> Result<WakeModelConfig, Box<dyn Error>> {
    let written = options.out.join("config.json");
    let file = match &options.config {
        Some(file) => Some(file),
        None => Some(&written).filter(|file| options.resume && file.exists()),
    };
    Ok(match file {
        Some(file) => WakeModelConfig::from_json(&std::fs::read_to_string(file)?, file)?,
        None => WakeModelConfig::standard(&vocabulary()?),
    })
}

/// What prompts about wakes can contain: the words of every wording, and every digit.
fn vocabulary() -> Result<Vocabulary, wake_text::Error> {
    let (ship, mut calm) = (Scene::default(), Scene::default());
    (calm.ship, calm.sea.wind_speed) = (None, 0.0);
    let mut ids = tokens("0 1 2 3 4 5 6 7 8 9 .");
    for scene in [ship, calm] {
        for wording in Wording::ALL {
            ids.extend(tokens(&wording.prompt(&scene)?));
        }
    }
    Ok(Vocabulary::new(ids))
}

fn diffusion(options: &Options) -> Result<(), Box<dyn Error>> {
    let config = config(options)?;
    let devices = devices(&options.device)?;
    let source = Source::new(options)?;
    std::fs::create_dir_all(&options.out)?;
    let transform = transform(options, &source, &config, &devices[0])?;
    let text = serde_json::to_string_pretty(&config)?;
    std::fs::write(options.out.join("config.json"), text + "\n")?;
    let set = latents(&source, source.len(options), &transform, config.image_size)?;
    let mut run = begin(options, &config, &devices)?;
    let steps = options.steps as usize;
    let mut metrics = Metrics::open(&options.out.join("metrics.jsonl"), run.steps())?;
    let bar = progress_bar(steps as u64, "steps");
    while run.steps() < steps {
        let (report, losses) = run.step(&set);
        let terms = json!({"flow": losses.flow, "grey": losses.grey, "words": losses.words});
        metrics.write(run.steps(), steps, report, &terms)?;
        bar.set_message(format!("steps, loss {:.4}", report.loss));
        bar.set_position(run.steps() as u64);
        if run.steps().is_multiple_of(options.every as usize) || run.steps() == steps {
            run.checkpoint(&options.out.join("checkpoints"))?;
            let weights = options.out.join("model.safetensors");
            save_as(&run.averaged(), Layout::Diffusers, &weights, Precision::F16)?;
            let sampler = WakeSampler::new(run.averaged(), transform.clone(), config.clone())?;
            sheet(&sampler, &source, &options.out.join("sheet.png"))?;
        }
    }
    bar.finish_and_clear();
    println!("{steps} steps, results in {}", options.out.display());
    Ok(())
}

/// The patch transform of an earlier run, or a new one.
fn transform(
    options: &Options,
    source: &Source,
    config: &WakeModelConfig,
    device: &Device,
) -> Result<PatchTransform, Box<dyn Error>> {
    let path = options.out.join("patches.safetensors");
    if path.exists() {
        let zeros = PatchTransform::zeros(config.latent_channels, device);
        return Ok(load(zeros, Layout::Diffusers, &path)?);
    }
    Ok(fit(options, source, config, device)?.0)
}

/// Encodes all pairs, which then stay in memory.
fn latents(
    source: &Source,
    count: u64,
    transform: &PatchTransform,
    size: usize,
) -> wake_ldm::Result<LatentSet> {
    let bar = progress_bar(count, "pairs");
    let mut set = LatentSet::default();
    for index in 0..count {
        let mut pair = source.pair(index)?;
        let pixels = std::mem::take(&mut pair.image.pixels);
        set.push(transform, pixels, size, Example::of(&pair))?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(set)
}

fn begin(
    options: &Options,
    config: &WakeModelConfig,
    devices: &[Device],
) -> Result<Diffusion, Box<dyn Error>> {
    let constants = DiffusionOptions {
        batch: usize::from(options.batch),
        seed: options.seed,
        trainer: TrainerOptions {
            rate: Rate {
                peak: options.rate,
                warmup: 100,
                steps: options.steps as usize,
            },
            accumulation: usize::from(options.accumulation),
            ..TrainerOptions::default()
        },
        ..DiffusionOptions::default()
    };
    let autodiff = |device: &Device| {
        let device = device.clone().autodiff();
        if options.checkpointing {
            device.gradient_checkpointing()
        } else {
            device
        }
    };
    let devices = devices.iter().map(autodiff).collect();
    let run = Diffusion::new(config.clone(), constants, tokens(""), devices)?;
    if !options.resume {
        return Ok(run);
    }
    let folder = options.out.join("checkpoints");
    let checkpoint = Checkpoint::newest(&folder)?
        .ok_or_else(|| format!("--resume: there is no checkpoint in {}", folder.display()))?;
    Ok(run.resumed(checkpoint)?)
}

/// Simulated images above, generated ones of the same prompts below.
fn sheet(sampler: &WakeSampler, source: &Source, path: &Path) -> Result<(), Box<dyn Error>> {
    let pairs: Vec<Pair> = (0..SHEET)
        .map(|i| source.pair(i))
        .collect::<wake_ldm::Result<_>>()?;
    let prompts: Vec<&str> = pairs.iter().map(|pair| pair.prompt.as_str()).collect();
    let drawn = sampler.sample_many(&prompts, 0)?;
    let size = pairs[0].image.rows as u32;
    let mut sheet = image::GrayImage::new(size * SHEET as u32, 2 * size);
    for (i, (pair, image)) in pairs.iter().zip(&drawn).enumerate() {
        for (row, pixels) in [(0, &pair.image.pixels), (1, &image.grey.values)] {
            for (p, &grey) in pixels.iter().enumerate() {
                let (x, y) = (p as u32 % size, p as u32 / size);
                let level = (255.0 * grey).round() as u8;
                sheet.put_pixel(i as u32 * size + x, row * size + y, image::Luma([level]));
            }
        }
    }
    sheet.save(path)?;
    Ok(())
}

fn progress_bar(length: u64, what: &'static str) -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:40} {pos} of {len} {msg}, {eta} left");
    ProgressBar::new(length)
        .with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
        .with_message(what)
}

/// The devices of a list of names, where their backends are compiled in.
fn devices(names: &str) -> Result<Vec<Device>, String> {
    names.split(',').map(device).collect()
}

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
        "wgpu" if index == 0 => Ok(Device::wgpu(burn::tensor::DeviceKind::DefaultDevice)),
        #[cfg(feature = "cuda")]
        "cuda" => Ok(Device::cuda(index)),
        _ => Err(format!(
            "--device {name} is none of this build's: use flex, or build with --features ndarray, wgpu or cuda"
        )),
    }
}
