//! Ship and wind of an image, as text and JSON.

use super::line::line;
use crate::exit::Outcome;
use crate::sheet::Picture;
use serde_json::{Map, Value, json};
use std::path::Path;
use wake_geo::Product;
use wake_physics::estimate::{Estimate, Estimated, Sighting};
use wake_physics::grey::GreyScale;
use wake_physics::{Field, Scene};

/// Errors of place \[m\] and heading \[deg\] of the sighting in the example.
const OFF: ([f64; 2], f64) = ([40.0, -30.0], 2.0);

/// Reads the pixels of a scene's grid.
///
/// - `at`: row and column of the first in the image
pub(super) fn read(path: &Path, at: Option<[usize; 2]>, scene: &Scene) -> Outcome<Field> {
    let product = Product::open(path)?;
    let (rows, columns) = (scene.grid.rows, scene.grid.columns);
    let [row, column] = match at {
        Some(first) => first,
        _ if product.size() == (rows, columns) => [0, 0],
        _ => {
            let (lines, pixels) = product.size();
            return Err(format!(
                "--image has {lines} x {pixels} pixels but the scene's grid {rows} x {columns}: name the first of them with --at"
            )
            .into());
        }
    };
    let end = |first: usize, count: usize| first..first.saturating_add(count);
    let window = product.read_window(end(row, rows), end(column, columns))?;
    Ok(Field {
        rows,
        columns,
        values: window.values,
    })
}

/// A sighting with a wrong place and heading.
pub(super) fn mistaken(sighting: &Sighting) -> Sighting {
    let ([x, y], turn) = OFF;
    Sighting {
        place: [sighting.place[0] + x, sighting.place[1] + y],
        heading: sighting.heading + turn,
        ..*sighting
    }
}

/// Draws the image, the mean image of the estimate, and their ratio.
pub(super) fn draw(path: &Path, image: &Field, found: &Estimate) -> Outcome<()> {
    let mean = &found.mean;
    let mut over = image.clone();
    for (over, mean) in over.values.iter_mut().zip(&mean.values) {
        *over /= mean.max(f32::MIN_POSITIVE);
    }
    let grey = GreyScale::filling(image);
    let panels = [
        ("image", image, &grey),
        ("mean image", mean, &grey),
        ("image over mean", &over, &GreyScale::filling(&over)),
    ];
    let panels = panels.map(|(caption, field, grey)| {
        let levels: Vec<u8> = field
            .values
            .iter()
            .map(|&v| grey.level(f64::from(v)))
            .collect();
        Picture::from_levels(&levels, field.columns).captioned(caption)
    });
    Ok(Picture::sheet(&panels, panels.len()).write(path)?)
}

/// Estimate as JSON or text, with the prompt of its scene.
pub(super) fn told(found: &Estimate, as_json: bool) -> Outcome<String> {
    #[cfg(feature = "prompt")]
    let sentence = Some(wake_text::prompt(&found.scene)?);
    #[cfg(not(feature = "prompt"))]
    let sentence: Option<String> = None;
    Ok(match as_json {
        true => {
            let mut json = in_json(found);
            json["wakes"][0]["sentence"] = json!(sentence);
            format!("{json:#}")
        }
        false => match sentence {
            Some(sentence) => format!("{}\n{sentence}", in_words(found)),
            None => in_words(found),
        },
    })
}

fn in_json(found: &Estimate) -> Value {
    let mut wake: Map<String, Value> = Map::new();
    for Estimated {
        parameter,
        value,
        deviation,
    } in &found.values
    {
        let name = parameter.name();
        wake.insert(name.to_owned(), json!(value));
        wake.insert(format!("{name}_sd"), json!(deviation));
    }
    let alternatives = found.alternatives.iter();
    let alternatives: Vec<Value> = alternatives
        .map(|other| {
            json!({
                "speed": other.scene.ships.first().map(|ship| ship.speed),
                "wind_toward": other.scene.sea.wind_toward.rem_euclid(360.0),
                "wind_speed": other.scene.sea.wind_speed,
                "weight": other.weight,
            })
        })
        .collect();
    wake.extend([
        ("weight".to_owned(), json!(found.weight)),
        ("alternatives".to_owned(), json!(alternatives)),
        ("log_likelihood".to_owned(), json!(found.log_likelihood)),
        ("over_open_sea".to_owned(), json!(found.over_open_sea)),
        ("goodness_of_fit".to_owned(), json!(found.power)),
        ("identifiable".to_owned(), json!(found.identifiable)),
        (
            "radial_velocity_by_echo".to_owned(),
            json!(found.by_echo.map(|echo| echo[0])),
        ),
        (
            "radial_velocity_by_echo_sd".to_owned(),
            json!(found.by_echo.map(|echo| echo[1])),
        ),
    ]);
    json!({ "wakes": [wake] })
}

fn in_words(found: &Estimate) -> String {
    let verdict = match found.identifiable {
        true => "estimate",
        false => "not identifiable: no scene that was found explains the image alone",
    };
    let mut lines = vec![verdict.to_owned()];
    let shown = |e: &Estimated| match e.parameter.unit() {
        "deg" => e.value.rem_euclid(360.0),
        _ => e.value,
    };
    let values = found.values.iter();
    lines.extend(values.map(|e| line(e.parameter, Some(shown(e)), e.deviation)));
    for other in found.alternatives.iter().filter(|a| a.weight > 0.005) {
        let toward = other.scene.sea.wind_toward.rem_euclid(360.0);
        let speed = other
            .scene
            .ships
            .first()
            .map_or(f64::NAN, |ship| ship.speed);
        lines.push(format!(
            "or {speed:.2} m/s with wind toward {toward:.0} deg: probability {:.2}",
            other.weight
        ));
    }
    if let Some([velocity, deviation]) = found.by_echo {
        lines.push(format!(
            "velocity toward the radar by the echo alone: {velocity:.2} ± {deviation:.2} m/s"
        ));
    }
    lines.push(format!(
        "log-likelihood ratio to a sea without the ship: {:.0}",
        found.over_open_sea
    ));
    lines.push(format!(
        "largest misfit of the residual spectrum: factor {:.2}",
        found.misfit()
    ));
    lines.join("\n")
}
