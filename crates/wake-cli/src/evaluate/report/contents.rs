//! Contents of `report.json`.

use crate::evaluate::schedulers::SchedulerRow;
use crate::evaluate::timing::TimingRow;
use serde::Serialize;
use wake_train::evaluation::Figures;

/// Contents of `report.json`.
#[derive(Debug, Serialize)]
pub(crate) struct Report {
    #[serde(flatten)]
    pub(crate) figures: Figures,
    /// Pixels along a side of the images, and pixel spacing [m].
    pub(crate) pixels_along: usize,
    pub(crate) spacing: f64,
    /// Whether images are compared with speckle.
    pub(crate) speckle: bool,
    /// Schedulers and steps of a text-to-image model.
    pub(crate) schedulers: Vec<SchedulerRow>,
    pub(crate) seconds: Vec<TimingRow>,
    pub(crate) paper: Paper,
}

/// Figures that the paper reports for its model.
#[derive(Debug, Serialize)]
pub(crate) struct Paper {
    pub(crate) ssim: f64,
    pub(crate) psnr_db: f64,
    pub(crate) lpips: f64,
    /// Seconds per image of 256 × 256 pixels on an RTX 3090.
    pub(crate) seconds_256: f64,
    /// Largest speed-up over its simulator.
    pub(crate) speed_up: f64,
}

pub(crate) const PAPER: Paper = Paper {
    ssim: 0.17,
    psnr_db: 12.57,
    lpips: 0.57,
    seconds_256: 1.49,
    speed_up: 11.0,
};

/// Formats a number, or a dash if there is none.
pub(super) fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or("–".to_owned(), |v| format!("{v:.digits$}"))
}
