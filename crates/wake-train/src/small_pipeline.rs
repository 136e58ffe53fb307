//! Training of a small latent diffusion model from scratch, in a run folder: the autoencoder in closed form, the text encoder
//! alone, then text encoder and U-Net together.

use std::path::Path;

use burn::tensor::Device;
use serde_json::{Value, json};

use super::folder::RunFolder;
use super::pairs::TrainingPairs;
use super::progress::{Progress, counted};
use super::prompt_reading::{PromptReader, ReadingTask, standardised};
use super::run::Run;
use super::sheet::write_sheet;
use super::stage::Stage;
use super::stage_options::{StageDefaults, StageOptions};
use super::text_to_image::{
    PREDICTION, PromptedImages, PromptedLatents, TextToImage, TextToImageTask,
};
use crate::error::{Error, Result};
use wake_dataset::Pair;
use wake_ldm::autoencoder::{AutoencoderKl, AutoencoderKlConfig};
use wake_ldm::pipeline::{Pipeline, PipelineParts, Request};
use wake_ldm::scheduler::{NoiseSchedule, SchedulerConfig, SchedulerOption, Spacing};
use wake_ldm::text::ClipTextConfig;
use wake_ldm::unet::UNetConfig;
use wake_nn::weights::{Layout, Precision, load, save_as, save_folder};
use whole_files::fingerprint;

/// Names and defaults of the stages.
const READER: &str = "text-encoder";
const MODEL: &str = "text-to-image";
const DEFAULTS: StageDefaults = StageDefaults {
    steps: 5000,
    batch: 16,
    rate: 5e-4,
};
const READER_DEFAULTS: StageDefaults = StageDefaults {
    steps: 2500,
    ..DEFAULTS
};
/// Files written by the stages.
const READER_FILE: &str = "text-encoder.safetensors";
const VAE: &str = "vae/diffusion_pytorch_model.safetensors";
const VAE_CONFIG: &str = "vae/config.json";
const SHEET: &str = "sheet.png";
/// Names and shapes of the weights in files.
const LAYOUT: Layout = Layout::Diffusers;
/// Images read or simulated at the same time.
const AT_ONCE: u64 = 64;
/// Images of a sheet, and their sampling steps.
const SHOWN: u64 = 8;
const DRAWN: usize = 25;
/// Largest downsampling: the autoencoder is fitted in seconds.
const MOST_PIXELS: f64 = 16.0;
/// Channels of a token embedding.
const TOKENS: usize = 128;

/// Training of a small latent diffusion model on images and prompts alone.
#[derive(Debug, Clone)]
pub struct PipelineTraining<'a> {
    /// Training pairs.
    pub pairs: &'a TrainingPairs,
    /// Steps of the text encoder alone; `None`: the default.
    pub text_steps: Option<usize>,
    /// Shape of the latents.
    pub latents: LatentShape,
    /// Steps of text encoder and U-Net after which to stop, to be resumed later; `None`: all.
    pub stop_after: Option<usize>,
    /// Options of the stages; `steps` counts the steps of text encoder and U-Net.
    pub options: StageOptions,
}

/// Shape of the latents of a small pipeline.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LatentShape {
    /// Channels, at most `downsampling²`.
    pub channels: usize,
    /// Rows and columns of pixels per latent pixel, 1 to 16.
    pub downsampling: usize,
}

impl Default for LatentShape {
    /// 32 channels, 16 pixels.
    fn default() -> Self {
        Self {
            channels: 32,
            downsampling: 16,
        }
    }
}

impl LatentShape {
    fn autoencoder(self) -> AutoencoderKlConfig {
        AutoencoderKlConfig::linear(self.channels, self.downsampling)
    }

    fn unet(self) -> UNetConfig {
        UNetConfig::small(self.channels, Some(TOKENS), None)
    }
}

impl PipelineTraining<'_> {
    /// Checks the options, and that the models can take the size of the images.
    ///
    /// # Errors
    ///
    /// As [`RunOptions::validate`](super::RunOptions::validate); [`wake_nn::Error::OutOfRange`] for a shape of the latents outside
    /// its range; [`wake_nn::Error::InvalidOption`] for an empty set, or for images that are not square or whose side is not a
    /// multiple of the models' downsampling.
    pub fn check(&self) -> Result<()> {
        let constants = self.options.run(&DEFAULTS, Value::Null);
        constants.validate(self.options.devices.len())?;
        let LatentShape {
            channels,
            downsampling,
        } = self.latents;
        let (range, most) = (wake_nn::check_range, (downsampling * downsampling) as f64);
        range("downsampling", downsampling as f64, 1.0, MOST_PIXELS).map_err(Error::Value)?;
        range("latents", channels as f64, 1.0, most).map_err(Error::Value)?;
        let [rows, columns] = self.pairs.source().size();
        let multiple = 4 * downsampling;
        if rows == columns && rows.is_multiple_of(multiple) && !self.pairs.is_empty() {
            return Ok(());
        }
        Err(Error::Value(wake_nn::Error::InvalidOption {
            option: "image size".to_owned(),
            value: format!("{rows} x {columns} pixels in {} images", self.pairs.len()),
            expected: format!(
                "at least one image with equal sides, a multiple of {multiple}; set grid.rows and grid.columns of the data set"
            ),
        }))
    }

    /// Memory of images and latents \[bytes\].
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let pixels: usize = self.pairs.source().size().iter().product();
        let down = self.latents.downsampling.max(1);
        // Two bytes per pixel and latent.
        let each = 2 * pixels + 2 * self.latents.channels * pixels / (down * down);
        self.pairs.len().saturating_mul(each as u64)
    }

    /// Fits the autoencoder and runs both stages; a killed run can be resumed from its last checkpoints.
    ///
    /// Writes the files that [`Pipeline::load`] reads, `sheet.png`, logs, `config.json`, `run.json` and `checkpoints/`.
    ///
    /// # Errors
    ///
    /// As [`check`](Self::check); [`wake_nn::Error::InvalidOption`] for a folder of another run.
    pub fn train(&self, out: &Path, progress: &(dyn Fn(Progress) + Sync)) -> Result<()> {
        self.check()?;
        let options = &self.options;
        let examples = self.pairs.first(SHOWN)?;
        let model = json!({
            "vae": self.latents.autoencoder().to_json(), "text_encoder": text().to_json(),
            "unet": self.latents.unet().to_json(),
        });
        let identity = self.pairs.identity();
        let learning = options.learning_devices()?;
        let begin = (READER, options.resume);
        let mut folder = RunFolder::open(out, &model, &identity, begin)?;
        let images = counted("pairs", self.pairs.len(), progress, |done| {
            self.images(done)
        })?;
        let (device, count) = (options.device(), images.len() as u64);
        // The configuration is written last.
        if !out.join(VAE_CONFIG).exists() {
            let config = self.latents.autoencoder();
            let autoencoder = counted("autoencoder", 2 * count, progress, |done| {
                images.fit(&config, &device, |n| done(n as u64))
            });
            let (vae, precision) = (out.join("vae"), Precision::F16);
            save_folder(&autoencoder, LAYOUT, &config.to_json(), &vae, precision)?;
        }

        let reader = out.join(READER_FILE);
        if folder.unfinished(READER, &[READER_FILE])?.is_some() {
            self.reader(&mut folder, &images, learning.clone(), &reader, progress)?;
        }

        // Without a signal in the last step, brightness and wake come from the prompt alone (Lin et al., 2024).
        let scheduler = SchedulerConfig::stable_diffusion("ddim")?
            .with(SchedulerOption::Prediction(PREDICTION))?
            .with(SchedulerOption::ZeroTerminalSnr(true))?
            .with(SchedulerOption::Spacing(Spacing::Trailing))?;
        let vae = fingerprint(&out.join(VAE))?;
        let identity = json!({
            "data": identity, "vae": vae, "text_encoder": fingerprint(&reader)?, "scheduler": scheduler.to_json(),
        });
        let autoencoder = AutoencoderKl::from_folder(&out.join("vae"), &device)?;
        let set = counted("latents", count, progress, |done| {
            images.encode(&autoencoder, &device, |n| done(n as u64))
        });
        let text_encoder =
            load(PromptReader::new(&text(), &learning[0]), LAYOUT, &reader)?.text_encoder;
        let init = |device: &Device| TextToImage {
            text_encoder,
            unet: self.latents.unet().init(device),
        };
        let constants = options.run(&DEFAULTS, identity);
        let steps = options.steps(&DEFAULTS);
        let blind = TextToImageTask::blind_of((steps * constants.batch) as u64);
        let run = Run::of(MODEL, &model, init, constants, learning)?;
        let task = TextToImageTask {
            set: &set,
            schedule: schedule(&scheduler)?,
            blind,
            seed: options.seed,
        };
        let show = |run: &Run<TextToImage>| -> Result<()> {
            let parts = parts(run.averaged(), &autoencoder, &scheduler, &set);
            let pipeline = Pipeline::new(parts, &device)?;
            let drawn = draw(&pipeline, &examples, options.seed)?;
            write_sheet(&examples, &drawn, &out.join(SHEET))?;
            Ok(pipeline.save(out, Precision::F16)?)
        };
        let results = ["model_index.json", SHEET];
        let steps = self.stop_after.map_or(steps, |last| last.min(steps));
        let stage = self.stage(MODEL, steps, &results, &folder);
        stage.train(&mut folder, run, &task, progress, show)
    }

    /// Trains the text encoder to state the values of prompts.
    fn reader(
        &self,
        folder: &mut RunFolder,
        images: &PromptedImages,
        learning: Vec<Device>,
        file: &Path,
        progress: &dyn Fn(Progress),
    ) -> Result<()> {
        let options = StageOptions {
            steps: self.text_steps,
            ..self.options.clone()
        };
        let constants = options.run(&READER_DEFAULTS, self.pairs.identity());
        let init = |device: &Device| PromptReader::new(&text(), device);
        let run = Run::of(READER, &text().to_json(), init, constants, learning)?;
        let task = ReadingTask {
            prompts: images.prompts(),
            statements: &standardised(images.statements()),
            seed: options.seed,
        };
        let show = |run: &Run<PromptReader>| -> Result<()> {
            Ok(save_as(&run.averaged(), LAYOUT, file, Precision::F16)?)
        };
        let steps = options.steps(&READER_DEFAULTS);
        let stage = self.stage(READER, steps, &[READER_FILE], folder);
        stage.train(folder, run, &task, progress, show)
    }

    /// Stage that resumes from its last checkpoint if that is requested and there is one.
    fn stage<'a>(
        &self,
        name: &'static str,
        steps: usize,
        results: &'a [&'a str],
        folder: &RunFolder,
    ) -> Stage<'a> {
        Stage {
            name,
            resume: self.options.resume && folder.checkpoints(name).is_dir(),
            every: self.options.every,
            keep: self.options.keep,
            steps,
            results,
        }
    }

    /// Reads all images and prompts.
    fn images(&self, done: &dyn Fn(u64)) -> Result<PromptedImages> {
        let (mut images, count) = (PromptedImages::default(), self.pairs.len());
        for first in (0..count).step_by(AT_ONCE as usize) {
            for pair in self.pairs.items(first..count.min(first + AT_ONCE))? {
                images.push(&pair)?;
                done(1);
            }
        }
        Ok(images)
    }
}

fn text() -> ClipTextConfig {
    ClipTextConfig::new()
        .with_hidden_size(TOKENS)
        .with_intermediate_size(4 * TOKENS)
        .with_layers(4)
        .with_heads(4)
        .with_end_token(49407)
}

fn schedule(scheduler: &SchedulerConfig) -> Result<&NoiseSchedule> {
    scheduler.noise_schedule().ok_or_else(|| {
        Error::Value(wake_nn::Error::Unsupported {
            option: "scheduler".to_owned(),
            value: scheduler.class().to_owned(),
            supported: "schedulers with a noise schedule, such as DDIMScheduler".to_owned(),
        })
    })
}

/// Parts of the pipeline with the current weights.
fn parts(
    learnt: TextToImage,
    autoencoder: &AutoencoderKl,
    scheduler: &SchedulerConfig,
    set: &PromptedLatents,
) -> PipelineParts {
    PipelineParts {
        tokenizer: None,
        text_encoder: learnt.text_encoder,
        unet: learnt.unet,
        autoencoder: autoencoder.clone(),
        scheduler: scheduler.clone(),
        latent_size: set.shape()[1],
    }
}

/// Images that the model generates from the prompts of some pairs, grey 0…1 of all channels.
fn draw(pipeline: &Pipeline, examples: &[Pair], seed: u64) -> Result<Vec<Vec<f32>>> {
    let prompts: Vec<String> = examples.iter().map(|pair| pair.prompt.clone()).collect();
    let request = Request::new(prompts)
        .with_images_at_once(examples.len())
        .with_guidance(1.0)
        .with_steps(DRAWN)
        .with_seed(seed);
    let images = pipeline.generate(&request)?;
    let pixels: Vec<f32> = images.into_data().iter::<f32>().collect();
    let each = (pixels.len() / examples.len().max(1)).max(1);
    Ok(pixels.chunks(each).map(<[f32]>::to_vec).collect())
}
