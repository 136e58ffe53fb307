//! Recall by what wakes and their scenes are like.

use std::fmt::Write;

use wake_detector::Wake;
use wake_detector::score::{Rule, found_by};
use wake_physics::Scene;
use wake_physics::scene::Sensor;
use wake_train::detector::ImageRecipe;
use wake_train::detector::judging::Searched;

use super::report::FALSE_ALARMS;

/// Bounds of the visibility of wakes that are counted together \[dB\]: contrast of simulated ones, signal over noise of
/// painted ones.
const CONTRASTS: [f64; 7] = [0.0, 0.25, 0.5, 1.0, 2.0, 4.0, 20.0];
const SIGNALS: [f64; 7] = [15.0, 18.0, 21.0, 24.0, 28.0, 32.0, 40.0];
/// Bounds of the wind \[m/s\], and of the angle between a wake and the flight \[deg\].
const WINDS: [f64; 6] = [2.0, 4.0, 6.0, 8.0, 10.0, 12.0];
const ANGLES: [f64; 4] = [0.0, 30.0, 60.0, 91.0];

/// A table of recall, at the score that allows half a false alarm an image.
///
/// - `value`: of a wake, by the numbers of its image and of the wake in it
/// - `bounds`: of the columns
fn table(
    title: &str,
    columns: &[String],
    bounds: &[f64],
    searched: (&[&str], &Searched),
    value: impl Fn(usize, usize) -> f64 + Copy,
) -> String {
    let rule = " --- |".repeat(columns.len() + 1);
    let mut text = format!("\n| {title} | {} |\n|{rule}\n", columns.join(" | "));
    let (finders, searched) = searched;
    for (name, images) in finders.iter().zip(&searched.judged) {
        // Writing into a string cannot fail.
        let _ = write!(text, "| {name} |");
        for [right, all] in found_by(images, Rule::Ray, FALSE_ALARMS, bounds, value) {
            let _ = match all {
                0 => write!(text, " – |"),
                _ => write!(text, " {:.2} of {all} |", right as f64 / all as f64),
            };
        }
        text.push('\n');
    }
    text
}

fn spans(bounds: &[f64]) -> Vec<String> {
    let pairs = bounds.windows(2);
    pairs.map(|b| format!("{} to {}", b[0], b[1])).collect()
}

/// A table of recall by visibility.
pub(crate) fn by_visibility(recipe: ImageRecipe, finders: &[&str], searched: &Searched) -> String {
    let (bounds, what) = match recipe {
        ImageRecipe::Painted => (SIGNALS, "signal over noise"),
        _ => (CONTRASTS, "contrast"),
    };
    let decibel = |wake: &Wake| match (recipe, wake.contrast_db) {
        (ImageRecipe::Painted, _) | (_, None) => 20.0 * f64::from(wake.snr).log10(),
        (_, Some(db)) => f64::from(db),
    };
    let title = format!("{}, {what} \\[dB\\]", recipe.name());
    let value = |image: usize, wake: usize| decibel(&searched.wakes[image][wake]);
    table(&title, &spans(&bounds), &bounds, (finders, searched), value)
}

/// Tables of recall by sensor, wind, and the angle between a wake and the flight of the radar, which is along the image's rows.
pub(crate) fn by_scene(recipe: ImageRecipe, finders: &[&str], searched: &Searched) -> String {
    let scene = |image: usize| -> &Scene { &searched.scenes[image] };
    let used = |sensor: &Sensor| {
        let mut scenes = searched.scenes.iter();
        scenes.any(|scene| scene.radar.sensor == Some(*sensor))
    };
    let sensors: Vec<Sensor> = Sensor::ALL.into_iter().filter(used).collect();
    let names: Vec<String> = sensors.iter().map(name).collect();
    let numbers: Vec<f64> = (0..=sensors.len()).map(|n| n as f64).collect();
    let sensor = |image: usize, _: usize| {
        let sensor = scene(image).radar.sensor;
        let number = sensors.iter().position(|&one| Some(one) == sensor);
        number.map_or(f64::NAN, |n| n as f64)
    };
    let wind = |image: usize, _: usize| scene(image).sea.wind_speed;
    let angle = |image: usize, wake: usize| {
        let axis = f64::from(searched.wakes[image][wake].axis_deg);
        axis.to_radians().cos().abs().acos().to_degrees()
    };
    let (all, title) = ((finders, searched), recipe.name());
    let mut angles = spans(&ANGLES[..3]);
    angles.push("60 to 90".to_owned());
    [
        table(&format!("{title}, sensor"), &names, &numbers, all, sensor),
        table(
            &format!("{title}, wind \\[m/s\\]"),
            &spans(&WINDS),
            &WINDS,
            all,
            wind,
        ),
        table(
            &format!("{title}, wake to flight \\[deg\\]"),
            &angles,
            &ANGLES,
            all,
            angle,
        ),
    ]
    .concat()
}

/// The name of a sensor in scene files.
fn name(sensor: &Sensor) -> String {
    let name = serde_json::to_value(sensor).ok();
    let name = name.and_then(|name| name.as_str().map(str::to_owned));
    name.unwrap_or_else(|| format!("{sensor:?}"))
}
