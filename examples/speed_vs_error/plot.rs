//! The log-log plot: seconds against error, each stage with its oracle.

use crate::row::Row;
use plotters::prelude::*;
use std::path::Path;

const STAGES: [(&str, RGBColor); 5] = [
    ("sea", RGBColor(31, 119, 180)),
    ("kelvin", RGBColor(214, 39, 40)),
    ("backscatter", RGBColor(44, 160, 44)),
    ("bunching", RGBColor(148, 103, 189)),
    ("scene", RGBColor(60, 60, 60)),
];

/// Draws the rows of one size: fast methods as joined dots, oracles as crosses of the same colour at their time.
pub fn draw(path: &Path, rows: &[Row], size: usize) -> Result<(), Box<dyn std::error::Error>> {
    let rows: Vec<&Row> = rows.iter().filter(|r| r.size == size).collect();
    let area = SVGBackend::new(path, (900, 620)).into_drawing_area();
    area.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&area)
        .caption(
            format!("Speed against error, {size} x {size} pixels"),
            ("sans-serif", 22),
        )
        .margin(16)
        .x_label_area_size(44)
        .y_label_area_size(64)
        .build_cartesian_2d((1e-8f64..1.0).log_scale(), (1e-4f64..1e4).log_scale())?;
    chart
        .configure_mesh()
        .x_desc("rms error (relative)")
        .y_desc("seconds")
        .draw()?;
    for (stage, colour) in STAGES {
        let points = |seconds: fn(&Row) -> f64| {
            let mut points: Vec<(f64, f64)> = rows
                .iter()
                .filter(|r| r.stage == stage)
                .map(|r| (r.rms_error.max(1e-8), seconds(r)))
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
