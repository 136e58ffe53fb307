//! An estimate in words and as JSON.

use serde_json::{Value, json};
use wake_physics::Scene;
use wake_physics::estimate::{Bound, Estimate, Fitted, Wake};

/// The estimate as JSON, with the prompt that describes its scene.
pub(crate) fn as_json(estimate: &Estimate, sentence: Option<&str>) -> Value {
    let wakes: Vec<Value> = estimate
        .wake
        .iter()
        .map(|wake| of_wake(wake, sentence))
        .collect();
    json!({ "wakes": wakes, "above_sea": estimate.above_sea })
}

fn of_wake(wake: &Wake, sentence: Option<&str>) -> Value {
    json!({
        "tip": wake.tip,
        "position": wake.position.map(|v| v.value),
        "position_sd": wake.position.map(|v| v.deviation),
        "heading": wake.heading.value,
        "heading_sd": wake.heading.deviation,
        "speed": wake.speed.value,
        "speed_sd": wake.speed.deviation,
        "length": wake.length.value,
        "length_sd": wake.length.deviation,
        "wind_speed": wake.wind_speed.value,
        "wind_speed_sd": wake.wind_speed.deviation,
        "wind_toward": wake.wind_toward.value,
        "wind_toward_sd": wake.wind_toward.deviation,
        "names": wake.names,
        "covariance": wake.covariance,
        "log_likelihood": wake.log_likelihood,
        "identifiable": wake.identifiable,
        "alternatives": wake.alternatives,
        "goodness_of_fit": wake.goodness_of_fit,
        "sentence": sentence,
    })
}

/// The values of a simulated scene that are estimated.
pub(crate) fn of_scene(scene: &Scene) -> String {
    let sea = &scene.sea;
    let ships = scene.ships.iter().map(|ship| {
        format!(
            "heading {:.1} deg, speed {:.2} m/s, midship {:.1}, {:.1} m, length {:.0} m, ",
            ship.heading, ship.speed, ship.position[0], ship.position[1], ship.length
        )
    });
    format!(
        "simulated     {}wind {:.2} m/s toward {:.1} deg",
        ships.collect::<String>(),
        sea.wind_speed,
        sea.wind_toward
    )
}

/// The estimate in a few lines.
pub(crate) fn as_text(estimate: &Estimate, sentence: Option<&str>) -> String {
    let Some(wake) = &estimate.wake else {
        return format!(
            "no wake stands out of sea and speckle (ln likelihood ratio {:.1})",
            estimate.above_sea
        );
    };
    let mut lines = vec![
        format!("heading       {}", with(wake.heading, 1, "deg")),
        format!(
            "speed         {} (through the water)",
            with(wake.speed, 2, "m/s")
        ),
        format!("midship x     {}", with(wake.position[0], 1, "m")),
        format!("midship y     {}", with(wake.position[1], 1, "m")),
        format!(
            "length        {} (beam and draft in proportion)",
            with(wake.length, 0, "m")
        ),
        format!("wind speed    {}", with(wake.wind_speed, 2, "m/s")),
        format!("wind toward   {}", with(wake.wind_toward, 1, "deg")),
    ];
    if !wake.identifiable {
        lines.push("not identifiable: do not use these values".to_owned());
    }
    for other in &wake.alternatives {
        lines.push(format!(
            "or, with probability {:.3}: heading {:.1} deg, speed {:.2} m/s, wind {:.1} m/s toward {:.0} deg",
            other.weight, other.heading, other.speed, other.wind_speed, other.wind_toward
        ));
    }
    if !wake.goodness_of_fit.consistent {
        lines.push(format!(
            "the scene does not explain the image: power of the residual {:.1} standard deviations off, gain {:.1}, texture {:.1}",
            wake.goodness_of_fit.largest,
            wake.goodness_of_fit.priors[0],
            wake.goodness_of_fit.priors[1]
        ));
    }
    lines.extend(sentence.map(str::to_owned));
    lines.join("\n")
}

fn with(fitted: Fitted, digits: usize, unit: &str) -> String {
    match fitted.deviation.is_finite() {
        true => format!(
            "{:.digits$} ± {:.digits$} {unit}",
            fitted.value, fitted.deviation
        ),
        false => format!(
            "{:.digits$} {unit}, not determined by the image",
            fitted.value
        ),
    }
}

/// Bounds as JSON.
pub(crate) fn bound_as_json(bound: &Bound) -> Value {
    let deviations = bound.deviations.iter();
    let deviations: serde_json::Map<String, Value> = deviations
        .map(|(parameter, deviation)| (format!("{}_sd", parameter.name()), json!(deviation)))
        .collect();
    json!({ "bound": deviations, "wake_to_noise": bound.wake_to_noise })
}

/// Bounds in a few lines.
pub(crate) fn bound_as_text(bound: &Bound) -> String {
    let mut lines = vec![format!(
        "matched filter: {:.1} deviations of the noise",
        bound.wake_to_noise.sqrt()
    )];
    for (parameter, deviation) in &bound.deviations {
        lines.push(format!("{:<12} ± {deviation:.3}", parameter.name()));
    }
    lines.join("\n")
}
