//! What `report.json` holds, and the same as text.

mod images;
mod values;

use super::timing::TimingRow;
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

/// The report in Markdown.
pub(crate) fn markdown(report: &Report) -> String {
    let parts = [
        format!(
            "Judged: {}. {} held-out scenes of 256 x 256 pixels of 4 m, before speckle.\n",
            report.figures.judged, report.figures.scenes
        ),
        images::ablation(report),
        images::pixels(report),
        images::wake(report),
        values::measurements("Values read from the images", &report.figures.measurements),
        values::conditions(report),
        values::controllability(report),
        seconds(report),
    ];
    let parts: Vec<String> = parts.into_iter().filter(|part| !part.is_empty()).collect();
    parts.join("\n")
}

/// A number, or a dash.
fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or("–".to_owned(), |v| format!("{v:.digits$}"))
}

fn seconds(report: &Report) -> String {
    let beside = report.seconds.iter().any(|r| r.text_to_image.is_some());
    let cell = |text: &str| {
        if beside {
            format!(" {text} |")
        } else {
            String::new()
        }
    };
    let mut text = format!(
        "## Seconds per image\n\n| pixels | simulator | harmonic sum, 2 x 10⁴ waves | model |{}\n\
         | --- | --- | --- | --- |{}\n",
        cell("text to image"),
        cell("---")
    );
    for r in &report.seconds {
        text += &format!(
            "| {0} x {0} | {1:.3} | {2:.1} | {3} |{4}\n",
            r.size,
            r.simulator_fast,
            r.simulator_harmonic_sum,
            number(r.model, 3),
            cell(&number(r.text_to_image, 2))
        );
    }
    text + &format!(
        "\nThe paper's model is up to {} times faster than its simulator, a harmonic sum.\n",
        report.paper.speed_up
    )
}
