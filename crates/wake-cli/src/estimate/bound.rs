//! Cramér–Rao bounds of ship and wind, as text and JSON.

use super::line::line;
use crate::exit::Outcome;
use serde_json::{Map, Value, json};
use wake_physics::Scene;
use wake_physics::estimate::{Bound, Parameter, Priors, bound};

pub(super) fn told(scene: &Scene, priors: &Priors, as_json: bool) -> Outcome<String> {
    // Without a ship, only the wind is estimated.
    let parameters: Vec<Parameter> = Parameter::OF_WAKE
        .into_iter()
        .filter(|p| !scene.ships.is_empty() || !p.is_of_ship())
        .collect();
    let found = bound(scene, &parameters, priors)?;
    Ok(match as_json {
        true => format!("{:#}", in_json(&found)),
        false => in_words(&found),
    })
}

/// The bounds as JSON; values that cannot be estimated are null.
fn in_json(bound: &Bound) -> Value {
    let deviations = bound.deviations.iter();
    let deviations: Map<String, Value> = deviations
        .map(|(parameter, deviation)| (format!("{}_sd", parameter.name()), json!(deviation)))
        .collect();
    json!({ "bound": deviations, "wake_to_noise": bound.wake_to_noise })
}

fn in_words(bound: &Bound) -> String {
    let mut lines = vec!["smallest standard deviations that an estimate can reach".to_owned()];
    let deviations = bound.deviations.iter();
    lines.extend(deviations.map(|(parameter, deviation)| line(*parameter, None, *deviation)));
    lines.push(format!(
        "the wake is {:.1} standard deviations of a matched filter above sea and speckle",
        bound.wake_to_noise.sqrt()
    ));
    lines.join("\n")
}
