//! The stages of training: patches, words, mean, diffusion.

use std::error::Error;
use std::path::Path;
use std::sync::Arc;

use burn::module::Module;
use burn::tensor::{Device, Tensor, TensorData};
use rayon::prelude::*;
use serde_json::{Value, json};
use wake_ldm::conditioning::{Vocabulary, tokens};
use wake_ldm::dataset::{Folder, Pair, Prompts, Recipe, Simulated};
use wake_ldm::network::{
    Domain, Flow, Foreseen, PatchTransform, Prior, PromptParser, Shares, WakeModel,
    WakeModelConfig, expected_grey,
};
use wake_ldm::train::{Checkpoint, FlowTask, LatentSet, PriorTask, Run, RunFolder, WordsTask};
use wake_ldm::weights::{Layout, Precision, load, save_as};
use wake_ldm::{WakeSampler, fingerprint};
use wake_physics::grey::GreyScale;
use wake_physics::{Scene, available_memory, output};
use wake_text::Wording;

use super::exit;
use super::options::Options;
use super::progress;
use super::sheet::sheet;
use super::source::Source;
use super::stage::Stage;

pub(crate) type Outcome<T> = Result<T, Box<dyn Error>>;

/// Images that the patch transform is fitted to.
const FITTED: u64 = 400;
/// Images read or simulated at the same time.
const AT_ONCE: usize = 64;
/// Images in a row of a sheet.
const ACROSS: u64 = 8;
/// Examples of a batch and the largest step of the optimizer by default.
const USUAL: [(&str, (u16, f64)); 3] = [
    ("words", (128, 1e-3)),
    ("mean", (32, 2e-3)),
    ("diffusion", (8, 1e-3)),
];
/// The patch transform is fitted to what images have beyond the expected ones, each brought to this deviation of grey, if it
/// is not below the least.
const DEVIATION: f32 = 0.05;
const LEAST_DEVIATION: f32 = 1e-3;
/// Names of what the stages write.
const PATCHES: &str = "patches.safetensors";
const PARSER: &str = "reader.safetensors";
const PRIOR: &str = "prior.safetensors";
const FLOW: &str = "flow.safetensors";
const SHEET: &str = "sheet.png";
/// Ranges that prompts to read are drawn from, beyond those of images.
const PROMPT_RANGES: [&str; 4] = [
    "draw.ship.speed = [1.0, 15.0]",
    "draw.sea.wind_speed = [1.0, 12.0]",
    "draw.sea.fetch = { log = [1e3, 1e6] }",
    "draw.radar.incidence = [10.0, 40.0]",
];

pub(crate) fn autoencoder(options: &Options) -> Outcome<()> {
    let work = Work::new(options, "autoencoder", true)?;
    let shares = work.fit(work.source()?)?;
    let line = |channels| {
        let (kept, psnr) = (100.0 * shares.kept(channels), shares.psnr(channels));
        format!("{channels:2} channels: {kept:.2} % of the variance, {psnr:.2} dB")
    };
    Ok(exit::say(&[4, 8, 16].map(line).join("\n"))?)
}

pub(crate) fn words(options: &Options) -> Outcome<()> {
    Work::new(options, "words", false)?.words(options)
}

pub(crate) fn mean(options: &Options) -> Outcome<()> {
    Work::new(options, "mean", true)?.mean(options)
}

pub(crate) fn diffusion(options: &Options) -> Outcome<()> {
    Work::new(options, "diffusion", true)?.diffusion(options)
}

/// One folder, its model and its data.
struct Work<'a> {
    options: &'a Options,
    config: WakeModelConfig,
    source: Option<Source>,
    folder: RunFolder,
    /// Of all pairs, once they were asked for.
    latents: Option<Arc<LatentSet>>,
}

impl<'a> Work<'a> {
    /// Takes the folder; whatever is refused is refused before anything is written.
    fn new(options: &'a Options, stage: &str, with_data: bool) -> Outcome<Self> {
        let devices = options.learning_devices()?.len();
        let config = config(options)?;
        let usual = USUAL.iter().find(|(name, _)| *name == stage);
        if let Some(&(_, usual)) = usual {
            options.run(1, usual, Value::Null).validate(devices)?;
        }
        let source = with_data
            .then(|| Source::new(options, &config))
            .transpose()?;
        let identity = source.as_ref().map(Source::identity);
        let identity = identity.unwrap_or_default();
        let begin = (stage, options.resume);
        Ok(Self {
            folder: RunFolder::open(&options.out, &config, &identity, begin)?,
            options,
            config,
            source,
            latents: None,
        })
    }

    fn source(&self) -> Outcome<&Source> {
        Ok(self.source.as_ref().ok_or("this stage has no data")?)
    }

    fn words(&mut self, options: &Options) -> Outcome<()> {
        let recipe = Recipe::default().with_assignments(&PROMPT_RANGES)?;
        let identity = json!({"prompts": recipe});
        let prompts = Prompts::new(Simulated::new(recipe, options.seed)?);
        let vocabulary = Vocabulary::new(self.config.vocabulary.iter().copied());
        let steps = options.steps(4000);
        let devices = options.learning_devices()?;
        let init = |config: &WakeModelConfig, device: &Device| config.init_parser(device);
        let constants = options.run(steps, USUAL[0].1, identity);
        let run = Run::new("words", &self.config, init, constants, devices)?;
        let task = WordsTask {
            prompts: &prompts,
            vocabulary: &vocabulary,
        };
        let file = options.out.join(PARSER);
        let show = |run: &Run<PromptParser>| Ok(keep(&run.averaged(), &file)?);
        let stage = Stage {
            name: "words",
            out: &options.out,
            resume: options.resume,
            every: options.every,
            steps,
            results: &[PARSER],
        };
        stage.train(&mut self.folder, run, &task, show)
    }

    fn mean(&mut self, options: &Options) -> Outcome<()> {
        let patches = self.patches()?;
        let set = self.latents(&patches)?;
        let source = self.source()?;
        let identity = json!({"data": source.identity(), "patches": self.fingerprint(PATCHES)?});
        let steps = options.steps(6000);
        let devices = options.learning_devices()?;
        let init = |config: &WakeModelConfig, device: &Device| config.init_prior(device);
        let constants = options.run(steps, USUAL[1].1, identity);
        let run = Run::new("mean", &self.config, init, constants, devices)?;
        let task = PriorTask {
            set: &set,
            seed: options.seed,
        };
        let examples = source.first(ACROSS)?;
        let (config, out) = (self.config.clone(), &options.out);
        let show = |run: &Run<Prior>| {
            let prior = run.averaged();
            keep(&prior, &out.join(PRIOR))?;
            let means = expected_images(&prior, &patches, &config, &examples)?;
            sheet(&examples, &means, &out.join(SHEET))
        };
        let stage = Stage {
            name: "mean",
            out: &options.out,
            resume: options.resume,
            every: options.every,
            steps,
            results: &[PRIOR],
        };
        stage.train(&mut self.folder, run, &task, show)
    }

    fn diffusion(&mut self, options: &Options) -> Outcome<()> {
        if let Some(earlier) = self.earlier("words", &[PARSER])? {
            self.words(&earlier)?;
        }
        if let Some(earlier) = self.earlier("mean", &[PRIOR])? {
            self.mean(&earlier)?;
        }
        let config = self.config.clone();
        let device = options.devices()?.remove(0);
        let model = WakeModel {
            patches: self.patches()?,
            parser: part(config.init_parser(&device), options, PARSER)?,
            prior: part(config.init_prior(&device), options, PRIOR)?,
            flow: config.init_flow(&device),
        };
        let set = self.latents(&model.patches)?;
        let source = self.source()?;
        let identity = json!({
            "data": source.identity(), "patches": self.fingerprint(PATCHES)?,
            "prior": self.fingerprint(PRIOR)?,
        });
        let bar = progress::bar(set.len() as u64, "residuals");
        let set = set.residuals(&model.prior, |n| {
            bar.inc(n as u64);
        });
        bar.finish_and_clear();
        let steps = options.steps(6000);
        let devices = options.learning_devices()?;
        let init = |config: &WakeModelConfig, device: &Device| config.init_flow(device);
        let constants = options.run(steps, USUAL[2].1, identity);
        let run = Run::new("diffusion", &config, init, constants, devices)?;
        let task = FlowTask {
            set: &set,
            patches: &model.patches,
            seed: options.seed,
        };
        let examples = source.first(ACROSS)?;
        let scenes: Vec<Scene> = examples.iter().map(|pair| pair.scene.clone()).collect();
        let show = |run: &Run<Flow>| {
            let flow = run.averaged();
            keep(&flow, &options.out.join(FLOW))?;
            let model = WakeModel {
                flow,
                ..model.clone()
            };
            let drawn = WakeSampler::new(model, config.clone())?.sample_scenes(&scenes)?;
            let drawn: Vec<Vec<f32>> = drawn.into_iter().map(|image| image.grey.values).collect();
            sheet(&examples, &drawn, &options.out.join(SHEET))
        };
        let stage = Stage {
            name: "diffusion",
            out: &options.out,
            resume: options.resume,
            every: options.every,
            steps,
            results: &[FLOW, SHEET],
        };
        stage.train(&mut self.folder, run, &task, show)
    }

    /// What an earlier stage is told if its results are missing, older than its last checkpoint, or not done.
    fn earlier(&self, stage: &str, results: &[&str]) -> Outcome<Option<Options>> {
        let Some(left) = self.folder.unfinished(stage, results)? else {
            return Ok(None);
        };
        let checkpoint = Checkpoint::newest(&self.folder.checkpoints(stage))?;
        let state = checkpoint.map_or(Value::Null, |checkpoint| checkpoint.state);
        Ok(Some(self.options.before(left, &state)))
    }

    fn fingerprint(&self, name: &str) -> wake_ldm::Result<String> {
        fingerprint(&self.options.out.join(name))
    }

    /// Fits the patch transform and writes it with what it keeps.
    fn fit(&self, source: &Source) -> Outcome<Shares> {
        let (options, config) = (self.options, &self.config);
        let device = options.devices()?.remove(0);
        let count = source.len().min(FITTED);
        let bar = progress::bar(count, "images for the patch transform");
        let mut images = Vec::new();
        for first in (0..count).step_by(AT_ONCE) {
            let pairs = source.items(first..count.min(first + AT_ONCE as u64))?;
            bar.inc(pairs.len() as u64);
            let left = pairs.into_par_iter().map(|pair| beyond(pair, &config.grey));
            images.extend(left.collect::<wake_ldm::Result<Vec<_>>>()?);
        }
        bar.finish_and_clear();
        let pixels = images.iter().map(Vec::as_slice);
        let (transform, shares) =
            PatchTransform::fit(pixels, config.image_size, config.latent_channels, &device);
        let path = options.out.join(PATCHES);
        save_as(&transform, Layout::Diffusers, &path, Precision::F32)?;
        let rows: Vec<_> = (1..=64)
            .map(|c| json!({"channels": c, "variance": shares.kept(c), "psnr_db": finite(shares.psnr(c))}))
            .collect();
        output::write_json(&options.out.join("shares.json"), &rows)?;
        Ok(shares)
    }

    /// The patch transform of an earlier run, or a new one.
    fn patches(&self) -> Outcome<PatchTransform> {
        if !self.options.out.join(PATCHES).exists() {
            self.fit(self.source()?)?;
        }
        let device = self.options.devices()?.remove(0);
        let empty = PatchTransform::zeros(self.config.latent_channels, &device);
        part(empty, self.options, PATCHES)
    }

    /// Encodes all pairs and the images expected of their scenes, which then stay in memory.
    fn latents(&mut self, patches: &PatchTransform) -> Outcome<Arc<LatentSet>> {
        if let Some(latents) = &self.latents {
            return Ok(latents.clone());
        }
        let source = self.source()?;
        // Two numbers of 16 bits for each of the latents of an image.
        let each = 4 * self.config.latent_channels * self.config.latent_size().pow(2);
        let (needed, free) = (source.len().saturating_mul(each as u64), available_memory());
        if let Some(free) = free.filter(|&free| free < needed) {
            let [needed, free] = [needed, free].map(|bytes| bytes as f64 / (1u64 << 30) as f64);
            let count = source.len();
            return Err(format!(
                "{count} pairs need {needed:.1} GiB of memory, but {free:.1} GiB are free; lower --count, or take a \
                 smaller --data"
            )
            .into());
        }
        let bar = progress::bar(source.len(), "pairs");
        let mut set = LatentSet::default();
        for first in (0..source.len()).step_by(AT_ONCE) {
            let read = |pair: Pair| -> wake_ldm::Result<_> {
                let Pair { image, scene, .. } = pair;
                let foreseen = Foreseen::new(&scene, &self.config.grey, patches)?;
                Ok((image.pixels, foreseen, scene))
            };
            let pairs = source.items(first..source.len().min(first + AT_ONCE as u64))?;
            let count = pairs.len() as u64;
            let pairs = pairs.into_par_iter().map(read);
            set.extend(patches, pairs.collect::<wake_ldm::Result<_>>()?)?;
            bar.inc(count);
        }
        bar.finish_and_clear();
        let set = Arc::new(set);
        self.latents = Some(set.clone());
        Ok(set)
    }
}

/// What an image has beyond the expected one, brought to one deviation.
fn beyond(pair: Pair, scale: &GreyScale) -> wake_ldm::Result<Vec<f32>> {
    let expected = expected_grey(&pair.scene, scale)?;
    let mut left = pair.image.pixels;
    left.iter_mut()
        .zip(&expected)
        .for_each(|(grey, expected)| *grey -= expected);
    let count = left.len() as f32;
    let mean = left.iter().sum::<f32>() / count;
    let variance = left.iter().map(|grey| (grey - mean).powi(2)).sum::<f32>() / count;
    let factor = DEVIATION / variance.sqrt().max(LEAST_DEVIATION);
    left.iter_mut().for_each(|grey| *grey *= factor);
    Ok(left)
}

/// Writes a part of the model as it ships.
fn keep(part: &impl Module, path: &Path) -> wake_ldm::Result<()> {
    save_as(part, Layout::Diffusers, path, Precision::F16)
}

/// JSON has no infinity: all 64 components lose nothing.
fn finite(number: f64) -> Option<f64> {
    Some(number).filter(|number| number.is_finite())
}

/// A part of the model with the weights of an earlier stage.
fn part<M: Module>(module: M, options: &Options, name: &str) -> Outcome<M> {
    Ok(load(module, Layout::Diffusers, &options.out.join(name))?)
}

/// The widths of the model: those of --config, else those in --out, else the standard ones.
fn config(options: &Options) -> Outcome<WakeModelConfig> {
    let written = options.out.join("config.json");
    let file = match &options.config {
        Some(file) => Some(file),
        None => Some(&written).filter(|file| file.exists()),
    };
    Ok(match file {
        Some(file) => WakeModelConfig::read(file)?,
        None => trained(options, &vocabulary()?)?,
    })
}

/// The standard widths, and of the data their grey and which scenes there are.
fn trained(options: &Options, vocabulary: &Vocabulary) -> wake_ldm::Result<WakeModelConfig> {
    let mut config = WakeModelConfig::standard(vocabulary);
    let recipe = match &options.data {
        Some(path) => {
            let folder = Folder::open(path)?;
            config.domain = Domain::of(folder.scenes())?;
            folder.manifest().recipe.clone()
        }
        None => {
            let simulated = Simulated::new(options.recipe()?, options.seed)?;
            let scenes = (0..options.count).map(|index| simulated.scene(index));
            let scenes: Vec<Scene> = scenes.collect::<wake_ldm::Result<_>>()?;
            config.domain = Domain::of(&scenes)?;
            simulated.recipe().clone()
        }
    };
    (config.scene, config.grey) = (recipe.scene, recipe.grey);
    config.spacing = config.scene.grid.spacing;
    Ok(config)
}

/// What prompts about wakes can contain: the words of every wording, and every digit.
fn vocabulary() -> Result<Vocabulary, wake_text::Error> {
    let (ship, mut calm) = (Scene::default(), Scene::default());
    calm.ships.clear();
    calm.sea.wind_speed = 0.0;
    let mut ids = tokens("0 1 2 3 4 5 6 7 8 9 .");
    for scene in [ship, calm] {
        for wording in Wording::ALL {
            ids.extend(tokens(&wording.prompt(&scene)?));
        }
    }
    Ok(Vocabulary::new(ids))
}

/// The mean images of some scenes.
fn expected_images(
    prior: &Prior,
    patches: &PatchTransform,
    config: &WakeModelConfig,
    examples: &[Pair],
) -> wake_ldm::Result<Vec<Vec<f32>>> {
    let mut set = LatentSet::default();
    let mut images = Vec::new();
    for pair in examples {
        let foreseen = Foreseen::new(&pair.scene, &config.grey, patches)?;
        images.extend_from_slice(&foreseen.grey);
        let pixels = pair.image.pixels.clone();
        set.extend(patches, vec![(pixels, foreseen, pair.scene.clone())])?;
    }
    let all: Vec<usize> = (0..set.len()).collect();
    let known = set.known(
        &all,
        &patches.devices().into_iter().next().unwrap_or_default(),
    );
    let expected = prior.forward(&known);
    let size = config.image_size;
    let grey = TensorData::new(images, [set.len(), 1, size, size]);
    let grey: Tensor<4> = Tensor::from_data(grey, &known.wake.device());
    let added = patches.decode(expected.mean - known.wake, expected.grey);
    let pixels: Vec<f32> = (grey + added)
        .clamp(0.0, 1.0)
        .into_data()
        .iter::<f32>()
        .collect();
    Ok(pixels.chunks(size * size).map(<[f32]>::to_vec).collect())
}
