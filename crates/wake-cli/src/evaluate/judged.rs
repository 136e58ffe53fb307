//! Runs an evaluation and makes its report.

use super::report::{PAPER, Report};
use super::{ablation, plot, timing};
use crate::exit::Outcome;
use indicatif::{ProgressBar, ProgressStyle};
use std::path::Path;
use wake_ldm::WakeSampler;
use wake_nn::burn::tensor::Device;
use wake_train::evaluation::{Evaluation, TextToImage};
use wake_train::metrics::Perceptual;

/// Held-out scene of the picture of all kinds of images.
const PICTURED: u64 = 2;

/// An evaluation, and the models that it times.
pub(super) struct Judged<'a> {
    pub(super) evaluation: Evaluation<'a>,
    /// Models that are timed.
    pub(super) wake_model: Option<&'a WakeSampler>,
    pub(super) text_to_image: Option<&'a TextToImage<'a>>,
    pub(super) perceptual: &'a Perceptual,
}

impl Judged<'_> {
    /// Draws and measures everything, and writes the plots into a folder.
    pub(super) fn report(&self, device: &Device, out: &Path) -> Outcome<Report> {
        whole_files::make_folder(out)?;
        let evaluation = &self.evaluation;
        let bar = ProgressBar::new(evaluation.steps());
        bar.set_style(ProgressStyle::with_template(
            "{msg:20} {bar:30} {pos}/{len}, {eta} left",
        )?);
        let figures = evaluation.figures(self.perceptual, device, &|what, more| {
            bar.set_message(what);
            bar.inc(more);
        })?;
        bar.set_message("seconds");
        let grid = &evaluation.held_out.base.grid;
        let report = Report {
            figures,
            pixels_along: grid.rows,
            spacing: grid.spacing,
            speckle: evaluation.view.speckle,
            schedulers: Vec::new(),
            seconds: timing::timings(self.wake_model, self.text_to_image)?,
            paper: PAPER,
        };
        bar.finish_and_clear();
        let scene = evaluation.held_out.scene(PICTURED);
        ablation::picture(&scene, evaluation)?.write(&out.join("ablation.png"))?;
        plot::spectrum(&out.join("spectrum.svg"), &report)?;
        plot::wake(&out.join("wake_correlation.svg"), &report)?;
        Ok(report)
    }
}
