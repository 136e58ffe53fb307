//! A Stable Diffusion-layout model learns to draw wakes.

use std::error::Error;
use std::path::{Path, PathBuf};

use burn::tensor::{Device, Int, Tensor, TensorData};
use clap::Args;
use serde_json::{Value, json};
use wake_ldm::dataset::{Folder, Pair};
use wake_ldm::noise::NoiseSource;
use wake_ldm::pipeline::{Pipeline, PipelineParts};
use wake_ldm::scheduler::Prediction;
use wake_ldm::train::{
    Checkpoint, FineTune, FineTuneOptions, Frozen, Metrics, Rate, TrainerOptions,
};
use wake_ldm::weights::Precision;
use wake_ldm::{device_named, fingerprint};
use wake_physics::output;
use wake_text::Tokenizer;

use super::exit;
use super::options::learning;
use super::progress;

type Outcome<T> = Result<T, Box<dyn Error>>;

/// Streams of random numbers: which pairs, and which of them without their prompt.
const PAIR_STREAM: u32 = 2200;
const PROMPT_STREAM: u32 = 2201;
/// Part of the pairs whose prompt is left out, for guidance.
const WITHOUT_PROMPT: f64 = 0.1;

/// The paper's recipe by default: batch 16, rate 1e-5, the whole U-Net and nothing else.
#[derive(Args)]
pub(crate) struct Options {
    /// Folder of the model in diffusers layout
    #[arg(long, value_name = "DIR")]
    weights: PathBuf,
    /// Folder that `make_dataset` wrote
    #[arg(long, value_name = "DIR")]
    data: PathBuf,
    /// Learn changes of this rank of the attentions, and leave all else [default: the whole U-Net learns]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    rank: Option<u16>,
    /// Steps
    #[arg(long, default_value_t = 1000, value_parser = clap::value_parser!(u32).range(1..))]
    steps: u32,
    /// Images of a batch
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u16).range(1..))]
    batch: u16,
    /// Largest step of the optimizer
    #[arg(long, default_value_t = 1e-5)]
    rate: f64,
    /// γ of the weights by signal-to-noise ratio [default: all steps count the same]
    #[arg(long, value_name = "GAMMA")]
    snr_gamma: Option<f64>,
    /// Steps between two writings of the model
    #[arg(long, default_value_t = 250, value_parser = clap::value_parser!(u32).range(1..))]
    every: u32,
    /// Seed of everything that is drawn
    #[arg(long, default_value_t = 7)]
    seed: u64,
    /// Go on from the newest checkpoint in --out
    #[arg(long)]
    resume: bool,
    /// Keep less for the way back through the model, and compute it again; slower
    #[arg(long)]
    checkpointing: bool,
    /// Compute losses and gradients in bfloat16, where the device can; weights keep 32 bits
    #[arg(long)]
    bf16: bool,
    /// flex, ndarray, wgpu or cuda, where compiled in
    #[arg(long, default_value = "flex")]
    device: String,
    /// Folder of the results, in diffusers layout, made if absent
    #[arg(long, value_name = "DIR", default_value = "out/fine_tune")]
    out: PathBuf,
}

/// Where the checkpoints lie, below --out.
const CHECKPOINTS: &str = "checkpoints";
/// What the run was begun with, and after how many steps the model in --out was written.
const RECORD: &str = "fine_tune.json";

pub(crate) fn run(options: &Options) -> Outcome<()> {
    let device = device_named(&options.device)?;
    let data = Folder::open(&options.data)?;
    let parts = Pipeline::load(&options.weights, &device)?.into_parts();
    check_size(options, &data, parts.autoencoder.downsampling())?;
    let mut run = begin(options, &data, &parts, &device)?;
    let checkpoints = options.out.join(CHECKPOINTS);
    let newest = Checkpoint::newest(&checkpoints)?;
    let (out, place) = (&options.out, checkpoints.display());
    match (newest, options.resume) {
        (Some(checkpoint), true) => run.resume(checkpoint)?,
        (None, false) => {}
        (None, true) => {
            return Err(
                format!("--resume: there is no checkpoint in {place}; begin without it").into(),
            );
        }
        (Some(there), false) => {
            let made = there.step;
            let message = "--resume goes on with it, another --out begins anew";
            return Err(format!(
                "{}: a run that has made {made} steps; {message}",
                out.display()
            )
            .into());
        }
    }
    let _lock = output::lock_folder(out)?;
    // A kill after the checkpoint leaves the model of the one before.
    if run.steps() > 0 && written_after(out) != Some(run.steps() as u64) {
        save(options, &run, &parts, &device)?;
    }
    let mut metrics = Metrics::open(&out.join("fine_tune.jsonl"), run.steps())?;
    let steps = options.steps as usize;
    let bar = progress::bar(u64::from(options.steps), "fine-tuning");
    while run.steps() < steps {
        let (images, ids) = batch(options, &data, &parts, run.steps(), &device)?;
        let report = run.step(images, ids)?;
        metrics.write(run.steps(), steps, report, &json!({}))?;
        bar.set_message(format!("fine-tuning, loss {:.4}", report.loss));
        bar.set_position(run.steps() as u64);
        if run.steps().is_multiple_of(options.every as usize) || run.steps() == steps {
            run.checkpoint(&checkpoints)?;
            save(options, &run, &parts, &device)?;
        }
    }
    bar.finish_and_clear();
    let made = run.steps();
    Ok(exit::say(&format!(
        "{made} steps, model in {}",
        out.display()
    ))?)
}

/// Refuses images that the autoencoder cannot halve as often as it does.
fn check_size(options: &Options, data: &Folder, down: usize) -> Outcome<()> {
    let grid = &data.manifest().recipe.scene.grid;
    if grid.rows.is_multiple_of(down) && grid.columns.is_multiple_of(down) && !data.is_empty() {
        return Ok(());
    }
    let (data, rows, columns) = (options.data.display(), grid.rows, grid.columns);
    Err(
        format!("--data {data}: images of {rows} x {columns} pixels, expected multiples of {down}")
            .into(),
    )
}

/// After how many steps the model in a folder was written.
fn written_after(folder: &Path) -> Option<u64> {
    let text = std::fs::read_to_string(folder.join(RECORD)).ok()?;
    let record: Value = serde_json::from_str(&text).ok()?;
    record["results_after"].as_u64()
}

/// What a run learns from: the files of the model it begins with, and the set.
fn identity(options: &Options, data: &Folder) -> Outcome<Value> {
    let mut files = std::collections::BTreeMap::new();
    for part in ["unet", "vae", "text_encoder", "scheduler"] {
        let Ok(entries) = std::fs::read_dir(options.weights.join(part)) else {
            continue;
        };
        for entry in entries {
            let path = entry?.path();
            let name = path
                .file_name()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned();
            if path.is_file() && !name.starts_with('.') {
                files.insert(format!("{part}/{name}"), fingerprint(&path)?);
            }
        }
    }
    Ok(json!({"weights": files, "data": data.manifest(), "shard": data.manifest().shard}))
}

fn begin(
    options: &Options,
    data: &Folder,
    parts: &PipelineParts,
    device: &Device,
) -> Outcome<FineTune> {
    let schedule = parts.scheduler.noise_schedule().cloned();
    let schedule = schedule.ok_or("the model's scheduler has no noise schedule to train with")?;
    let prediction = match parts.scheduler.to_json()["prediction_type"].as_str() {
        Some("v_prediction") => Prediction::Velocity,
        Some("sample") => Prediction::Sample,
        Some("epsilon") | None => Prediction::Epsilon,
        _ => Prediction::Flow,
    };
    let constants = FineTuneOptions {
        prediction,
        snr_gamma: options.snr_gamma,
        seed: options.seed,
        identity: identity(options, data)?,
        trainer: TrainerOptions {
            rate: Rate {
                peak: options.rate,
                warmup: 20,
                steps: options.steps as usize,
            },
            bf16: options.bf16,
            ..TrainerOptions::default()
        },
    };
    let frozen = Frozen {
        text: parts.text_encoder.clone(),
        autoencoder: parts.autoencoder.clone(),
        schedule,
    };
    let learning = learning(device.clone(), options.checkpointing, options.bf16)?;
    let unet = parts.unet.clone();
    Ok(match options.rank {
        None => FineTune::whole(unet, frozen, constants, &learning)?,
        Some(rank) => FineTune::low_rank(unet, usize::from(rank), frozen, constants, &learning)?,
    })
}

/// Images in −1…1 with the channels of the autoencoder, and the ids of their prompts.
fn batch(
    options: &Options,
    data: &Folder,
    parts: &PipelineParts,
    step: usize,
    device: &Device,
) -> Outcome<(Tensor<4>, Tensor<2, Int>)> {
    let random = NoiseSource::new(options.seed);
    let tokenizer = parts
        .tokenizer
        .as_ref()
        .unwrap_or_else(|| Tokenizer::clip());
    let count = usize::from(options.batch);
    let (mut pixels, mut ids, mut size) = (Vec::new(), Vec::new(), [0, 0]);
    for position in (step * count..(step + 1) * count).map(|p| p as u64) {
        let draw = random.uniform(PAIR_STREAM, position);
        let Pair { image, prompt, .. } = data.pair((draw * data.len() as f64) as u64)?;
        size = [image.rows, image.columns];
        pixels.extend(image.pixels.iter().map(|grey| 2.0 * grey - 1.0));
        let told = random.uniform(PROMPT_STREAM, position) >= WITHOUT_PROMPT;
        let prompt = tokenizer.encode(if told { &prompt } else { "" });
        ids.extend(prompt.ids.iter().map(|&id| id as i32));
    }
    let channels = parts.autoencoder.config().in_channels;
    let images: Tensor<4> = Tensor::from_data(
        TensorData::new(pixels, [count, 1, size[0], size[1]]),
        device,
    );
    let tokens = ids.len() / count;
    Ok((
        images.repeat_dim(1, channels),
        Tensor::from_data(TensorData::new(ids, [count, tokens]), device),
    ))
}

/// Writes the whole model, and the changes alone where they are what learns.
fn save(options: &Options, run: &FineTune, parts: &PipelineParts, device: &Device) -> Outcome<()> {
    let parts = PipelineParts {
        unet: run.unet(),
        ..parts.clone()
    };
    Pipeline::new(parts, device)?.save(&options.out, Precision::F32)?;
    if let Some(changes) = run.changes() {
        changes.save(
            "unet",
            &options.out.join("pytorch_lora_weights.safetensors"),
        )?;
    }
    let record = json!({"results_after": run.steps()});
    Ok(output::write_json(&options.out.join(RECORD), &record)?)
}
