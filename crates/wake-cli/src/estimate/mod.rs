//! `wake estimate`: from the image of a wake back to ship and sea.

mod arguments;
mod read;
mod words;

pub(crate) use arguments::Arguments;

use crate::exit::{self, Outcome};
use crate::sheet::Picture;
use wake_physics::estimate::{Detection, Estimate, Options, Parameter, Priors, bound, estimate};
use wake_physics::grey::GreyScale;
use wake_physics::{Field, Raster, Scene, simulate};

/// Pixels of a picture along its longer side.
const SIDE: usize = 512;

/// Writes `estimate.json`, `estimate.toml` (the scene of the estimate) and `estimate.png` (image, fitted image, residual), and
/// prints the estimate; with `--bound` prints the Cramér–Rao bound.
pub(crate) fn run(arguments: &Arguments) -> Outcome<()> {
    let mut known = match &arguments.scene {
        Some(file) => Scene::read(file)?,
        None => example(),
    }
    .with_assignments(&arguments.set)?;
    let mut options = Options::default();
    if arguments.uncalibrated {
        options.priors.gain = f64::INFINITY;
    }
    if arguments.bound {
        return print_bound(&known, &options.priors, arguments.json);
    }
    let image = match &arguments.image {
        Some(path) => {
            let (image, calibrated) = read::intensity(path, arguments.grey)?;
            (known.grid.rows, known.grid.columns) = (image.rows, image.columns);
            if !calibrated {
                options.priors.gain = f64::INFINITY;
            }
            image
        }
        None => simulate(&known)?.speckled,
    };
    let truth = arguments.image.is_none().then(|| words::of_scene(&known));
    options.detection = detection(arguments, &known);
    // Images of the calibration have another sea than the image of the example.
    known.seed = known.seed.wrapping_add(1);
    let found = estimate(&image, &known, &options)?;
    // A scene beyond what a prompt can say has none.
    let sentence = found
        .wake
        .as_ref()
        .and_then(|_| wake_text::prompt(&rounded(&found.scene)).ok());
    let json = words::as_json(&found, sentence.as_deref());
    let out = &arguments.out;
    whole_files::make_folder(out)?;
    whole_files::write_json(&out.join("estimate.json"), &json)?;
    whole_files::write_atomically(
        &out.join("estimate.toml"),
        found.scene.to_toml()?.as_bytes(),
    )?;
    sheet(&image, &found).write(&out.join("estimate.png"))?;
    if arguments.json {
        exit::say(&format!("{json:#}"))?;
    } else {
        let text = words::as_text(&found, sentence.as_deref());
        let truth = truth.map_or_else(String::new, |truth| format!("{truth}\n"));
        exit::say(&format!("{truth}{text}\nwritten to {}", out.display()))?;
    }
    Ok(())
}

/// The default scene on 256 × 256 pixels of 4 m.
fn example() -> Scene {
    let mut scene = Scene::default();
    (scene.grid.rows, scene.grid.columns, scene.grid.spacing) = (256, 256, 4.0);
    scene
}

fn print_bound(scene: &Scene, priors: &Priors, json: bool) -> Outcome<()> {
    let found = bound(scene, &Parameter::OF_WAKE, priors)?;
    let text = match json {
        true => format!("{:#}", words::bound_as_json(&found)),
        false => words::bound_as_text(&found),
    };
    Ok(exit::say(&text)?)
}

/// Where the ship is searched.
fn detection(arguments: &Arguments, scene: &Scene) -> Option<Detection> {
    let grid = &scene.grid;
    let raster = Raster::image(grid.rows, grid.columns, grid.spacing);
    let length = scene.ships.first().map_or(0.0, |ship| ship.length);
    match arguments.tip.as_deref() {
        Some([column, row]) => Some(Detection {
            position: [
                (column - raster.origin_column as f64) * grid.spacing,
                (raster.origin_row as f64 - row) * grid.spacing,
            ],
            // Midship is half a length behind the tip.
            within: arguments.within + 0.5 * length,
            heading: arguments.heading,
        }),
        _ => arguments.heading.map(|heading| Detection {
            position: [0.0; 2],
            within: f64::INFINITY,
            heading: Some(heading),
        }),
    }
}

/// A scene with values as exact as prompts state them.
fn rounded(scene: &Scene) -> Scene {
    let tenth = |v: f64| (10.0 * v).round() / 10.0;
    let mut scene = scene.clone();
    for ship in &mut scene.ships {
        (ship.speed, ship.heading) = (tenth(ship.speed), ship.heading.round().rem_euclid(360.0));
    }
    scene.sea.wind_speed = tenth(scene.sea.wind_speed);
    scene.sea.wind_toward = scene.sea.wind_toward.round().rem_euclid(360.0);
    scene.sea.fetch = scene.sea.fetch.round();
    scene.radar.incidence = scene.radar.incidence.round();
    scene
}

/// Image, fitted image and residual side by side, the first two in one grey.
fn sheet(image: &Field, found: &Estimate) -> Picture {
    let grey = GreyScale::amplitude_around(image.mean().max(1e-9));
    let of = |field: &Field, level: &dyn Fn(f32) -> u8, name: &str| {
        let levels: Vec<u8> = field.values.iter().map(|&v| level(v)).collect();
        Picture::reduced(&levels, field.columns, SIDE).captioned(name)
    };
    let amplitude = |v: f32| grey.level(f64::from(v));
    let pairs = image.values.iter().zip(&found.expected.values);
    let residual = Field {
        values: pairs
            .map(|(i, m)| i / m.max(f32::MIN_POSITIVE) - 1.0)
            .collect(),
        ..*image
    };
    // Two deviations of four looks fill the greys.
    let relative = |v: f32| (127.5 + 127.5 * v).clamp(0.0, 255.0) as u8;
    Picture::sheet(
        &[
            of(image, &amplitude, "image"),
            of(&found.expected, &amplitude, "fit"),
            of(&residual, &relative, "residual"),
        ],
        3,
    )
}
