//! The sea of real images is learnt, without labels.

use std::error::Error;
use std::path::PathBuf;

use clap::Args;
use serde_json::{Map, Value, json};
use wake_ldm::sea_texture::{SeaFlow, SeaTexture};
use wake_ldm::train::{
    Rate, Run, RunFolder, RunOptions, SeaPatches, SeaTask, Stage, TrainerOptions,
};
use wake_ldm::{device_named, fingerprint};
use wake_physics::picture::Picture;

use super::options::learning;
use super::sea_images::{Half, SeaFile, list};
use super::stage::train;
use super::{exit, progress};

type Outcome<T> = Result<T, Box<dyn Error>>;

/// Name of the stage, its checkpoints and its log.
const STAGE: &str = "sea";
/// Names of what it writes.
const WEIGHTS: &str = "sea.safetensors";
const SHEET: &str = "sea.png";
/// Patches in all that are held in memory, unless there are more images.
const PATCHES: usize = 2048;
/// Seas on a sheet, their rows and columns, and how many stand in a row.
const SHOWN: u64 = 8;
const SIDE: usize = 256;
const ACROSS: usize = 4;

#[derive(Args)]
pub(crate) struct Options {
    /// Folder of radar images of 8 or 16 bits, grey by amplitude; what `NAME_mask.png` marks is left out
    #[arg(long, value_name = "DIR")]
    images: PathBuf,
    /// Side of their pixels [m], where it is known: then scenes of other pixels are refused
    #[arg(long, value_name = "METRES")]
    spacing: Option<f64>,
    /// Learn from one half of every image alone, so that the other can judge
    #[arg(long, value_enum)]
    half: Option<Half>,
    /// Steps
    #[arg(long, default_value_t = 1200, value_parser = clap::value_parser!(u32).range(1..))]
    steps: u32,
    /// Patches of a batch
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u16).range(1..))]
    batch: u16,
    /// Largest step of the optimizer
    #[arg(long, default_value_t = 1e-3)]
    rate: f64,
    /// Steps between checkpoints and sheets
    #[arg(long, default_value_t = 200, value_parser = clap::value_parser!(u32).range(1..))]
    every: u32,
    /// Seed of everything that is drawn
    #[arg(long, default_value_t = 7)]
    seed: u64,
    /// Go on from the newest checkpoint in --out
    #[arg(long)]
    resume: bool,
    /// flex, ndarray, wgpu or cuda, where compiled in; a comma between several
    #[arg(long, default_value = "flex")]
    device: String,
    /// Folder of the results, made if absent
    #[arg(long, value_name = "DIR", default_value = "out/sea")]
    out: PathBuf,
}

impl Options {
    fn run(&self, identity: Value) -> RunOptions {
        RunOptions {
            batch: usize::from(self.batch),
            seed: self.seed,
            identity,
            trainer: TrainerOptions {
                rate: Rate {
                    peak: self.rate,
                    warmup: 50,
                    steps: self.steps as usize,
                },
                average_decay: 0.995,
                ..TrainerOptions::default()
            },
        }
    }
}

pub(crate) fn run(options: &Options) -> Outcome<()> {
    let devices = options.device.split(',').map(device_named);
    let devices = devices.collect::<wake_ldm::Result<Vec<_>>>()?;
    options.run(Value::Null).validate(devices.len())?;
    let files = list(&options.images)?;
    let identity = identity(options, &files)?;
    let patches = patches(options, &files)?;
    let styles = patches.styles();
    // What cannot become a sea is refused before the first step.
    SeaTexture::new(SeaFlow::new(&devices[0]), &styles, options.spacing)?;
    let begin = (STAGE, options.resume);
    let mut folder = RunFolder::open(&options.out, &SeaFlow::shape(), &identity, begin)?;
    let learning = devices
        .iter()
        .map(|device| learning(device.clone(), false, false));
    let learning = learning.collect::<Outcome<Vec<_>>>()?;
    let constants = options.run(identity);
    let run = Run::of(STAGE, &SeaFlow::shape(), SeaFlow::new, constants, learning)?;
    let task = SeaTask {
        patches: &patches,
        seed: options.seed,
    };
    let show = |run: &Run<SeaFlow>| {
        let texture = SeaTexture::new(run.averaged(), &styles, options.spacing)?;
        texture.save(&options.out.join(WEIGHTS))?;
        sheet(&texture, options)
    };
    let stage = Stage {
        name: STAGE,
        out: &options.out,
        resume: options.resume,
        every: options.every as usize,
        steps: options.steps as usize,
        results: &[WEIGHTS, SHEET],
    };
    train(stage, &mut folder, run, &task, show)
}

fn name(file: &SeaFile) -> String {
    let name = file.path.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

/// What is learnt from: the content of all files.
fn identity(options: &Options, files: &[SeaFile]) -> Outcome<Value> {
    let mut images = Map::new();
    for file in files {
        let mask = file
            .mask
            .as_ref()
            .map(|mask| fingerprint(mask))
            .transpose()?;
        images.insert(name(file), json!([fingerprint(&file.path)?, mask]));
    }
    let half = options.half.map(|half| format!("{half:?}"));
    Ok(json!({"images": images, "half": half, "spacing": options.spacing, "seed": options.seed}))
}

/// Patches of all images; one image lies in memory at a time.
fn patches(options: &Options, files: &[SeaFile]) -> Outcome<SeaPatches> {
    let each = PATCHES.div_ceil(files.len());
    let bar = progress::bar(files.len() as u64, "images");
    let (mut patches, mut without) = (SeaPatches::default(), Vec::new());
    for file in files {
        if patches.push(&file.read(options.half)?, each, options.seed) == 0 {
            without.push(name(file));
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    if patches.is_empty() {
        return Err(format!(
            "--images {}: no patch of 128 x 128 pixels of open sea; give larger images, or masks that leave more",
            options.images.display()
        )
        .into());
    }
    if let Some(first) = without.first() {
        let count = without.len();
        exit::note(&format!(
            "note: no open sea in {count} of {} images, such as {first}",
            files.len()
        ));
    }
    Ok(patches)
}

/// Seas of the first seeds, as quick-looks show them.
fn sheet(texture: &SeaTexture, options: &Options) -> Outcome<()> {
    let picture = |seed: u64| -> wake_ldm::Result<Picture> {
        let sea = texture.sample(seed, SIDE, SIDE)?;
        let level = |&i: &f32| (80.0 * i.sqrt()).round().clamp(0.0, 255.0) as u8;
        let levels: Vec<u8> = sea.values.iter().map(level).collect();
        Ok(Picture::from_levels(&levels, SIDE).captioned(&format!("seed {seed}")))
    };
    let pictures = (0..SHOWN).map(picture);
    let pictures = pictures.collect::<wake_ldm::Result<Vec<_>>>()?;
    Ok(Picture::sheet(&pictures, ACROSS).write(&options.out.join(SHEET))?)
}
