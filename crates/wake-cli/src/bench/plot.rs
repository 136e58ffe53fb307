//! Log-log plot of seconds against error, each stage with its oracle.

use super::row::Row;
use plotters::prelude::*;
use std::path::Path;

use crate::exit::Outcome;

/// Pixels along a side of the simulator's frontier.
pub(crate) const FRONTIER_SIZE: usize = 512;

/// Content of a plot.
pub(crate) struct Chart {
    caption: &'static str,
    /// Pixels along a side of the rows shown, and their stages.
    size: usize,
    stages: &'static [(&'static str, RGBColor)],
    /// Ranges of error and of seconds.
    errors: [f64; 2],
    seconds: [f64; 2],
}

/// Fast methods and oracles of the simulator.
pub(crate) const SIMULATOR: Chart = Chart {
    caption: "Speed against error, 512 x 512 pixels",
    size: FRONTIER_SIZE,
    stages: &[
        ("sea", RGBColor(31, 119, 180)),
        ("kelvin", RGBColor(214, 39, 40)),
        ("backscatter", RGBColor(44, 160, 44)),
        ("bunching", RGBColor(148, 103, 189)),
        ("swell", RGBColor(23, 190, 207)),
        ("unresolved", RGBColor(188, 189, 34)),
        ("edge", RGBColor(227, 119, 194)),
        ("response", RGBColor(140, 86, 75)),
        ("scene", RGBColor(60, 60, 60)),
    ],
    errors: [1e-8, 1.0],
    seconds: [1e-4, 1e4],
};

/// The model by number of steps.
pub(crate) const MODEL: Chart = Chart {
    caption: "Speed against error, 1 to 16 steps of the model, 256 x 256 pixels",
    size: 256,
    stages: &[("model", RGBColor(230, 120, 0))],
    errors: [1e-3, 10.0],
    seconds: [1e-2, 1e2],
};

/// Plots rows: fast methods as joined dots, oracles as crosses of the same colour at their own time.
pub(crate) fn draw(path: &Path, plot: &Chart, rows: &[Row]) -> Outcome<()> {
    let rows: Vec<&Row> = rows.iter().filter(|r| r.size == plot.size).collect();
    let area = SVGBackend::new(path, (900, 620)).into_drawing_area();
    area.fill(&WHITE)?;
    let axis = |[from, to]: [f64; 2]| (from..to).log_scale();
    let mut chart = ChartBuilder::on(&area)
        .caption(plot.caption, ("sans-serif", 22))
        .margin(16)
        .x_label_area_size(44)
        .y_label_area_size(64)
        .build_cartesian_2d(axis(plot.errors), axis(plot.seconds))?;
    chart
        .configure_mesh()
        .x_label_formatter(&|error| format!("{error:.0e}"))
        .x_desc("rms error (relative)")
        .y_desc("seconds")
        .draw()?;
    for &(stage, colour) in plot.stages {
        let points = |seconds: fn(&Row) -> f64| {
            let mut points: Vec<(f64, f64)> = rows
                .iter()
                .filter(|r| r.stage == stage)
                .map(|r| (r.rms_error.max(plot.errors[0]), seconds(r)))
                .collect();
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            points
        };
        let fast = points(|r| r.fast_seconds);
        chart
            .draw_series(LineSeries::new(
                fast.iter().copied(),
                colour.stroke_width(2),
            ))?
            .label(format!("{stage}: fast, oracle (x)"))
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
        chart.draw_series(fast.iter().map(|&p| Circle::new(p, 4, colour.filled())))?;
        let oracle = points(|r| r.oracle_seconds);
        chart.draw_series(
            oracle
                .iter()
                .map(|&p| Cross::new(p, 5, colour.stroke_width(2))),
        )?;
    }
    chart
        .configure_series_labels()
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK)
        .position(SeriesLabelPosition::UpperRight)
        .draw()?;
    area.present()?;
    Ok(())
}
