//! Map of the speed bound over wind and heading, for several sensors.

use crate::exit::Outcome;
use plotters::prelude::*;
use rayon::prelude::*;
use std::path::Path;
use wake_physics::Scene;
use wake_physics::estimate::{Parameter, Priors, Value, bound};

/// Sensors with their pixel spacing \[m\] and pixels along a side.
const SENSORS: [(&str, f64, usize); 7] = [
    ("sentinel-1-iw", 10.0, 104),
    ("radarsat-2-s", 12.5, 84),
    ("ers-2-pri", 12.5, 84),
    ("terrasar-x-sm", 5.0, 208),
    ("cosmo-skymed-dgm", 5.0, 208),
    ("alos-fbs", 6.25, 168),
    ("novasar-1", 8.0, 130),
];

/// Winds [m/s] and headings \[deg\] of the cells; headings in the other range direction are symmetric.
const WINDS: [f64; 5] = [3.0, 5.0, 7.0, 9.0, 11.0];
const HEADINGS: [f64; 5] = [0.0, 45.0, 90.0, 135.0, 180.0];

/// Standard deviations of the speed at the ends of the colour scale [m/s].
const COLOURS: [f64; 2] = [0.003, 3.0];

/// Width and height of a panel \[pixels\].
const PANEL: (u32, u32) = (250, 230);

/// Draws one panel per sensor; everything else is as in the scene.
pub(super) fn draw(path: &Path, scene: &Scene, priors: &Priors) -> Outcome<()> {
    let cells: Vec<(usize, f64, f64)> = (0..SENSORS.len())
        .flat_map(|n| WINDS.into_iter().map(move |wind| (n, wind)))
        .flat_map(|(n, wind)| HEADINGS.into_iter().map(move |heading| (n, wind, heading)))
        .collect();
    let scenes: Vec<Scene> = cells
        .iter()
        .map(|&(n, wind, heading)| seen(scene, SENSORS[n], wind, heading))
        .collect::<Outcome<_>>()?;
    let speed = Parameter::Value(Value::Speed);
    let of = |scene: &Scene| Ok(bound(scene, &Parameter::OF_WAKE, priors)?.of(speed));
    let bounds: wake_physics::Result<Vec<f64>> = scenes.par_iter().map(of).collect();
    picture(path, &bounds?)
}

/// The scene with a sensor, wind and heading; the ship lies 300 m from the middle, ahead of its wake.
fn seen(
    scene: &Scene,
    (sensor, spacing, side): (&str, f64, usize),
    wind: f64,
    heading: f64,
) -> Outcome<Scene> {
    let (sin, cos) = heading.to_radians().sin_cos();
    let keys = [
        format!("radar.sensor={sensor}"),
        format!("grid.spacing={spacing}"),
        format!("grid.rows={side}"),
        format!("grid.columns={side}"),
        format!("sea.wind_speed={wind}"),
        format!("ship.heading={heading}"),
        format!("ship.position=[{}, {}]", 300.0 * sin, 300.0 * cos),
        "model.tolerance=1e-2".to_owned(),
    ];
    let keys: Vec<&str> = keys.iter().map(String::as_str).collect();
    Ok(scene.clone().with_assignments(&keys)?)
}

/// - `bounds`: [m/s] by sensor, wind and heading, the last running fastest
fn picture(path: &Path, bounds: &[f64]) -> Outcome<()> {
    let size = (4 * PANEL.0, 2 * PANEL.1);
    let area = SVGBackend::new(path, size).into_drawing_area();
    area.fill(&WHITE)?;
    let panels = area.split_evenly((2, 4));
    let sensors = bounds.chunks(WINDS.len() * HEADINGS.len());
    for ((panel, sensor), bounds) in panels.iter().zip(SENSORS).zip(sensors) {
        let mut chart = ChartBuilder::on(panel)
            .margin(6)
            .caption(format!("{}, {} m", sensor.0, sensor.1), ("sans-serif", 15))
            .x_label_area_size(34)
            .y_label_area_size(36)
            .build_cartesian_2d(-0.5..HEADINGS.len() as f64 - 0.5, 2.0..12.0)?;
        chart
            .configure_mesh()
            .disable_mesh()
            .x_labels(HEADINGS.len())
            .y_labels(6)
            .x_label_formatter(&|column| {
                let heading = HEADINGS.get(column.round().max(0.0) as usize);
                heading.map_or(String::new(), |heading| format!("{heading:.0}"))
            })
            .y_label_formatter(&|wind| format!("{wind:.0}"))
            .x_desc("heading [deg]")
            .y_desc("wind [m/s]")
            .draw()?;
        let cells = bounds.iter().enumerate();
        let cells: Vec<(f64, f64, f64)> = cells
            .map(|(n, &bound)| {
                let column = (n % HEADINGS.len()) as f64;
                (column, WINDS[n / HEADINGS.len()], bound)
            })
            .collect();
        chart.draw_series(cells.iter().map(|&(column, wind, bound)| {
            let corners = [(column - 0.5, wind - 1.0), (column + 0.5, wind + 1.0)];
            Rectangle::new(corners, colour(bound).filled())
        }))?;
        chart.draw_series(cells.iter().map(|&(column, wind, bound)| {
            let style = ("sans-serif", 11).into_font().color(&ink(bound));
            let anchored = style.pos(plotters::style::text_anchor::Pos::new(
                plotters::style::text_anchor::HPos::Center,
                plotters::style::text_anchor::VPos::Center,
            ));
            Text::new(number(bound), (column, wind), anchored)
        }))?;
    }
    if let Some(last) = panels.last() {
        let lines = [
            "Smallest standard deviation of",
            "the ship's speed that an image",
            "can tell [m/s] (Cramér–Rao).",
            "",
            "Ship of the scene, wind toward",
            "the scene's direction; heading 0:",
            "along the flight, 90: along range.",
        ];
        for (n, line) in lines.iter().enumerate() {
            let place = (14, 40 + 20 * n as i32);
            last.draw_text(line, &("sans-serif", 14).into_text_style(last), place)?;
        }
    }
    area.present()?;
    Ok(())
}

fn number(bound: f64) -> String {
    match bound {
        b if b < 0.0995 => format!("{b:.3}"),
        b if b < 0.995 => format!("{b:.2}"),
        b if b < 9.95 => format!("{b:.1}"),
        b if b.is_finite() => "> 10".to_owned(),
        _ => "–".to_owned(),
    }
}

/// Position of a bound on the colour scale, 0 to 1, logarithmic.
fn share(bound: f64) -> f64 {
    let [low, high] = COLOURS;
    ((bound / low).ln() / (high / low).ln()).clamp(0.0, 1.0)
}

/// Colour of a bound: dark blue for the smallest, pale yellow for the largest.
fn colour(bound: f64) -> RGBColor {
    const STOPS: [[f64; 3]; 5] = [
        [8.0, 29.0, 88.0],
        [34.0, 94.0, 168.0],
        [65.0, 182.0, 196.0],
        [199.0, 233.0, 180.0],
        [255.0, 255.0, 217.0],
    ];
    let place = share(bound) * (STOPS.len() - 1) as f64;
    let first = (place as usize).min(STOPS.len() - 2);
    let part = place - first as f64;
    let [r, g, b] =
        [0, 1, 2].map(|c| (STOPS[first][c] * (1.0 - part) + STOPS[first + 1][c] * part) as u8);
    RGBColor(r, g, b)
}

/// Text colour: white on dark cells, black on bright ones.
fn ink(bound: f64) -> RGBColor {
    if share(bound) < 0.55 { WHITE } else { BLACK }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cell_has_its_number() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bounds.svg");
        let count = SENSORS.len() * WINDS.len() * HEADINGS.len();
        let bounds: Vec<f64> = (0..count).map(|n| 0.001 * (n + 1) as f64).collect();
        picture(&path, &bounds).unwrap();
        let drawn = std::fs::read_to_string(&path).unwrap();
        for (sensor, ..) in SENSORS {
            assert!(drawn.contains(sensor), "{sensor}");
        }
        assert!(drawn.contains("0.001") && drawn.contains("0.17"));
        for heading in ["0", "45", "90", "135", "180"] {
            let labels = drawn.matches(&format!("\n{heading}\n")).count();
            assert_eq!(labels, SENSORS.len(), "{heading}");
        }
    }

    /// The scenes of all cells are valid.
    #[test]
    fn sensors_see_the_scene() {
        for sensor in SENSORS {
            let scene = seen(&Scene::default(), sensor, 7.0, 45.0).unwrap();
            assert!(scene.validate().is_ok());
            assert!((scene.grid.spacing * scene.grid.rows as f64 - 1040.0).abs() < 15.0);
        }
    }
}
