//! How like simulated images those of the model are over all scenes of a recipe, before speckle and with it.

use std::path::PathBuf;

use burn::tensor::Device;
use clap::Args;
use rayon::prelude::*;
use serde::Serialize;
use wake_ldm::dataset::{Recipe, Simulated};
use wake_ldm::train::TwoSample;
use wake_ldm::{WakeSampler, device_named};
use wake_physics::picture::Picture;
use wake_physics::{Field, Scene, output, unit_speckle};

use crate::judge::BATCH;
use crate::pixels::grey;
use crate::rungs::told_apart;
use crate::scenes::other_sea;
use crate::source::{Expected, Gaussian, ImageSource, OtherSea, Result, Simulator, Told};
use crate::{exit, progress};

/// Seed of the scenes: no training set has it.
const SEED: u64 = 1 << 40;
/// Scenes that are shown, each simulated and drawn by the model.
const PICTURED: usize = 6;
/// Grey of the sheet beyond the median of each scene to both sides.
const REACH: f32 = 0.2;

#[derive(Args)]
pub(crate) struct Options {
    /// paper, ranges, detector or model, or a recipe file: the scenes
    #[arg(long, default_value = "detector")]
    recipe: String,
    /// Folder of a small model that `train` wrote; without it, the model in the crate
    #[arg(long, value_name = "DIR")]
    weights: Option<PathBuf>,
    /// Steps from noise to image; without it, the sampler's own number
    #[arg(long)]
    steps: Option<usize>,
    /// Scenes
    #[arg(long, default_value_t = 200, value_parser = clap::value_parser!(u32).range(4..=65536))]
    count: u32,
    /// flex, ndarray, wgpu or cuda, where compiled in
    #[arg(long, default_value = "flex")]
    device: String,
    /// Folder of the results, made if absent
    #[arg(long, value_name = "DIR", default_value = "out/evaluate_domain")]
    out: PathBuf,
    /// Print the report as JSON on standard output, and nothing else
    #[arg(long)]
    json: bool,
}

/// Everything that `domain.json` holds.
#[derive(Debug, Serialize)]
struct Report {
    recipe: String,
    scenes: usize,
    rows: Vec<Row>,
}

/// One kind of image against simulated ones of the same scenes.
#[derive(Debug, Serialize)]
struct Row {
    image: &'static str,
    before_speckle: Option<TwoSample>,
    with_speckle: Option<TwoSample>,
    /// Of one image on all cores.
    seconds: f64,
}

/// The model told the whole scene.
struct OfScenes(WakeSampler);

impl ImageSource for OfScenes {
    fn draw(&self, scenes: &[Scene], _: Told) -> Result<Vec<Field>> {
        let images = self.0.sample_scenes(scenes)?;
        Ok(images.into_iter().map(|image| image.intensity).collect())
    }
}

/// Scenes one after the other, each on all cores.
fn drawn(source: &dyn ImageSource, scenes: &[Scene], step: impl Fn(u64)) -> Result<Vec<Field>> {
    let mut images = Vec::with_capacity(scenes.len());
    for batch in scenes.chunks(BATCH) {
        images.extend(source.draw(batch, Told::Numbers)?);
        step(batch.len() as u64);
    }
    Ok(images)
}

/// Grey of images with the speckle of their scenes.
fn speckled(scenes: &[Scene], images: &[Field]) -> Result<Vec<Field>> {
    let pairs: Vec<_> = scenes.iter().zip(images).collect();
    let with_speckle = |(scene, image): &(&Scene, &Field)| {
        let mut speckle = unit_speckle(scene)?;
        let values = speckle.values.iter_mut().zip(&image.values);
        values.for_each(|(speckle, value)| *speckle *= value);
        Ok(grey(&speckle))
    };
    pairs
        .par_iter()
        .map(with_speckle)
        .collect::<wake_physics::Result<_>>()
        .map_err(Into::into)
}

pub(crate) fn run(options: &Options) -> Result<()> {
    let device: Device = device_named(&options.device)?;
    let sampler = match &options.weights {
        Some(folder) => WakeSampler::from_folder(folder, &device)?,
        None => WakeSampler::pretrained(&device)?,
    };
    let sampler = match options.steps {
        Some(steps) => sampler.with_steps(steps)?,
        None => sampler,
    };
    let recipe = Recipe::named_or_read(&options.recipe)?;
    let set = Simulated::new(recipe, SEED)?;
    let scenes = (0..u64::from(options.count)).map(|index| set.scene(index));
    let scenes: Vec<Scene> = scenes.collect::<wake_ldm::Result<_>>()?;
    scenes
        .iter()
        .try_for_each(|scene| sampler.check_scene(scene))?;
    output::make_folder(&options.out)?;
    let model = OfScenes(sampler);
    let kinds: [(&str, &dyn ImageSource); 5] = [
        ("expected image", &Expected),
        ("expected image, Gaussian sea", &Gaussian),
        ("model", &model),
        ("simulator, other sea", &OtherSea),
        ("simulator", &Simulator),
    ];
    let bar = progress::bar((kinds.len() * scenes.len()) as u64, "images");
    // A third sea, so that none is that of another kind.
    let third: Vec<Scene> = scenes.iter().map(|scene| other_sea(scene, 2)).collect();
    let simulated = drawn(&Simulator, &third, |n| bar.inc(n))?;
    let against = [
        simulated.iter().map(grey).collect(),
        speckled(&third, &simulated)?,
    ];
    let mut rows = Vec::new();
    let mut of_model = Vec::new();
    for (image, source) in &kinds[..kinds.len() - 1] {
        let start = std::time::Instant::now();
        let images = drawn(*source, &scenes, |n| bar.inc(n))?;
        let seconds = start.elapsed().as_secs_f64() / scenes.len() as f64;
        let with_speckle = speckled(&scenes, &images)?;
        let plain: Vec<Field> = images.iter().map(grey).collect();
        rows.push(Row {
            image,
            before_speckle: told_apart(&against[0], &plain, &device)?,
            with_speckle: told_apart(&against[1], &with_speckle, &device)?,
            seconds,
        });
        if *image == "model" {
            of_model = plain.into_iter().zip(with_speckle).take(PICTURED).collect();
        }
    }
    bar.finish_and_clear();
    let report = Report {
        recipe: options.recipe.clone(),
        scenes: scenes.len(),
        rows,
    };
    let text = markdown(&report);
    output::write_json(&options.out.join("domain.json"), &report)?;
    output::write_atomically(&options.out.join("domain.md"), text.as_bytes())?;
    let [plain, with_speckle] = &against;
    let simulated: Vec<_> = plain
        .iter()
        .cloned()
        .zip(with_speckle.iter().cloned())
        .take(PICTURED)
        .collect();
    sheet(&simulated, &of_model).write(&options.out.join("domain.png"))?;
    match options.json {
        true => exit::say(&serde_json::to_string_pretty(&report)?)?,
        false => exit::say(&format!("{text}\nwritten to {}", options.out.display()))?,
    }
    Ok(())
}

/// Two rows a kind: before speckle and with it; the simulator's above the model's.
fn sheet(simulated: &[(Field, Field)], model: &[(Field, Field)]) -> Picture {
    let mut panels = Vec::new();
    for (name, kind) in [("simulator", simulated), ("model", model)] {
        for with_speckle in [false, true] {
            panels.extend(kind.iter().map(|(plain, speckled)| {
                let image = if with_speckle { speckled } else { plain };
                let mut sorted = image.values.clone();
                let middle = sorted.len() / 2;
                let median = *sorted.select_nth_unstable_by(middle, f32::total_cmp).1;
                let level = |v: &f32| (127.5 * (1.0 + (v - median) / REACH)).round() as u8;
                let levels: Vec<u8> = image.values.iter().map(level).collect();
                Picture::from_levels(&levels, image.columns).captioned(name)
            }));
        }
    }
    Picture::sheet(&panels, PICTURED)
}

fn markdown(report: &Report) -> String {
    let told = |t: &Option<TwoSample>| {
        t.as_ref().map_or("–".to_owned(), |t| {
            format!("{:.3} ± {:.3}", t.accuracy, t.half_width)
        })
    };
    let mut text = format!(
        "{} scenes of the recipe `{}`.\n\n| image | told apart, before speckle | with speckle | seconds an image |\n|---|---|---|---|\n",
        report.scenes, report.recipe
    );
    for row in &report.rows {
        let [plain, speckled] = [&row.before_speckle, &row.with_speckle].map(told);
        text += &format!(
            "| {} | {plain} | {speckled} | {:.3} |\n",
            row.image, row.seconds
        );
    }
    text
}
