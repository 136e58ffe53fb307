//! `wake estimate`: ship and wind of an image with error bars, and how well an image can tell them.

mod bound;
mod image;
#[cfg(feature = "train")]
mod map;

use crate::exit::{self, Outcome};
use clap::Args;
use std::path::PathBuf;
use wake_physics::Scene;
use wake_physics::estimate::{Parameter, Priors};

/// Estimate ship and wind from an image near a guess, with error bars, or print how well an image can tell them.
///
/// `--image` climbs from the guess `--scene` to the likeliest scene nearby. `--bound` needs no image: the smallest standard deviations that any unbiased
/// estimate can reach (Cramér–Rao). Without either the scene is simulated, and found again from a guess that is a little off.
#[derive(Args)]
#[command(
    after_help = "Scene keys with their units, ranges and defaults: docs/scene_keys.md\n\
                        Meaning and limits: docs/estimate.md"
)]
pub(crate) struct Arguments {
    /// Image of σ⁰ with speckle: TIFF of floats (as `wake simulate --export tiff` writes), or a Sentinel-1 product with --at
    #[arg(long, value_name = "FILE", conflicts_with = "bound")]
    image: Option<PathBuf>,
    /// First row and column of the scene's grid in the image
    #[arg(
        long,
        value_name = "ROW,COLUMN",
        value_delimiter = ',',
        num_args = 2,
        requires = "image"
    )]
    at: Option<Vec<usize>>,
    /// Print how well an image of the scene can tell ship and wind
    #[arg(long)]
    bound: bool,
    /// Draw the bound of the speed by wind and heading for seven sensors as SVG, some 13 minutes on two cores
    #[cfg(feature = "train")]
    #[arg(long, value_name = "FILE", requires = "bound", conflicts_with = "json")]
    map: Option<PathBuf>,
    /// Scene file (TOML) of pixels, radar, sea and ship: what is known, and the guess; without it the default scene on 256 x 256 pixels of 4 m
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    /// Change one value of the scene, such as radar.incidence=35; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// The brightness of the image is unknown: contrasts alone count
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
    let text = match (&arguments.image, arguments.bound) {
        (_, true) => bound::told(&scene, &priors, arguments.json)?,
        (Some(path), _) => image::read(path, arguments.at.as_deref(), &scene)
            .and_then(|field| image::told(&field, &scene, &priors, arguments.json))?,
        (None, false) => image::example(&scene, &priors, arguments.json)?,
    };
    Ok(exit::say(&text)?)
}

/// The default scene on 256 × 256 pixels of 4 m.
fn example() -> Scene {
    let mut scene = Scene::default();
    (scene.grid.rows, scene.grid.columns, scene.grid.spacing) = (256, 256, 4.0);
    scene
}

/// A value as people read it: name, number, deviation, unit.
fn line(parameter: Parameter, value: Option<f64>, deviation: f64) -> String {
    let name = parameter.name().replace('_', " ");
    let value = value.map_or(String::new(), |value| format!("{value:9.3} "));
    match deviation.is_finite() {
        true => format!("{name:<12} {value}± {deviation:.3} {}", parameter.unit())
            .trim_end()
            .to_owned(),
        false => format!("{name:<12} cannot be told"),
    }
}
