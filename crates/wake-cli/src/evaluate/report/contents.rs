//! What `report.json` holds.

use crate::evaluate::timing::TimingRow;
use serde::Serialize;
use wake_train::evaluation::Figures;

/// Everything that `report.json` holds.
#[derive(Debug, Serialize)]
pub(crate) struct Report {
    #[serde(flatten)]
    pub(crate) figures: Figures,
    pub(crate) seconds: Vec<TimingRow>,
    pub(crate) paper: Paper,
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

pub(crate) const PAPER: Paper = Paper {
    ssim: 0.17,
    psnr_db: 12.57,
    lpips: 0.57,
    speed_up: 11.0,
};

/// A number, or a dash.
pub(super) fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or("–".to_owned(), |v| format!("{v:.digits$}"))
}
