//! `wake estimate --bound`: how well an image can tell ship and wind.

use crate::exit::{self, Outcome};
use clap::Args;
use serde_json::{Map, Value, json};
use std::path::PathBuf;
use wake_physics::Scene;
use wake_physics::estimate::{Bound, Parameter, Priors, bound};

/// Print how well an image of a scene can tell ship and wind, before there is an image.
///
/// The smallest standard deviations that any unbiased estimate can reach (Cramér–Rao), for the scene's sea, ship, pixels and radar.
#[derive(Args)]
#[command(
    after_help = "Scene keys with their units, ranges and defaults: docs/scene_keys.md\n\
                        Meaning and limits: docs/estimate.md"
)]
pub(crate) struct Arguments {
    /// Print the bound of the scene's values
    #[arg(long, required = true)]
    bound: bool,
    /// Scene file (TOML) of ship, sea, pixels and radar; without it the default scene on 256 x 256 pixels of 4 m
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    /// Change one value of the scene, such as radar.incidence=35; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// The brightness of the image is unknown: contrasts alone count
    #[arg(long)]
    uncalibrated: bool,
    /// Print the bound as JSON on standard output, and nothing else
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
    // Scenes without a ship tell of the wind.
    let parameters: Vec<Parameter> = Parameter::OF_WAKE
        .into_iter()
        .filter(|p| !scene.ships.is_empty() || !p.is_of_ship())
        .collect();
    let found = bound(&scene, &parameters, &priors)?;
    let text = match arguments.json {
        true => format!("{:#}", as_json(&found)),
        false => as_text(&found),
    };
    Ok(exit::say(&text)?)
}

/// The default scene on 256 × 256 pixels of 4 m.
fn example() -> Scene {
    let mut scene = Scene::default();
    (scene.grid.rows, scene.grid.columns, scene.grid.spacing) = (256, 256, 4.0);
    scene
}

/// Values that are not told have null.
fn as_json(bound: &Bound) -> Value {
    let deviations = bound.deviations.iter();
    let deviations: Map<String, Value> = deviations
        .map(|(parameter, deviation)| (format!("{}_sd", parameter.name()), json!(deviation)))
        .collect();
    json!({ "bound": deviations, "wake_to_noise": bound.wake_to_noise })
}

fn as_text(bound: &Bound) -> String {
    let mut lines = vec!["smallest standard deviations that an estimate can reach".to_owned()];
    for (parameter, deviation) in &bound.deviations {
        let name = parameter.name().replace('_', " ");
        lines.push(match deviation.is_finite() {
            true => format!("{name:<12} ± {deviation:.3} {}", parameter.unit())
                .trim_end()
                .to_owned(),
            false => format!("{name:<12} cannot be told"),
        });
    }
    lines.push(format!(
        "the wake is {:.1} standard deviations of a matched filter above sea and speckle",
        bound.wake_to_noise.sqrt()
    ));
    lines.join("\n")
}
