//! A small model of Stable Diffusion's kind is learnt from nothing, from images and prompts alone.

use std::path::{Path, PathBuf};

use burn::tensor::Device;
use clap::Args;
use serde_json::{Value, json};
use wake_ldm::autoencoder::{AutoencoderKl, AutoencoderKlConfig};
use wake_ldm::dataset::{Pair, Recipe};
use wake_ldm::pipeline::{Pipeline, PipelineParts, Request};
use wake_ldm::scheduler::SchedulerConfig;
use wake_ldm::text::ClipTextConfig;
use wake_ldm::train::{
    AutoencoderTask, PromptedImages, PromptedLatents, Rate, Run, RunFolder, RunOptions, Stage,
    TextToImage, TextToImageTask, TrainerOptions,
};
use wake_ldm::unet::UNetConfig;
use wake_ldm::weights::{Layout, Precision, save_folder};
use wake_ldm::{device_named, fingerprint};
use wake_physics::available_memory;

use super::options::learning;
use super::progress;
use super::sheet::sheet;
use super::source::Source;
use super::stage::train;
use super::stages::Outcome;

/// What is simulated without --data: the recipe `ranges` with the ship in the middle, of whose place prompts say nothing.
const RECIPE: &str = r#"
base = "paper"
speckle = false
scene.grid = { rows = 256, columns = 256, spacing = 4.0 }
scene.model.tolerance = 1e-2
[draw]
count = { one_of = [0, 1], weights = [1, 4] }
"ship.speed" = [6.0, 12.0]
"ship.heading" = [0.0, 360.0]
"sea.wind_speed" = [3.0, 7.0]
"sea.wind_toward" = [0.0, 360.0]
"sea.fetch" = { log = [10e3, 70e3] }
"radar.incidence" = [16.0, 32.0]
"#;
/// Names of the two stages.
const AUTOENCODER: &str = "autoencoder-kl";
const MODEL: &str = "text-to-image";
/// What the stages write.
const VAE: &str = "vae/diffusion_pytorch_model.safetensors";
const RESULTS: [&str; 2] = ["model_index.json", "sheet.png"];
/// Images read or simulated at the same time.
const AT_ONCE: u64 = 64;
/// Images of a sheet, and the steps that they are drawn with.
const SHOWN: u64 = 8;
const DRAWN: usize = 25;
/// Channels of a latent pixel, and of a token.
const LATENTS: usize = 32;
const TOKENS: usize = 128;

#[derive(Args)]
pub(crate) struct Options {
    /// Folder that `make_dataset` wrote; without it, pairs are simulated first
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Pairs to simulate where there is no --data
    #[arg(long, default_value_t = 4000, value_parser = clap::value_parser!(u64).range(8..=10_000_000))]
    count: u64,
    /// Steps of the autoencoder
    #[arg(long, default_value_t = 2000, value_parser = clap::value_parser!(u32).range(1..))]
    autoencoder_steps: u32,
    /// Steps of text encoder and U-Net
    #[arg(long, default_value_t = 5000, value_parser = clap::value_parser!(u32).range(1..))]
    steps: u32,
    /// Images of a batch
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u16).range(1..))]
    batch: u16,
    /// Largest step of the optimizer
    #[arg(long, default_value_t = 5e-4)]
    rate: f64,
    /// Steps between checkpoints and sheets
    #[arg(long, default_value_t = 1000, value_parser = clap::value_parser!(u32).range(1..))]
    every: u32,
    /// Seed of the run, and of simulated pairs
    #[arg(long, default_value_t = 7)]
    seed: u64,
    /// Go on from the newest checkpoints in --out
    #[arg(long)]
    resume: bool,
    /// flex, ndarray, wgpu or cuda, where compiled in; a comma between several
    #[arg(long, default_value = "flex")]
    device: String,
    /// Folder of the results, in diffusers layout, made if absent
    #[arg(long, value_name = "DIR", default_value = "out/text_to_image")]
    out: PathBuf,
}

impl Options {
    fn run(&self, steps: u32, identity: Value) -> RunOptions {
        RunOptions {
            batch: usize::from(self.batch),
            seed: self.seed,
            identity,
            trainer: TrainerOptions {
                rate: Rate {
                    peak: self.rate,
                    warmup: 100,
                    steps: steps as usize,
                },
                ..TrainerOptions::default()
            },
        }
    }
}

/// Widths of the three models.
fn widths() -> (AutoencoderKlConfig, ClipTextConfig, UNetConfig) {
    let text = ClipTextConfig::new()
        .with_hidden_size(TOKENS)
        .with_intermediate_size(4 * TOKENS)
        .with_layers(4)
        .with_heads(4)
        .with_end_token(49407);
    (
        AutoencoderKlConfig::small(LATENTS, 3),
        text,
        UNetConfig::small(LATENTS, Some(TOKENS), None),
    )
}

pub(crate) fn run(options: &Options) -> Outcome<()> {
    let devices = options.device.split(',').map(device_named);
    let devices = devices.collect::<wake_ldm::Result<Vec<_>>>()?;
    options.run(1, Value::Null).validate(devices.len())?;
    let recipe = Recipe::from_toml(RECIPE)?;
    let source = Source::any(options.data.as_deref(), recipe, options.seed, options.count)?;
    let examples = source.first(SHOWN)?;
    let (autoencoder, text, unet) = widths();
    check(&source, &examples, autoencoder.downsampling())?;
    let model = json!({
        "vae": autoencoder.to_json(), "text_encoder": text.to_json(), "unet": unet.to_json(),
    });
    let identity = source.identity();
    let learning = devices
        .iter()
        .map(|device| learning(device.clone(), false, false));
    let learning = learning.collect::<Outcome<Vec<_>>>()?;
    let begin = (AUTOENCODER, options.resume);
    let mut folder = RunFolder::open(&options.out, &model, &identity, begin)?;
    let images = images(&source)?;

    let constants = options.run(options.autoencoder_steps, identity.clone());
    let init = |device: &Device| autoencoder.init(device);
    let run = Run::of(
        AUTOENCODER,
        &model["vae"],
        init,
        constants,
        learning.clone(),
    )?;
    let task = AutoencoderTask {
        images: &images,
        seed: options.seed,
    };
    let (vae, config) = (options.out.join("vae"), &model["vae"]);
    let show = |run: &Run<AutoencoderKl>| {
        let averaged = run.averaged();
        Ok(save_folder(
            &averaged,
            Layout::Diffusers,
            config,
            &vae,
            Precision::F16,
        )?)
    };
    if folder.unfinished(AUTOENCODER, &[VAE])?.is_some() {
        let stage = stage(options, AUTOENCODER, options.autoencoder_steps, &folder);
        train(stage, &mut folder, run, &task, show)?;
    }

    let identity = json!({"data": identity, "vae": fingerprint(&options.out.join(VAE))?});
    let (set, autoencoder) = latents(images, &options.out, &devices[0])?;
    let constants = options.run(options.steps, identity);
    let init = |device: &Device| TextToImage {
        text_encoder: text.init(device),
        unet: unet.init(device),
    };
    let run = Run::of(MODEL, &model, init, constants, learning)?;
    let scheduler = SchedulerConfig::stable_diffusion("ddim")?;
    let schedule = scheduler.noise_schedule().ok_or("no noise schedule")?;
    let task = TextToImageTask {
        set: &set,
        schedule,
        seed: options.seed,
    };
    let show = |run: &Run<TextToImage>| {
        let averaged = run.averaged();
        let parts = PipelineParts {
            tokenizer: None,
            text_encoder: averaged.text_encoder,
            unet: averaged.unet,
            autoencoder: autoencoder.clone(),
            scheduler: scheduler.clone(),
            latent_size: set.shape()[1],
        };
        let pipeline = Pipeline::new(parts, &devices[0])?;
        draw(&pipeline, &examples, options)?;
        Ok(pipeline.save(&options.out, Precision::F16)?)
    };
    let stage = stage(options, MODEL, options.steps, &folder);
    train(stage, &mut folder, run, &task, show)
}

/// How a stage runs: on from its last checkpoint, if that is asked for and there is one.
fn stage<'a>(
    options: &'a Options,
    name: &'static str,
    steps: u32,
    folder: &RunFolder,
) -> Stage<'a> {
    Stage {
        name,
        out: &options.out,
        resume: options.resume && folder.checkpoints(name).is_dir(),
        every: options.every as usize,
        steps: steps as usize,
        results: match name {
            AUTOENCODER => &[VAE],
            _ => &RESULTS,
        },
    }
}

/// Refuses images that the models cannot halve as often as they do, and those that do not fit in memory.
fn check(source: &Source, examples: &[Pair], down: usize) -> Outcome<()> {
    let image = &examples[0].image;
    let multiple = 4 * down;
    if image.rows != image.columns || !image.rows.is_multiple_of(multiple) {
        return Err(format!(
            "images of {} x {} pixels, expected squares with a multiple of {multiple} on a side; set grid.rows and \
             grid.columns of the data set to that",
            image.rows, image.columns
        )
        .into());
    }
    // Two bytes a pixel, and four a latent number while they are scaled.
    let each = 2 * image.pixels.len() + 6 * LATENTS * image.pixels.len() / (down * down);
    let needed = source.len().saturating_mul(each as u64);
    match available_memory().filter(|&free| free < needed) {
        None => Ok(()),
        Some(free) => {
            let [needed, free] = [needed, free].map(|bytes| bytes as f64 / (1u64 << 30) as f64);
            let count = source.len();
            Err(format!(
                "{count} pairs need {needed:.1} GiB of memory, but {free:.1} GiB are free; lower --count, or take a \
                 smaller --data"
            )
            .into())
        }
    }
}

/// All images and prompts.
fn images(source: &Source) -> Outcome<PromptedImages> {
    let mut images = PromptedImages::default();
    let bar = progress::bar(source.len(), "pairs");
    for first in (0..source.len()).step_by(AT_ONCE as usize) {
        for pair in source.items(first..source.len().min(first + AT_ONCE))? {
            images.push(&pair)?;
            bar.inc(1);
        }
    }
    bar.finish_and_clear();
    Ok(images)
}

/// The latents of all images, and the autoencoder that scales them.
fn latents(
    images: PromptedImages,
    out: &Path,
    device: &Device,
) -> Outcome<(PromptedLatents, AutoencoderKl)> {
    let autoencoder = AutoencoderKl::from_folder(&out.join("vae"), device)?;
    let bar = progress::bar(images.len() as u64, "latents");
    let latents = images.encode(autoencoder, device, |n| bar.inc(n as u64));
    bar.finish_and_clear();
    Ok(latents)
}

/// Some images of the data, and below each one that the model draws from its prompt.
fn draw(pipeline: &Pipeline, examples: &[Pair], options: &Options) -> Outcome<()> {
    let prompts: Vec<String> = examples.iter().map(|pair| pair.prompt.clone()).collect();
    let request = Request::new(prompts)
        .with_images_at_once(examples.len())
        .with_guidance(1.0)
        .with_steps(DRAWN)
        .with_seed(options.seed);
    let images = pipeline.generate(&request)?;
    let pixels: Vec<f32> = images.into_data().iter::<f32>().collect();
    let each = pixels.len() / examples.len();
    let drawn: Vec<Vec<f32>> = pixels.chunks(each).map(<[f32]>::to_vec).collect();
    sheet(examples, &drawn, &options.out.join("sheet.png"))
}
