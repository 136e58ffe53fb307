//! Learning curve: figures of a model against the number of training images.

use super::report::Report;
use crate::exit::Outcome;
use serde::Serialize;
use std::fs::OpenOptions;
use std::io::Write;
use std::path::Path;

/// One point of the curve.
#[derive(Debug, Serialize)]
struct Point {
    /// Images seen in training, counting repetitions.
    samples: u64,
    /// Held-out scenes that were evaluated.
    scenes: usize,
    /// Accuracy of a classifier between patches of the model and simulated ones.
    two_sample: Option<f64>,
    /// Largest difference of the radial spectrum up to half the Nyquist frequency [dB].
    spectrum_db: Option<f64>,
    /// Contrast of the wake relative to the expected image, for the model and for the simulator.
    wake_contrast: Option<f64>,
    wake_contrast_simulator: Option<f64>,
    /// Median absolute error, and share of scenes in which the value is measurable.
    heading_deg: [Option<f64>; 2],
    speed_m_s: [Option<f64>; 2],
}

/// Appends the figures of a report to a file of JSON lines.
pub(super) fn append(path: &Path, samples: u64, report: &Report) -> Outcome<()> {
    let figures = &report.figures;
    let row = |name: &str| figures.ablation.iter().find(|row| row.image == name);
    let (model, simulator) = (row(figures.judged), figures.ablation.last());
    let error = |n: usize| {
        let errors = figures.measurements[n].model.as_ref();
        [errors.and_then(|e| e.median), errors.map(|e| e.measurable)]
    };
    let point = Point {
        samples,
        scenes: figures.scenes,
        two_sample: model.and_then(|row| row.two_sample).map(|t| t.accuracy),
        spectrum_db: figures.pixels.first().and_then(|row| row.spectrum_db),
        wake_contrast: model.and_then(|row| row.wake_contrast),
        wake_contrast_simulator: simulator.and_then(|row| row.wake_contrast),
        heading_deg: error(0),
        speed_m_s: error(1),
    };
    let line = serde_json::to_string(&point)? + "\n";
    let file = OpenOptions::new().create(true).append(true).open(path);
    let write = file.and_then(|mut file| file.write_all(line.as_bytes()));
    write.map_err(|error| format!("--curve {}: {error}", path.display()).into())
}
