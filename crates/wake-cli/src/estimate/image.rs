//! Ship and wind of an image, as text and JSON.

use super::line;
use crate::exit::Outcome;
use serde_json::{Map, Value, json};
use std::path::Path;
use wake_geo::Product;
use wake_physics::estimate::{Estimate, Estimated, Priors, refine};
use wake_physics::{Field, Scene, simulate};

/// Relative change of the speed and turn of the heading \[deg\] of the guess in the example.
const OFF: (f64, f64) = (0.005, 0.5);

/// Reads the pixels of a scene's grid.
///
/// - `at`: row and column of the first in the image
pub(super) fn read(path: &Path, at: Option<&[usize]>, scene: &Scene) -> Outcome<Field> {
    let product = Product::open(path)?;
    let (rows, columns) = (scene.grid.rows, scene.grid.columns);
    let [row, column] = match at {
        Some(&[row, column]) => [row, column],
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

/// A simulated image of the scene, found again.
pub(super) fn example(scene: &Scene, priors: &Priors, as_json: bool) -> Outcome<String> {
    let image = simulate(scene)?.speckled;
    let mut guess = scene.clone();
    for ship in &mut guess.ships {
        ship.speed *= 1.0 + OFF.0;
        ship.heading += OFF.1;
    }
    told(&image, &guess, priors, as_json)
}

pub(super) fn told(
    image: &Field,
    guess: &Scene,
    priors: &Priors,
    as_json: bool,
) -> Outcome<String> {
    let found = refine(image, guess, priors)?;
    Ok(match as_json {
        true => format!("{:#}", in_json(&found)),
        false => in_words(&found),
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
    ]);
    json!({ "wakes": [wake] })
}

fn in_words(found: &Estimate) -> String {
    let verdict = match found.identifiable {
        true => "the scene nearby explains the image",
        false => "not identifiable: the likeliest scene nearby, and what speaks against it, below",
    };
    let mut lines = vec![verdict.to_owned()];
    let shown = |e: &Estimated| match e.parameter.unit() {
        "deg" => e.value.rem_euclid(360.0),
        _ => e.value,
    };
    let values = found.values.iter();
    lines.extend(values.map(|e| line(e.parameter, Some(shown(e)), e.deviation)));
    for other in &found.alternatives {
        let toward = other.scene.sea.wind_toward.rem_euclid(360.0);
        lines.push(format!(
            "or a wind toward {toward:.0} deg, with a probability of {:.2}",
            other.weight
        ));
    }
    lines.push(format!(
        "ln likelihood {:.0} above that of a sea without the ship",
        found.over_open_sea
    ));
    lines.push(format!(
        "residual {:.2} times that of the model at most, by length of the waves",
        found.misfit()
    ));
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use wake_physics::estimate::Parameter;

    #[test]
    fn units_are_those_of_the_parameters() {
        let text = line(Parameter::Size, Some(195.0), 1.5);
        assert_eq!(text, "length         195.000 ± 1.500 m");
        let unknown = line(Parameter::Texture, Some(0.0), f64::INFINITY);
        assert_eq!(unknown, "texture      cannot be told");
    }
}
