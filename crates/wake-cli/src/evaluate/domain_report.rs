//! Report of `wake evaluate domain`: text, and a sheet of images.

use crate::sheet::Picture;
use serde::Serialize;
use wake_physics::measure::median;
use wake_train::TwoSample;
use wake_train::evaluation::{DomainRow, Views};

/// Scenes on the sheet, each simulated and drawn by the model.
const PICTURED: usize = 6;
/// Half width of the sheet's grey range, around the median of each scene.
const REACH: f32 = 0.2;

/// Contents of `domain.json`.
#[derive(Debug, Serialize)]
pub(crate) struct Report {
    pub(crate) recipe: String,
    pub(crate) scenes: usize,
    pub(crate) rows: Vec<DomainRow>,
}

/// The report in Markdown.
pub(crate) fn markdown(report: &Report) -> String {
    let told = |t: &Option<TwoSample>| {
        t.as_ref().map_or("–".to_owned(), |t| {
            format!("{:.3} ± {:.3}", t.accuracy, t.half_width)
        })
    };
    let mut text = format!(
        "{} scenes of the recipe `{}`.\n\n| image | classifier accuracy, before speckle | with speckle | seconds an image |\n|---|---|---|---|\n",
        report.scenes, report.recipe
    );
    for row in &report.rows {
        let [plain, speckled] = [&row.before_speckle, &row.with_speckle].map(told);
        text += &format!(
            "| {} | {plain} | {speckled} | {:.3} |\n",
            row.image, row.seconds
        );
    }
    text
}

/// Sheet with two rows per kind, before speckle and with it; the simulator above the model.
pub(crate) fn sheet(simulated: &Views, model: &Views) -> Picture {
    let mut panels = Vec::new();
    for (name, views) in [("simulator", simulated), ("model", model)] {
        for images in [&views.plain, &views.speckled] {
            panels.extend(images.iter().take(PICTURED).map(|image| {
                let median = median(&image.values);
                let level = |v: &f32| (127.5 * (1.0 + (v - median) / REACH)).round() as u8;
                let levels: Vec<u8> = image.values.iter().map(level).collect();
                Picture::from_levels(&levels, image.columns).captioned(name)
            }));
        }
    }
    Picture::sheet(&panels, PICTURED)
}
