//! Schedulers and steps: image figures, seconds, and the error against a reference of many steps.

use crate::exit::Outcome;
use serde::Serialize;
use std::time::Instant;
use wake_physics::{Field, Scene};
use wake_train::evaluation::{Baseline, Evaluation, ImageSource, PixelRow, TextToImage, Told};
use wake_train::metrics::Perceptual;

/// A model with a named scheduler.
pub(super) struct Drawn<'a> {
    pub(super) scheduler: String,
    pub(super) source: TextToImage<'a>,
}

/// Most scenes that every scheduler draws.
const SCENES: usize = 16;

/// Figures of a scheduler with a number of steps.
#[derive(Debug, Serialize)]
pub(crate) struct SchedulerRow {
    pub(crate) scheduler: String,
    pub(crate) steps: usize,
    /// Seconds per image.
    pub(crate) seconds: f64,
    /// Root mean square difference of grey from the reference with the same noise, over the reference's standard
    /// deviation.
    pub(crate) error: Option<f64>,
    /// Comparison with simulated images.
    pub(crate) pixels: PixelRow,
}

/// Figures of each scheduler and number of steps.
///
/// - `reference`: DDIM with many steps, from which errors are measured
pub(super) fn rows(
    ways: &[Drawn<'_>],
    reference: Option<&Drawn<'_>>,
    evaluation: &Evaluation<'_>,
    perceptual: &Perceptual,
) -> Outcome<Vec<SchedulerRow>> {
    let scenes = evaluation.held_out.scenes(0, evaluation.scenes.min(SCENES));
    let view = &evaluation.view;
    let draw = |source: &dyn ImageSource, scenes: &[Scene]| -> Outcome<Vec<Field>> {
        let images = view.draw(source, scenes, Told::Text)?;
        Ok(images.iter().map(|image| view.grey(image)).collect())
    };
    let simulated = draw(&Baseline::Simulator, &scenes)?;
    let exact = reference
        .map(|way| draw(&way.source, &scenes))
        .transpose()?;
    let row = |way: &Drawn<'_>| -> Outcome<SchedulerRow> {
        let begin = Instant::now();
        let images = draw(&way.source, &scenes)?;
        Ok(SchedulerRow {
            scheduler: way.scheduler.clone(),
            steps: way.source.steps,
            seconds: begin.elapsed().as_secs_f64() / scenes.len() as f64,
            error: exact.as_deref().map(|exact| relative_error(&images, exact)),
            pixels: PixelRow::of(&way.scheduler, &simulated, &images, perceptual),
        })
    };
    ways.iter().map(row).collect()
}

fn relative_error(images: &[Field], exact: &[Field]) -> f64 {
    let values = |fields: &[Field]| -> Vec<f64> {
        let all = fields.iter().flat_map(|field| &field.values);
        all.map(|&v| f64::from(v)).collect()
    };
    let (found, exact) = (values(images), values(exact));
    let mean = exact.iter().sum::<f64>() / exact.len() as f64;
    let variance: f64 = exact.iter().map(|v| (v - mean).powi(2)).sum();
    let pairs = found.iter().zip(&exact);
    let squares: f64 = pairs.map(|(a, b)| (a - b).powi(2)).sum();
    (squares / variance.max(f64::MIN_POSITIVE)).sqrt()
}
