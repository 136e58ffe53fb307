//! Rows of the model by number of steps, batch size and weight precision.

use super::row::Row;
use serde::Serialize;

/// Steps of the reference.
pub(crate) const REFERENCE: usize = 100;
/// Numbers of steps, with single images and the shipped weights.
pub(crate) const STEPS: [usize; 6] = [1, 2, 3, 4, 8, 16];

/// Comparison of one way to draw images with the reference.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct ModelRow {
    /// Seconds are per image; the oracle is the same model with [`REFERENCE`] steps, one image at a time. Errors are
    /// errors of grey, relative to the reference's standard deviation.
    #[serde(flatten)]
    pub(crate) row: Row,
    /// Steps from noise to image.
    pub(crate) steps: usize,
    /// Method of a step.
    pub(crate) sampler: &'static str,
    /// Number format of the weights; all arithmetic is in f32.
    pub(crate) precision: &'static str,
    /// Images per batch.
    pub(crate) batch: usize,
    /// Largest difference of the mean radial spectrum up to half the Nyquist frequency \[dB\].
    pub(crate) spectrum_db: f64,
}

/// The rows of different steps, for a plot.
pub(crate) fn steps(rows: &[ModelRow]) -> Vec<Row> {
    let steps = rows.iter().take(STEPS.len());
    steps.map(|row| row.row.clone()).collect()
}

/// Markdown table of the rows.
pub(crate) fn table(rows: &[ModelRow]) -> String {
    let mut text =
        "| steps | sampler | weights | batch | ms per image | ratio | max error | rms error | spectrum dB |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n"
            .to_owned();
    for r in rows {
        text += &format!(
            "| {} | {} | {} | {} | {:.1} | {:.1} | {:.1e} | {:.1e} | {:.2} |\n",
            r.steps,
            r.sampler,
            r.precision,
            r.batch,
            1e3 * r.row.fast_seconds,
            r.row.ratio,
            r.row.max_error,
            r.row.rms_error,
            r.spectrum_db
        );
    }
    let reference = rows.first().map_or(0.0, |r| r.row.oracle_seconds);
    text + &format!("\nReference: {REFERENCE} steps, {reference:.2} s per image.\n")
}
