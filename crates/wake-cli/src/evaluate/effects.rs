//! Effects of single values of a scene on its image: three values each of heading, wind speed and incidence, simulated
//! and drawn by a model.

use crate::exit::Outcome;
use crate::sheet::Picture;
use wake_physics::{Field, Scene};
use wake_train::evaluation::{Baseline, Evaluation, ImageSource, Told};

/// Values of the paper's grid; it is not known which of them the paper's own figure shows.
const HEADINGS: [f64; 3] = [0.0, 45.0, 90.0];
const WINDS: [f64; 3] = [3.0, 5.0, 7.0];
const INCIDENCES: [f64; 3] = [16.0, 24.0, 32.0];

/// One row per quantity with three values: simulated images on the left, the model's on the right.
pub(super) fn picture(evaluation: &Evaluation<'_>) -> Outcome<Picture> {
    let mut panels = Vec::new();
    for (name, unit, scenes) in rows(&evaluation.held_out.base) {
        let seeds = scenes.each_ref().map(|(_, scene)| scene.clone());
        for (kind, source) in [
            ("simulator", &Baseline::Simulator as &dyn ImageSource),
            (evaluation.name, evaluation.source),
        ] {
            let images = evaluation.view.draw(source, &seeds, Told::Both)?;
            for (image, (value, _)) in images.iter().zip(&scenes) {
                let caption = format!("{kind}, {name} {value} {unit}");
                panels.push(panel(&evaluation.view.grey(image)).captioned(&caption));
            }
        }
    }
    Ok(Picture::sheet(&panels, 6))
}

/// Grey without contrast stretch, because brightness carries wind and incidence.
fn panel(grey: &Field) -> Picture {
    let levels: Vec<u8> = grey
        .values
        .iter()
        .map(|v| (255.0 * v).round() as u8)
        .collect();
    Picture::from_levels(&levels, grey.columns)
}

type Row = (&'static str, &'static str, [(f64, Scene); 3]);

/// Scenes with the same seed that differ in one value.
fn rows(base: &Scene) -> [Row; 3] {
    let of = |values: [f64; 3], set: fn(&mut Scene, f64)| {
        values.map(|value| {
            let mut scene = base.clone();
            if scene.ships.is_empty() {
                scene.ships.push(wake_physics::Ship::default());
            }
            set(&mut scene, value);
            (value, scene)
        })
    };
    [
        (
            "heading",
            "deg",
            of(HEADINGS, |s, v| s.ships[0].heading = v),
        ),
        ("wind", "m/s", of(WINDS, |s, v| s.sea.wind_speed = v)),
        (
            "incidence",
            "deg",
            of(INCIDENCES, |s, v| s.radar.incidence = v),
        ),
    ]
}
