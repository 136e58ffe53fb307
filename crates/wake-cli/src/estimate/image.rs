//! Input images and results of an estimate, as text, JSON and picture.

use super::line::line;
use crate::exit::Outcome;
use crate::sheet::Picture;
use image::{ImageDecoder, ImageReader};
use safetensors::{Dtype, SafeTensors};
use serde_json::{Map, Value, json};
use std::path::Path;
use wake_geo::Product;
use wake_physics::estimate::{Estimate, Estimated, Sighting};
use wake_physics::grey::GreyScale;
use wake_physics::{Field, Scene};

/// Errors of position \[m\] and heading \[deg\] of the sighting in the example.
const OFF: ([f64; 2], f64) = ([40.0, -30.0], 2.0);

/// Reads the pixels that the grid of a scene covers.
///
/// - `at`: row and column in the image of the grid's first pixel
/// - `grey`: meaning of the levels of a picture
pub(super) fn read(
    path: &Path,
    at: Option<[usize; 2]>,
    grey: Option<&GreyScale>,
    scene: &Scene,
) -> Outcome<Field> {
    let asked = (scene.grid.rows, scene.grid.columns);
    if path.extension().is_some_and(|e| e == "safetensors") {
        let field = speckled(path)?;
        let [row, column] = first(at, (field.rows, field.columns), asked)?;
        return part(&field, [row, column], asked);
    }
    let product = Product::open(path)?;
    let [row, column] = first(at, product.size(), asked)?;
    let end = |first: usize, count: usize| first..first.saturating_add(count);
    let window = product.read_window(end(row, asked.0), end(column, asked.1))?;
    let mut field = Field {
        rows: asked.0,
        columns: asked.1,
        values: window.values,
    };
    if let Some(grey) = grey {
        let white = white(path)?;
        for value in &mut field.values {
            *value = grey.sigma0(f64::from(*value) / white) as f32;
        }
    }
    Ok(field)
}

/// Row and column of the grid's first pixel.
fn first(
    at: Option<[usize; 2]>,
    (lines, pixels): (usize, usize),
    (rows, columns): (usize, usize),
) -> Outcome<[usize; 2]> {
    match at {
        Some(first) => Ok(first),
        None if (lines, pixels) == (rows, columns) => Ok([0, 0]),
        None => Err(format!(
            "--image has {lines} x {pixels} pixels, but the scene's grid has {rows} x {columns}; give its first row and column \
             with --at"
        )
        .into()),
    }
}

/// Cuts a part out of a field.
fn part(
    field: &Field,
    [row, column]: [usize; 2],
    (rows, columns): (usize, usize),
) -> Outcome<Field> {
    let inside = |first: usize, count: usize, of: usize| {
        first.checked_add(count).is_some_and(|end| end <= of)
    };
    if !inside(row, rows, field.rows) || !inside(column, columns, field.columns) {
        return Err(format!(
            "--at {row},{column}: the grid of {rows} x {columns} pixels exceeds the image of {} x {}; choose a smaller row or column",
            field.rows, field.columns
        )
        .into());
    }
    let lines = field.values.chunks(field.columns).skip(row).take(rows);
    Ok(Field {
        rows,
        columns,
        values: lines
            .flat_map(|line| line[column..column + columns].iter().copied())
            .collect(),
    })
}

/// Reads the image with speckle from a file of `wake simulate`.
fn speckled(path: &Path) -> Outcome<Field> {
    let bytes = whole_files::read_bytes(path)?;
    let refused = |why: &str| {
        format!(
            "{}: {why}; give fields.safetensors of `wake simulate`",
            path.display()
        )
    };
    let tensors = SafeTensors::deserialize(&bytes).map_err(|error| refused(&error.to_string()))?;
    let tensor = tensors
        .tensor("speckled")
        .map_err(|_| refused("it has no tensor `speckled`"))?;
    let (&[rows, columns], Dtype::F32) = (tensor.shape(), tensor.dtype()) else {
        return Err(refused("`speckled` is not an image of 32-bit numbers").into());
    };
    let values = tensor.data().as_chunks().0.iter().copied();
    Ok(Field {
        rows,
        columns,
        values: values.map(f32::from_le_bytes).collect(),
    })
}

/// Level of white in an image of 8 or 16 bits.
fn white(path: &Path) -> Outcome<f64> {
    let colour = ImageReader::open(path)?
        .with_guessed_format()?
        .into_decoder()?
        .color_type();
    Ok(match colour.bytes_per_pixel() / colour.channel_count() {
        1 => 255.0,
        2 => 65_535.0,
        _ => {
            return Err(format!(
                "{}: --grey applies to images of 8 or 16 bits only; leave it out",
                path.display()
            )
            .into());
        }
    })
}

/// Adds errors of position and heading to a sighting.
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

/// Estimate as JSON or text, with the prompt of the estimated scene.
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
        false => "not identifiable: no single scene explains the image",
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
            "velocity toward the radar from the echo alone: {velocity:.2} ± {deviation:.2} m/s"
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

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;
    use wake_physics::grey::Mapping;
    use wake_physics::output::{write_fields, write_png};

    /// Windows are read from fields and pictures; files of another kind cause an error that names the right kind.
    #[test]
    fn windows_are_those_of_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let levels: Vec<u8> = (0..30).map(|n| 8 * n).collect();
        let grey = GreyScale {
            darkest_db: -30.0,
            brightest_db: -5.0,
            mapping: Mapping::Decibel,
        };
        let sigma0 = levels.iter().map(|&l| grey.sigma0_of_level(l) as f32);
        let field = Field {
            rows: 5,
            columns: 6,
            values: sigma0.collect(),
        };
        write_fields(&at("a.safetensors"), &[("speckled", &field)], None).unwrap();
        write_png(&at("a.png"), &levels, 5, 6).unwrap();
        let mut scene = Scene::default();
        (scene.grid.rows, scene.grid.columns) = (2, 3);
        let expected: Vec<f32> = [8, 9, 10, 14, 15, 16].map(|n| field.values[n]).to_vec();
        for (name, grey) in [("a.safetensors", None), ("a.png", Some(&grey))] {
            let found = read(&at(name), Some([1, 2]), grey, &scene).unwrap();
            let pairs = found.values.iter().zip(&expected);
            // 8-bit grey reproduces the values of its levels.
            assert!(
                pairs.clone().all(|(a, b)| (a / b - 1.0).abs() < 1e-5),
                "{name}"
            );
            assert_eq!((found.rows, found.columns, found.values.len()), (2, 3, 6));
            let all = read(&at(name), None, grey, &scene).unwrap_err().to_string();
            assert!(all.contains("--at") && all.contains("5 x 6"), "{all}");
            assert!(read(&at(name), Some([4, 0]), grey, &scene).is_err());
        }
        write_fields(&at("b.safetensors"), &[("sigma0", &field)], None).unwrap();
        std::fs::write(at("c.safetensors"), b"no tensors").unwrap();
        for name in ["b.safetensors", "c.safetensors"] {
            let error = read(&at(name), Some([0, 0]), None, &scene)
                .unwrap_err()
                .to_string();
            assert!(
                error.contains(name) && error.contains("wake simulate"),
                "{error}"
            );
        }
    }
}
