//! The order of the figures: what is drawn, and what is counted on it.

use crate::measurements::{MeasurementRow, Reading, raster, rows};
use crate::pixels::{PixelRow, Tally, blur, constant, grey};
use crate::rungs::{RungRow, bar_steps, rungs};
use crate::scenes::{held_out, other_sea, ship};
use crate::source::{Gaussian, ImageSource, Result, Simulator, Told};
use crate::statistics::quantile;
use crate::swaps::{SwapRow, swaps};
use crate::timing::{TimingRow, timings};
use crate::wake::{WakeCorrelation, wake_correlation};
use burn::tensor::Device;
use indicatif::ProgressBar;
use serde::Serialize;
use wake_ldm::metrics::Lpips;
use wake_physics::measure::open_sea;
use wake_physics::sar::speckle::speckle;
use wake_physics::{Field, Scene};

/// Images drawn at once.
pub(crate) const BATCH: usize = 8;

/// What is judged.
pub(crate) struct Judged<'a> {
    pub(crate) source: &'a dyn ImageSource,
    pub(crate) name: &'static str,
    /// Whether it is a model, not the simulator in its place.
    pub(crate) has_network: bool,
    /// A model of images and prompts alone, beside it.
    pub(crate) text_to_image: Option<&'a dyn ImageSource>,
    /// What it can be told besides sentence and numbers together; none for the simulator.
    pub(crate) conditions: Vec<Told>,
}

/// How much is drawn.
pub(crate) struct Plan {
    scenes: usize,
    wake_scenes: usize,
    condition_scenes: usize,
    pairs: usize,
}

impl Plan {
    /// Everything else in proportion to the number of scenes.
    pub(crate) fn of(count: usize) -> Self {
        Self {
            scenes: count,
            wake_scenes: count.div_ceil(12),
            condition_scenes: count.div_ceil(4),
            pairs: count.div_ceil(5),
        }
    }

    /// Steps of the progress bar.
    pub(crate) fn steps(&self, judged: &Judged<'_>) -> usize {
        let conditions = self.condition_scenes * judged.conditions.len();
        self.scenes + 8 * self.wake_scenes + conditions + 5 * self.pairs + 10 + bar_steps(judged)
    }
}

/// Everything that `report.json` holds.
#[derive(Debug, Serialize)]
pub(crate) struct Report {
    /// What stands in the place of the model.
    pub(crate) judged: &'static str,
    pub(crate) scenes: usize,
    pub(crate) pixels: Vec<PixelRow>,
    pub(crate) rungs: Vec<RungRow>,
    pub(crate) speckle: Speckle,
    pub(crate) wake_correlation: WakeCorrelation,
    pub(crate) measurements: Vec<MeasurementRow>,
    pub(crate) conditions: Vec<ConditionRow>,
    pub(crate) swaps: Vec<SwapRow>,
    pub(crate) seconds: Vec<TimingRow>,
    pub(crate) paper: Paper,
}

/// Speckle after it is applied: the open sea's equivalent number of looks, median over the scenes.
#[derive(Debug, Serialize)]
pub(crate) struct Speckle {
    pub(crate) looks: u32,
    pub(crate) simulator: Option<f64>,
    pub(crate) model: Option<f64>,
}

/// The measurements under one condition.
#[derive(Debug, Serialize)]
pub(crate) struct ConditionRow {
    pub(crate) told: &'static str,
    pub(crate) measurements: Vec<MeasurementRow>,
}

/// What the paper reports of its model.
#[derive(Debug, Serialize)]
pub(crate) struct Paper {
    pub(crate) ssim: f64,
    pub(crate) psnr_db: f64,
    pub(crate) lpips: f64,
    /// Times faster than its simulator, at most.
    pub(crate) speed_up: f64,
}

const PAPER: Paper = Paper {
    ssim: 0.17,
    psnr_db: 12.57,
    lpips: 0.57,
    speed_up: 11.0,
};

/// Sums over the scenes.
#[derive(Default)]
struct Sums {
    tallies: [Tally; 6],
    simulated: Vec<Reading>,
    generated: Vec<Reading>,
    gaussian: Vec<Reading>,
    looks: [Vec<f64>; 2],
}

/// Draws and judges everything.
pub(crate) fn judge(
    plan: &Plan,
    judged: &Judged<'_>,
    lpips: Option<&Lpips>,
    device: &Device,
    bar: &ProgressBar,
) -> Result<Report> {
    let scenes: Vec<Scene> = (0..plan.scenes as u64).map(held_out).collect();
    bar.set_message("pixels and values");
    let mut sums = Sums::default();
    for batch in scenes.chunks(BATCH) {
        sums.add(batch, judged, lpips)?;
        bar.inc(batch.len() as u64);
    }
    bar.set_message("rungs");
    let rungs = rungs(&scenes, judged, device, || bar.inc(1))?;
    bar.set_message("wake correlation");
    let model = Some(judged.source);
    let wake = wake_correlation(&scenes[..plan.wake_scenes], model, || bar.inc(8))?;
    bar.set_message("conditions");
    let conditions = conditions(&scenes[..plan.condition_scenes], judged, &sums, bar)?;
    bar.set_message("swaps");
    let told: Vec<Told> = [Told::Both]
        .into_iter()
        .chain(judged.conditions.clone())
        .collect();
    let swaps = swaps(plan.pairs, model, &told, || bar.inc(1))?;
    bar.set_message("seconds");
    let seconds = timings(model, judged.text_to_image)?;
    let [simulator, model_looks] = sums.looks.each_ref().map(|looks| quantile(looks, 0.5));
    let [second, model_row, gaussian, constant, blurred, latent] = &sums.tallies;
    let latent = judged.text_to_image.map(|_| latent.row("text to image"));
    Ok(Report {
        judged: judged.name,
        scenes: scenes.len(),
        pixels: [
            model_row.row("model"),
            second.row("simulator, other sea"),
            gaussian.row("expected image, Gaussian sea"),
            constant.row("constant"),
            blurred.row("blurred simulator"),
        ]
        .into_iter()
        .chain(latent)
        .collect(),
        rungs,
        speckle: Speckle {
            looks: scenes[0].radar.looks,
            simulator,
            model: model_looks,
        },
        wake_correlation: wake,
        measurements: rows(
            &scenes,
            &sums.simulated,
            Some(&sums.generated),
            Some(&sums.gaussian),
        ),
        conditions,
        swaps,
        seconds,
        paper: PAPER,
    })
}

impl Sums {
    fn add(&mut self, scenes: &[Scene], judged: &Judged<'_>, lpips: Option<&Lpips>) -> Result<()> {
        let references = Simulator.draw(scenes, Told::Both)?;
        let others: Vec<Scene> = scenes.iter().map(|scene| other_sea(scene, 1)).collect();
        let seconds = Simulator.draw(&others, Told::Both)?;
        let generated = judged.source.draw(scenes, Told::Both)?;
        let linear = Gaussian.draw(scenes, Told::Both)?;
        let latent = judged.text_to_image;
        let latent = latent.map_or(Ok(Vec::new()), |source| source.draw(scenes, Told::Both))?;
        for (n, scene) in scenes.iter().enumerate() {
            let images = [&references[n], &seconds[n], &generated[n], &linear[n]];
            let [reference, second, model, gaussian] = images.map(grey);
            let (flat, soft) = (constant(&reference), blur(&second));
            let images = [&second, &model, &gaussian, &flat, &soft];
            for (tally, image) in self.tallies.iter_mut().zip(images) {
                tally.add(&reference, image, lpips);
            }
            if let Some(image) = latent.get(n) {
                self.tallies[5].add(&reference, &grey(image), lpips);
            }
            self.simulated.push(Reading::of(&references[n], scene)?);
            self.generated.push(Reading::of(&generated[n], scene)?);
            self.gaussian.push(Reading::of(&linear[n], scene)?);
            for (looks, image) in self.looks.iter_mut().zip([&references[n], &generated[n]]) {
                looks.extend(equivalent_looks(image, scene));
            }
        }
        Ok(())
    }
}

/// Equivalent number of looks of the open sea, after speckle is applied.
fn equivalent_looks(intensity: &Field, scene: &Scene) -> Option<f64> {
    let mut image = intensity.clone();
    speckle(&mut image, scene.radar.looks, scene.seed);
    let ship = ship(scene);
    let sea = open_sea(&image, &raster(scene), Some((ship.position, ship.heading)))?;
    Some(sea.contrast.powi(-2))
}

/// The measurements when the source is told less.
fn conditions(
    scenes: &[Scene],
    judged: &Judged<'_>,
    sums: &Sums,
    bar: &ProgressBar,
) -> Result<Vec<ConditionRow>> {
    let simulated = &sums.simulated[..scenes.len()];
    let mut all = vec![ConditionRow {
        told: Told::Both.name(),
        measurements: rows(
            scenes,
            simulated,
            Some(&sums.generated[..scenes.len()]),
            None,
        ),
    }];
    for &told in &judged.conditions {
        let mut readings = Vec::new();
        for batch in scenes.chunks(BATCH) {
            let images = judged.source.draw(batch, told)?;
            for (image, scene) in images.iter().zip(batch) {
                readings.push(Reading::of(image, scene)?);
            }
            bar.inc(batch.len() as u64);
        }
        all.push(ConditionRow {
            told: told.name(),
            measurements: rows(scenes, simulated, Some(&readings), None),
        });
    }
    Ok(all)
}
