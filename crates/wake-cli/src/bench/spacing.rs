//! Effect of the computed pixel spacing: error and seconds of one image on finer and finer pixels, and order of
//! convergence.

use super::row::median_seconds;
use serde::Serialize;
use wake_physics::{Field, Result, Scene, Simulator};

/// Divisions of pixels of 20 m along each side; the last is the reference for the others.
const DIVISIONS: [u32; 5] = [2, 3, 4, 6, 12];
/// Number of images measured.
pub(crate) const COUNT: u64 = DIVISIONS.len() as u64;

/// Timed runs of each spacing.
const RUNS: usize = 3;

/// Figures of one spacing.
#[derive(Debug, Serialize)]
pub(crate) struct SpacingRow {
    stage: &'static str,
    /// Computed spacing \[m\].
    spacing: f64,
    /// Whether the plan chooses it.
    chosen: bool,
    seconds: f64,
    /// Root mean square difference from the finest spacing, over the mean \[1\].
    error: f64,
    /// Order of convergence: log(error / next finer error) / log(spacing / next finer spacing).
    order: Option<f64>,
}

/// A ship of 6.5 m/s with a response of 20 m at C band: the waves on its arms are 18 m long. Images are means over all
/// seas, so no random sea blurs the comparison.
fn scene(divisions: Option<u32>) -> Result<Scene> {
    let keys = [
        "grid.rows=96",
        "grid.columns=96",
        "grid.spacing=20",
        "radar.frequency=5.405e9",
        "radar.incidence=35",
        "radar.range_to_velocity=115",
        "radar.range_resolution=20",
        "radar.azimuth_resolution=20",
        "ship.speed=6.5",
        "ship.position=[550, 550]",
    ];
    let mut scene = Scene::default().with_assignments(&keys)?;
    scene.grid.oversampling = divisions;
    Ok(scene)
}

/// Measures every spacing.
pub(crate) fn measure(mut done: impl FnMut()) -> Result<Vec<SpacingRow>> {
    let chosen = wake_physics::Plan::new(&scene(None)?)?
        .sizes
        .computed_spacing;
    let mut simulator = Simulator::default();
    let mut measured: Vec<(f64, f64, Field)> = Vec::new();
    for divisions in DIVISIONS {
        let scene = scene(Some(divisions))?;
        let (seconds, image) = median_seconds(RUNS, || simulator.expected_intensity(&scene));
        measured.push((20.0 / f64::from(divisions), seconds, image?));
        done();
    }
    let Some((_, _, finest)) = measured.pop() else {
        return Ok(Vec::new());
    };
    let errors: Vec<f64> = measured
        .iter()
        .map(|(_, _, image)| image.difference(&finest).1 / finest.mean())
        .collect();
    let row = |(n, (spacing, seconds, _)): (usize, &(f64, f64, Field))| SpacingRow {
        stage: "spacing",
        spacing: *spacing,
        chosen: (spacing - chosen).abs() < 1e-9,
        seconds: *seconds,
        error: errors[n],
        order: errors
            .get(n + 1)
            .map(|finer| (errors[n] / finer).ln() / (spacing / measured[n + 1].0).ln()),
    };
    Ok(measured.iter().enumerate().map(row).collect())
}

/// Markdown table of the rows.
pub(crate) fn table(rows: &[SpacingRow]) -> String {
    let mut text = String::from(
        "| spacing computed on | seconds | error | order |\n| ---: | ---: | ---: | ---: |\n",
    );
    for row in rows {
        let order = row
            .order
            .map_or_else(String::new, |order| format!("{order:.1}"));
        let chosen = if row.chosen { " (the plan's)" } else { "" };
        text += &format!(
            "| {:.2} m{chosen} | {:.3} | {:.1e} | {order} |\n",
            row.spacing, row.seconds, row.error
        );
    }
    text
}
