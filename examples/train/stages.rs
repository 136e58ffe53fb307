//! The stages of training: patches, words, mean, diffusion.

use std::error::Error;
use std::path::Path;
use std::sync::Arc;

use burn::module::Module;
use burn::tensor::{Device, Tensor, TensorData};
use serde_json::{Value, json};
use wake_ldm::conditioning::Vocabulary;
use wake_ldm::dataset::{Folder, Pair, Prompts, Recipe, Simulated};
use wake_ldm::network::{
    Domain, Flow, Foreseen, PatchTransform, Prior, PromptParser, Shares, WakeModel, WakeModelConfig,
};
use wake_ldm::train::{
    Checkpoint, FlowTask, LatentSet, PriorTask, Run, RunFolder, Stage, WordsTask, fit_patches,
};
use wake_ldm::weights::{Layout, Precision, load, save_as};
use wake_ldm::{WakeSampler, fingerprint};
use wake_physics::{Scene, available_memory, output};

use super::exit;
use super::options::Options;
use super::progress;
use super::sheet::sheet;
use super::source::Source;
use super::stage::train;

pub(crate) type Outcome<T> = Result<T, Box<dyn Error>>;

/// Images that the patch transform is fitted to.
const FITTED: u64 = 400;
/// Images in a row of a sheet.
const ACROSS: u64 = 8;
/// Examples of a batch and the largest step of the optimizer by default.
const USUAL: [(&str, (u16, f64)); 3] = [
    ("words", (128, 1e-3)),
    ("mean", (32, 2e-3)),
    ("diffusion", (8, 1e-3)),
];
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
            every: options.every as usize,
            steps,
            results: &[PARSER],
        };
        train(stage, &mut self.folder, run, &task, show)
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
            every: options.every as usize,
            steps,
            results: &[PRIOR],
        };
        train(stage, &mut self.folder, run, &task, show)
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
            every: options.every as usize,
            steps,
            results: &[FLOW, SHEET],
        };
        train(stage, &mut self.folder, run, &task, show)
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
        let fitted = fit_patches(source.pairs(), count, config, &device, |n| bar.inc(n));
        bar.finish_and_clear();
        let (transform, shares) = fitted?;
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
        let needed = LatentSet::bytes(&self.config, source.len());
        let free = available_memory();
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
        let (count, config) = (source.len(), &self.config);
        let set = LatentSet::of(source.pairs(), count, config, patches, |n| bar.inc(n));
        bar.finish_and_clear();
        let set = Arc::new(set?);
        self.latents = Some(set.clone());
        Ok(set)
    }
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
        None => trained(options, &Vocabulary::of_wordings()?)?,
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
