//! `wake estimate`: estimates ship and wind from an image with error bars, and computes how well an image can determine
//! them.

mod bound;
mod image;
mod line;
#[cfg(feature = "train")]
mod map;

use crate::exit::{self, Outcome};
use clap::Args;
use std::path::PathBuf;
use wake_physics::estimate::{Priors, Sighting, estimate};
use wake_physics::grey::{GreyScale, Mapping};
use wake_physics::{Scene, simulate};

/// Estimate ship and wind from an image of a wake, with error bars.
///
/// With --image, searches for the ship within about 150 m and 7 degrees of place and heading in --scene, at any speed
/// from 3.5 to 17 m/s, by maximum likelihood. With --bound, prints the smallest standard deviations of any unbiased
/// estimate (Cramér–Rao bound) and needs no image. Without either, simulates the scene and estimates it, starting from
/// a wrong place and heading.
#[derive(Args)]
#[command(
    after_help = "Scene keys with their units, ranges and defaults: docs/scene_keys.md\n\
                        Meaning and limits: docs/estimate.md"
)]
pub(crate) struct Arguments {
    /// Image of σ⁰ with speckle: fields.safetensors of `wake simulate`, TIFF of floats, grey PNG or TIFF with --grey,
    /// or a Sentinel-1 product with --at
    #[arg(long, value_name = "FILE", conflicts_with = "bound")]
    image: Option<PathBuf>,
    /// Row and column in the image of the first pixel of the scene's grid
    #[arg(long, value_name = "ROW,COLUMN", value_parser = row_and_column, requires = "image")]
    at: Option<[usize; 2]>,
    /// σ⁰ of black and white in an image of grey levels (dB), such as -25,-3; levels are linear in amplitude, or linear
    /// in decibels with a third word `decibel`
    #[arg(long, value_name = "BLACK,WHITE", value_parser = grey, requires = "image", allow_hyphen_values = true)]
    grey: Option<GreyScale>,
    /// Write the image, the mean image of the estimate and their ratio as a PNG
    #[arg(long, value_name = "FILE", conflicts_with = "bound")]
    picture: Option<PathBuf>,
    /// Print the Cramér–Rao bounds of ship and wind for an image of the scene
    #[arg(long)]
    bound: bool,
    /// Draw the speed bound by wind and heading for seven sensors as an SVG (about 10 minutes on two cores)
    #[cfg(feature = "train")]
    #[arg(long, value_name = "FILE", requires = "bound", conflicts_with = "json")]
    map: Option<PathBuf>,
    /// Scene file (TOML) with the known values, and place and heading of the ship [default: the default scene on 256 x
    /// 256 pixels of 4 m]
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    /// Set one value of the scene, such as radar.incidence=35; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Treat the brightness of the image as unknown and use only contrasts
    #[arg(long)]
    uncalibrated: bool,
    /// Print the result as JSON on standard output, and nothing else
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Outcome<()> {
    let scene = match &arguments.scene {
        Some(file) => Scene::read(file)?,
        None => example(),
    }
    .with_assignments(&arguments.set)?;
    let mut priors = Priors::default();
    if arguments.uncalibrated {
        priors.gain = f64::INFINITY;
    }
    #[cfg(feature = "train")]
    if let Some(path) = &arguments.map {
        return map::draw(path, &scene, &priors);
    }
    let text = match arguments.bound {
        true => bound::told(&scene, &priors, arguments.json)?,
        false => {
            let sighting = Sighting::of_ship(&scene);
            let sighting =
                sighting.ok_or("the scene has no ship; set ship.position and ship.heading")?;
            let (field, sighting) = match &arguments.image {
                Some(path) => {
                    let field = image::read(path, arguments.at, arguments.grey.as_ref(), &scene)?;
                    (field, sighting)
                }
                None => (simulate(&scene)?.speckled, image::mistaken(&sighting)),
            };
            let found = estimate(&field, &scene, &sighting, &priors)?;
            if let Some(path) = &arguments.picture {
                image::draw(path, &field, &found)?;
            }
            image::told(&found, arguments.json)?
        }
    };
    Ok(exit::say(&text)?)
}

/// The default scene on 256 × 256 pixels of 4 m.
fn example() -> Scene {
    let mut scene = Scene::default();
    (scene.grid.rows, scene.grid.columns, scene.grid.spacing) = (256, 256, 4.0);
    scene
}

/// Parses two levels in decibels, and optionally the mapping between them.
fn grey(text: &str) -> Result<GreyScale, String> {
    let parts: Vec<&str> = text.split(',').map(str::trim).collect();
    let mapping = match parts.get(2) {
        None | Some(&"amplitude") => Mapping::Amplitude,
        Some(&"decibel") => Mapping::Decibel,
        Some(other) => {
            return Err(format!(
                "mapping is '{other}', expected amplitude or decibel"
            ));
        }
    };
    let number = |n: usize| parts.get(n).and_then(|part| part.parse().ok());
    let (Some(darkest_db), Some(brightest_db), true) = (number(0), number(1), parts.len() < 4)
    else {
        return Err("expected two levels in dB, such as -25,-3".to_owned());
    };
    let grey = GreyScale {
        darkest_db,
        brightest_db,
        mapping,
    };
    grey.validate().map_err(|error| error.to_string())?;
    Ok(grey)
}

/// Parses two numbers separated by a comma.
fn row_and_column(text: &str) -> Result<[usize; 2], String> {
    let pair = text.split_once(',');
    let numbers = pair.map(|(row, column)| (row.trim().parse(), column.trim().parse()));
    match numbers {
        Some((Ok(row), Ok(column))) => Ok([row, column]),
        _ => Err("expected two whole numbers, such as 1200,3400".to_owned()),
    }
}
