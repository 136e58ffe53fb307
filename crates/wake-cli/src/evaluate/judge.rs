//! The order of the figures: what is drawn, and what is counted on it.

use super::report::{ConditionRow, PAPER, Report, Speckle};
use super::rungs::kinds;
use super::scenes::held_out;
use super::timing::timings;
use crate::exit::Outcome;
use indicatif::ProgressBar;
use wake_nn::burn::tensor::Device;
use wake_physics::Scene;
use wake_train::evaluation::{
    BATCH, Comparison, ImageSource, MeasurementRow, Quantity, Reading, SwapRow, Told, rungs, swaps,
    wake_correlation,
};
use wake_train::metrics::Lpips;

/// First index of the scenes whose values are changed: apart from those of the other figures.
const FIRST_SWAPPED: u64 = 1 << 20;

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
        let rungs = kinds(judged).len() + 1;
        self.scenes + 8 * self.wake_scenes + conditions + 5 * self.pairs + 10 + rungs
    }
}

/// Draws and judges everything.
pub(crate) fn judge(
    plan: &Plan,
    judged: &Judged<'_>,
    lpips: Option<&Lpips>,
    device: &Device,
    bar: &ProgressBar,
) -> Outcome<Report> {
    let scenes: Vec<Scene> = (0..plan.scenes as u64).map(held_out).collect();
    bar.set_message("pixels and values");
    let mut compared = Comparison::default();
    for batch in scenes.chunks(BATCH) {
        compared.add(batch, judged.source, judged.text_to_image, lpips)?;
        bar.inc(batch.len() as u64);
    }
    bar.set_message("rungs");
    let rungs = rungs(&scenes, &kinds(judged), device, || bar.inc(1))?;
    bar.set_message("wake correlation");
    let with_wake = &scenes[..plan.wake_scenes];
    let wake_correlation = wake_correlation(with_wake, judged.source, || bar.inc(8))?;
    bar.set_message("conditions");
    let conditions = conditions(&scenes[..plan.condition_scenes], judged, &compared, bar)?;
    bar.set_message("swaps");
    let swaps = swapped(plan.pairs, judged, bar)?;
    bar.set_message("seconds");
    let seconds = timings(judged.source, judged.text_to_image)?;
    let [simulator, model] = compared.looks();
    Ok(Report {
        judged: judged.name,
        scenes: scenes.len(),
        pixels: compared.pixels(),
        rungs,
        speckle: Speckle {
            looks: scenes[0].radar.looks,
            simulator,
            model,
        },
        wake_correlation,
        measurements: MeasurementRow::of_all(
            &scenes,
            &compared.simulated,
            Some(&compared.generated),
            Some(&compared.gaussian),
        ),
        conditions,
        swaps,
        seconds,
        paper: PAPER,
    })
}

/// The measurements when the source is told less.
fn conditions(
    scenes: &[Scene],
    judged: &Judged<'_>,
    compared: &Comparison,
    bar: &ProgressBar,
) -> Outcome<Vec<ConditionRow>> {
    let simulated = &compared.simulated[..scenes.len()];
    let row = |told: Told, generated: &[Reading]| ConditionRow {
        told: told.name(),
        measurements: MeasurementRow::of_all(scenes, simulated, Some(generated), None),
    };
    let mut all = vec![row(Told::Both, &compared.generated[..scenes.len()])];
    for &told in &judged.conditions {
        let generated = Reading::of_source(judged.source, scenes, told, |n| bar.inc(n))?;
        all.push(row(told, &generated));
    }
    Ok(all)
}

/// Pairs of scenes of which one value is changed.
fn swapped(pairs: usize, judged: &Judged<'_>, bar: &ProgressBar) -> Outcome<Vec<SwapRow>> {
    let told = [&[Told::Both][..], &judged.conditions].concat();
    let mut rows = Vec::new();
    for quantity in Quantity::ALL {
        let first = FIRST_SWAPPED + ((quantity as u64) << 12);
        let scenes: Vec<Scene> = (first..first + pairs as u64).map(held_out).collect();
        let swaps = swaps(quantity, &scenes, judged.source, &told, || bar.inc(1))?;
        rows.extend(swaps);
    }
    Ok(rows)
}
