//! Plots of radial spectra relative to the simulator's, and of wake correlation by scene.

use super::report::Report;
use crate::exit::Outcome;
use plotters::prelude::*;
use std::path::Path;

const COLOURS: [RGBColor; 3] = [
    RGBColor(31, 119, 180),
    RGBColor(44, 160, 44),
    RGBColor(214, 39, 40),
];

/// Plots the power of each ring relative to the reference [dB].
pub(crate) fn spectrum(path: &Path, report: &Report) -> Outcome<()> {
    let area = SVGBackend::new(path, (900, 560)).into_drawing_area();
    area.fill(&WHITE)?;
    let rings = report.figures.pixels[0].spectrum_curve_db.len();
    let mut chart = ChartBuilder::on(&area)
        .caption("Radial spectrum less the simulator's", ("sans-serif", 22))
        .margin(16)
        .x_label_area_size(44)
        .y_label_area_size(64)
        .build_cartesian_2d(0.0..rings as f64, -10.0..5.0)?;
    chart
        .configure_mesh()
        .x_desc("periods in the image")
        .y_desc("dB")
        .draw()?;
    // A constant image has no spectrum.
    let shown = report
        .figures
        .pixels
        .iter()
        .filter(|row| row.image != "constant");
    for (row, colour) in shown.zip(COLOURS) {
        let points = row.spectrum_curve_db.iter().enumerate().skip(1);
        let points = points.map(|(n, &db)| (n as f64, db.clamp(-10.0, 5.0)));
        chart
            .draw_series(LineSeries::new(points, colour.stroke_width(2)))?
            .label(&row.image)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
    }
    legend(&mut chart)?;
    area.present()?;
    Ok(())
}

/// Plots the power of each ring for the model's and simulated images [dB], with the borders of three bands.
pub(crate) fn radial(path: &Path, report: &Report) -> Outcome<()> {
    let area = SVGBackend::new(path, (900, 560)).into_drawing_area();
    area.fill(&WHITE)?;
    let model = &report.figures.pixels[0];
    let curves = [&model.power_db, &report.figures.pixels[1].power_db];
    let rings = model.power_db.len();
    let shown = || curves.iter().flat_map(|curve| curve.iter().skip(1));
    let [low, high] = shown().fold([f64::MAX, f64::MIN], |[a, b], &v| [a.min(v), b.max(v)]);
    let (low, high) = (low - 3.0, high + 3.0);
    let mut chart = ChartBuilder::on(&area)
        .caption("Radial spectra", ("sans-serif", 22))
        .margin(16)
        .x_label_area_size(44)
        .y_label_area_size(64)
        .build_cartesian_2d(0.0..rings as f64, low..high)?;
    let mesh = &mut chart.configure_mesh();
    mesh.x_desc("periods in the image")
        .y_desc("power of grey, dB")
        .draw()?;
    let names = [report.figures.judged, "simulator, other sea"];
    for ((curve, name), colour) in curves.into_iter().zip(names).zip(COLOURS) {
        let points = curve
            .iter()
            .enumerate()
            .skip(1)
            .map(|(n, &db)| (n as f64, db));
        chart
            .draw_series(LineSeries::new(points, colour.stroke_width(2)))?
            .label(name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
    }
    for third in [1, 2] {
        let border = (third * rings / 3) as f64;
        chart.draw_series(LineSeries::new(
            [(border, low), (border, high)],
            &RGBColor(120, 120, 120),
        ))?;
    }
    legend(&mut chart)?;
    area.present()?;
    Ok(())
}

/// Plots the wake correlation of model against simulator, a dot per scene.
pub(crate) fn wake(path: &Path, report: &Report) -> Outcome<()> {
    let area = SVGBackend::new(path, (620, 600)).into_drawing_area();
    area.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&area)
        .caption("Wake correlation", ("sans-serif", 22))
        .margin(16)
        .x_label_area_size(44)
        .y_label_area_size(64)
        .build_cartesian_2d(-0.2..1.0, -0.2..1.0)?;
    chart
        .configure_mesh()
        .x_desc("simulator, 4 against 4 images")
        .y_desc("model, 8 against 8 images")
        .draw()?;
    let wake = &report.figures.wake_correlation;
    let pairs = wake.simulator.iter().zip(&wake.model);
    let colour = COLOURS[0];
    chart
        .draw_series(pairs.map(|(&s, &m)| Circle::new((s, m), 4, colour.filled())))?
        .label(report.figures.judged)
        .legend(move |(x, y)| Circle::new((x + 9, y), 4, colour.filled()));
    let grey = RGBColor(120, 120, 120);
    chart
        .draw_series(LineSeries::new([(-0.2, -0.2), (1.0, 1.0)], &grey))?
        .label("equal")
        .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], grey));
    legend(&mut chart)?;
    area.present()?;
    Ok(())
}

type Chart<'a> = ChartContext<
    'a,
    SVGBackend<'a>,
    Cartesian2d<plotters::coord::types::RangedCoordf64, plotters::coord::types::RangedCoordf64>,
>;

fn legend(chart: &mut Chart<'_>) -> Outcome<()> {
    chart
        .configure_series_labels()
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK)
        .position(SeriesLabelPosition::LowerRight)
        .draw()?;
    Ok(())
}
