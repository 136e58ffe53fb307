//! The stages of training: patches, words, mean, diffusion.

use std::error::Error;
use std::path::Path;

use burn::module::Module;
use burn::tensor::Device;
use rayon::prelude::*;
use serde_json::{Map, Value, json};
use wake_ldm::WakeSampler;
use wake_ldm::conditioning::{Conditions, Vocabulary, tokens};
use wake_ldm::dataset::{Pair, Prompts, Recipe, Simulated};
use wake_ldm::network::{
    Flow, Known, PatchTransform, Prior, PromptParser, Shares, WakeModel, WakeModelConfig,
    expected_grey, expected_latents,
};
use wake_ldm::train::{
    Checkpoint, Example, FlowTask, LatentSet, Metrics, PriorTask, Run, Task, WordsTask,
};
use wake_ldm::weights::{Layout, Precision, load, save_as};
use wake_physics::Scene;
use wake_text::Wording;

use super::options::{Options, newest};
use super::progress;
use super::source::Source;

type Outcome<T> = Result<T, Box<dyn Error>>;

/// Images that the patch transform is fitted to.
const FITTED: u64 = 400;
/// Images read or simulated at the same time.
const AT_ONCE: usize = 64;
/// Images in a row of a sheet.
const SHEET: u64 = 8;
/// Ranges that prompts to read are drawn from, beyond those of images.
const PROMPT_RANGES: [&str; 4] = [
    "draw.ranges.ship_speed = [1.0, 15.0]",
    "draw.ranges.wind_speed = [1.0, 12.0]",
    "draw.ranges.fetch = [1e3, 1e6]",
    "draw.ranges.incidence = [10.0, 40.0]",
];

pub(crate) fn autoencoder(options: &Options) -> Outcome<()> {
    let source = Source::new(options)?;
    options.devices()?;
    let config = config(options)?;
    let shares = fit(options, &source, &config)?;
    for channels in [4, 8, 16] {
        println!(
            "{channels:2} channels: {:.2} % of the variance, {:.2} dB",
            100.0 * shares.kept(channels),
            shares.psnr(channels)
        );
    }
    Ok(())
}

pub(crate) fn words(options: &Options) -> Outcome<()> {
    let stage = Stage::new("words", options)?;
    let config = config(options)?;
    let recipe = Recipe::default().with_assignments(&PROMPT_RANGES)?;
    let prompts = Prompts::new(Simulated::new(recipe, options.seed)?);
    let vocabulary = Vocabulary::new(config.vocabulary.iter().copied());
    let steps = options.steps(4000);
    let devices = options.learning_devices()?;
    let init = |config: &WakeModelConfig, device: &Device| config.init_parser(device);
    let mut run = Run::new("words", &config, init, options.run(steps, 128), devices)?;
    let task = WordsTask {
        prompts: &prompts,
        vocabulary: &vocabulary,
    };
    let file = options.out.join("reader.safetensors");
    stage.train(&mut run, steps, &task, |_: &Run<PromptParser>| Ok(()))?;
    Ok(keep(&run.averaged(), &file)?)
}

pub(crate) fn mean(options: &Options) -> Outcome<()> {
    let (stage, source) = (Stage::new("mean", options)?, Source::new(options)?);
    let config = config(options)?;
    let patches = patches(options, &source, &config)?;
    let set = latents(&source, &patches, &config)?;
    let steps = options.steps(6000);
    let devices = options.learning_devices()?;
    let init = |config: &WakeModelConfig, device: &Device| config.init_prior(device);
    let mut run = Run::new("mean", &config, init, options.run(steps, 32), devices)?;
    let task = PriorTask {
        set: &set,
        grid: config.grid(),
        seed: options.seed,
    };
    let examples = sheet_examples(&source)?;
    stage.train(&mut run, steps, &task, |run: &Run<Prior>| {
        let means = expected_images(&run.averaged(), &patches, &config, &examples)?;
        sheet(&examples, &means, &options.out.join("sheet.png"))
    })?;
    let file = options.out.join("prior.safetensors");
    Ok(keep(&run.averaged(), &file)?)
}

pub(crate) fn diffusion(options: &Options) -> Outcome<()> {
    let (stage, source) = (Stage::new("diffusion", options)?, Source::new(options)?);
    let missing = |name: &str| !options.out.join(name).exists();
    if missing("reader.safetensors") {
        words(&options.before("words"))?;
    }
    if missing("prior.safetensors") {
        mean(&options.before("mean"))?;
    }
    let config = config(options)?;
    let device = options.devices()?.remove(0);
    let model = WakeModel {
        patches: patches(options, &source, &config)?,
        parser: part(config.init_parser(&device), options, "reader.safetensors")?,
        prior: part(config.init_prior(&device), options, "prior.safetensors")?,
        flow: config.init_flow(&device),
    };
    let set = latents(&source, &model.patches, &config)?;
    let bar = progress::bar(set.len() as u64, "residuals");
    let set = set.residuals(&model.prior, config.grid(), |n| {
        bar.inc(n as u64);
    });
    bar.finish_and_clear();
    let steps = options.steps(6000);
    let devices = options.learning_devices()?;
    let init = |config: &WakeModelConfig, device: &Device| config.init_flow(device);
    let mut run = Run::new("diffusion", &config, init, options.run(steps, 8), devices)?;
    let task = FlowTask {
        set: &set,
        patches: &model.patches,
        config: &config,
        seed: options.seed,
    };
    let examples = sheet_examples(&source)?;
    stage.train(&mut run, steps, &task, |run: &Run<Flow>| {
        let flow = run.averaged();
        keep(&flow, &options.out.join("flow.safetensors"))?;
        let sampler = WakeSampler::new(
            WakeModel {
                flow,
                ..model.clone()
            },
            config.clone(),
        )?;
        let drawn = sampler.sample_scenes(&scenes_of(&examples, &config))?;
        let drawn: Vec<Vec<f32>> = drawn.into_iter().map(|image| image.grey.values).collect();
        sheet(&examples, &drawn, &options.out.join("sheet.png"))
    })
}

/// Writes a part of the model as it ships.
fn keep(part: &impl Module, path: &Path) -> wake_ldm::Result<()> {
    save_as(part, Layout::Diffusers, path, Precision::F16)
}

/// One run with its checkpoints and its log.
struct Stage<'a> {
    name: &'static str,
    options: &'a Options,
    checkpoint: Option<Checkpoint>,
}

impl<'a> Stage<'a> {
    /// Reads the newest checkpoint where the run is to go on; nothing is written yet.
    fn new(name: &'static str, options: &'a Options) -> Outcome<Self> {
        options.devices()?;
        let checkpoint = match options.resume {
            true => Some(newest(&options.checkpoints(name))?),
            false => None,
        };
        Ok(Self {
            name,
            options,
            checkpoint,
        })
    }

    /// Makes all steps; `show` is called after every checkpoint.
    fn train<M: Module>(
        self,
        run: &mut Run<M>,
        steps: usize,
        task: &impl Task<M>,
        show: impl Fn(&Run<M>) -> Outcome<()>,
    ) -> Outcome<()> {
        let (stage, out) = (self.name, &self.options.out);
        if let Some(checkpoint) = self.checkpoint {
            run.resume(checkpoint)?;
        }
        let mut metrics = Metrics::open(&out.join(format!("{stage}.jsonl")), run.steps())?;
        let bar = progress::bar(steps as u64, stage);
        while run.steps() < steps {
            let (report, terms) = run.step(task);
            let terms: Map<String, Value> = terms
                .into_iter()
                .map(|(name, value)| (name.to_owned(), json!(value)))
                .collect();
            metrics.write(run.steps(), steps, report, &Value::Object(terms))?;
            bar.set_message(format!("{stage}, loss {:.4}", report.loss));
            bar.set_position(run.steps() as u64);
            if run.steps().is_multiple_of(self.options.every as usize) || run.steps() == steps {
                run.checkpoint(&self.options.checkpoints(stage))?;
                show(run)?;
            }
        }
        bar.finish_and_clear();
        println!("{stage}: {steps} steps, results in {}", out.display());
        Ok(())
    }
}

/// Fits the patch transform and writes it with what it keeps.
fn fit(options: &Options, source: &Source, config: &WakeModelConfig) -> Outcome<Shares> {
    let device = options.devices()?.remove(0);
    let count = source.len().min(FITTED);
    let bar = progress::bar(count, "images for the patch transform");
    let mut images = Vec::new();
    for index in 0..count {
        images.push(source.pair(index)?.image.pixels);
        bar.inc(1);
    }
    bar.finish_and_clear();
    let pixels = images.iter().map(Vec::as_slice);
    let (transform, shares) =
        PatchTransform::fit(pixels, config.image_size, config.latent_channels, &device);
    let path = options.out.join("patches.safetensors");
    save_as(&transform, Layout::Diffusers, &path, Precision::F32)?;
    let rows: Vec<_> = (1..=64)
        .map(|c| json!({"channels": c, "variance": shares.kept(c), "psnr_db": finite(shares.psnr(c))}))
        .collect();
    std::fs::write(
        options.out.join("shares.json"),
        format!("{:#}\n", json!(rows)),
    )?;
    Ok(shares)
}

/// JSON has no infinity: all 64 components lose nothing.
fn finite(number: f64) -> Option<f64> {
    Some(number).filter(|number| number.is_finite())
}

/// The patch transform of an earlier run, or a new one.
fn patches(
    options: &Options,
    source: &Source,
    config: &WakeModelConfig,
) -> Outcome<PatchTransform> {
    if !options.out.join("patches.safetensors").exists() {
        fit(options, source, config)?;
    }
    let device = options.devices()?.remove(0);
    part(
        PatchTransform::zeros(config.latent_channels, &device),
        options,
        "patches.safetensors",
    )
}

/// A part of the model with the weights of an earlier stage.
fn part<M: Module>(module: M, options: &Options, name: &str) -> Outcome<M> {
    Ok(load(module, Layout::Diffusers, &options.out.join(name))?)
}

/// The widths of the model: those of --config, else those in --out, else the standard ones; written to --out.
fn config(options: &Options) -> Outcome<WakeModelConfig> {
    let written = options.out.join("config.json");
    let file = match &options.config {
        Some(file) => Some(file),
        None => Some(&written).filter(|file| file.exists()),
    };
    let config = match file {
        Some(file) => WakeModelConfig::from_json(&std::fs::read_to_string(file)?, file)?,
        None => WakeModelConfig::standard(&vocabulary()?),
    };
    std::fs::create_dir_all(&options.out)?;
    std::fs::write(&written, serde_json::to_string_pretty(&config)? + "\n")?;
    Ok(config)
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

/// Encodes all pairs and the images expected of their scenes, which then stay in memory.
fn latents(
    source: &Source,
    patches: &PatchTransform,
    config: &WakeModelConfig,
) -> wake_ldm::Result<LatentSet> {
    let bar = progress::bar(source.len(), "pairs");
    let mut set = LatentSet::default();
    let indices: Vec<u64> = (0..source.len()).collect();
    let base = config.base_scene();
    for chunk in indices.chunks(AT_ONCE) {
        let read = |&index: &u64| -> wake_ldm::Result<_> {
            let mut pair = source.pair(index)?;
            let example = Example::of(&pair);
            let expected = expected_grey(&example.conditions.onto(&base))?;
            Ok((example, [std::mem::take(&mut pair.image.pixels), expected]))
        };
        let pairs: Vec<_> = chunk.par_iter().map(read).collect();
        for pair in pairs {
            let (example, images) = pair?;
            set.push(patches, images, config.image_size, example)?;
            bar.inc(1);
        }
    }
    bar.finish_and_clear();
    Ok(set)
}

fn sheet_examples(source: &Source) -> wake_ldm::Result<Vec<Pair>> {
    (0..SHEET).map(|index| source.pair(index)).collect()
}

fn scenes_of(examples: &[Pair], config: &WakeModelConfig) -> Vec<Scene> {
    let base = config.base_scene();
    let scene = |pair: &Pair| Example::of(pair).conditions.onto(&base);
    examples.iter().map(scene).collect()
}

/// The mean images of some scenes.
fn expected_images(
    prior: &Prior,
    patches: &PatchTransform,
    config: &WakeModelConfig,
    examples: &[Pair],
) -> wake_ldm::Result<Vec<Vec<f32>>> {
    let scenes = scenes_of(examples, config);
    let conditions: Vec<Conditions> = scenes.iter().map(Conditions::of_scene).collect();
    let wake = expected_latents(&scenes, patches)?;
    let expected = prior.forward(&Known::new(&conditions, config.grid(), wake));
    let images = patches.decode(expected.mean, expected.grey).clamp(0.0, 1.0);
    let pixels: Vec<f32> = images.into_data().iter::<f32>().collect();
    let size = config.image_size * config.image_size;
    Ok(pixels.chunks(size).map(<[f32]>::to_vec).collect())
}

/// Simulated images above, images of the model below.
fn sheet(examples: &[Pair], drawn: &[Vec<f32>], path: &Path) -> Outcome<()> {
    let size = examples[0].image.rows as u32;
    let mut sheet = image::GrayImage::new(size * examples.len() as u32, 2 * size);
    for (i, (pair, drawn)) in examples.iter().zip(drawn).enumerate() {
        for (row, pixels) in [(0, &pair.image.pixels), (1, drawn)] {
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
