//! Contents of `report.json`.

use crate::evaluate::schedulers::SchedulerRow;
use crate::evaluate::timing::TimingRow;
use serde::Serialize;
use wake_train::evaluation::Figures;

/// Everything that `report.json` holds.
#[derive(Debug, Serialize)]
pub(crate) struct Report {
    #[serde(flatten)]
    pub(crate) figures: Figures,
    /// Pixels along a side of the images, and their size [m].
    pub(crate) pixels_along: usize,
    pub(crate) spacing: f64,
    /// Whether images are compared with speckle.
    pub(crate) speckle: bool,
    /// Ways of drawing with a text-to-image model.
    pub(crate) schedulers: Vec<SchedulerRow>,
    pub(crate) seconds: Vec<TimingRow>,
    pub(crate) paper: Paper,
}

/// Figures that the paper states for its model.
#[derive(Debug, Serialize)]
pub(crate) struct Paper {
    pub(crate) ssim: f64,
    pub(crate) psnr_db: f64,
    pub(crate) lpips: f64,
    /// Seconds of an image of 256 × 256 pixels on an RTX 3090.
    pub(crate) seconds_256: f64,
    /// Times faster than its simulator, at most.
    pub(crate) speed_up: f64,
}

pub(crate) const PAPER: Paper = Paper {
    ssim: 0.17,
    psnr_db: 12.57,
    lpips: 0.57,
    seconds_256: 1.49,
    speed_up: 11.0,
};

/// A number, or a dash.
pub(super) fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or("–".to_owned(), |v| format!("{v:.digits$}"))
}
