//! Recall by properties of wakes and scenes.

use std::fmt::Write;

use wake_detector::Wake;
use wake_detector::score::{Rule, found_by};
use wake_physics::Scene;
use wake_physics::scene::Sensor;
use wake_train::detector::judging::Searched;
use wake_train::detector::{ImageRecipe, Kind, Painted};

/// False alarms per image at which recall is reported.
pub(crate) const FALSE_ALARMS: f64 = 0.5;

/// Limits of the visibility classes of wakes \[dB\]: contrast of simulated wakes, signal-to-noise ratio of painted
/// ones.
const CONTRASTS: [f64; 7] = [0.0, 0.25, 0.5, 1.0, 2.0, 4.0, 20.0];
const SIGNALS: [f64; 7] = [15.0, 18.0, 21.0, 24.0, 28.0, 32.0, 40.0];
/// Limits of the classes of wind \[m/s\], and of the angle between wake and flight \[deg\].
const WINDS: [f64; 6] = [2.0, 4.0, 6.0, 8.0, 10.0, 12.0];
const ANGLES: [f64; 4] = [0.0, 30.0, 60.0, 91.0];

/// Number of detectors in the report: the network and the classical detector. All are in the CSV file.
const SHOWN: usize = 2;

/// Recall as Markdown tables, and as CSV lines for all detectors.
#[derive(Debug, Default)]
pub(crate) struct Recall {
    pub(crate) text: String,
    pub(crate) csv: String,
}

impl Recall {
    pub(crate) fn add(&mut self, other: &Self) {
        self.text.push_str(&other.text);
        self.csv.push_str(&other.csv);
    }
}

/// Recall at the score that allows half a false alarm per image.
///
/// - `images`, `by`: name of the recipe, and quantity of the columns with its unit
/// - `value`: value of a wake, by the numbers of its image and of the wake in it
/// - `bounds`: limits of the columns
fn table(
    [images, by]: [&str; 2],
    columns: &[String],
    bounds: &[f64],
    searched: (&[&str], &Searched),
    value: impl Fn(usize, usize) -> f64 + Copy,
) -> Recall {
    let rule = " --- |".repeat(columns.len() + 1);
    let quantity = by.replace('[', "\\[").replace(']', "\\]");
    let head = columns.join(" | ");
    let mut recall = Recall {
        text: format!("\n| {images}, {quantity} | {head} |\n|{rule}\n"),
        csv: String::new(),
    };
    let (finders, searched) = searched;
    for (number, (name, judged)) in finders.iter().zip(&searched.judged).enumerate() {
        let mut row = format!("| {name} |");
        let found = found_by(judged, Rule::Ray, FALSE_ALARMS, bounds, value);
        for ([right, all], column) in found.into_iter().zip(columns) {
            let share = right as f64 / all as f64;
            // Writing into a string cannot fail.
            let _ = match all {
                0 => write!(row, " – |"),
                _ => write!(row, " {share:.2} of {all} |"),
            };
            if all > 0 {
                let _ = writeln!(recall.csv, "{images},{by},{column},{name},{share:.2},{all}");
            }
        }
        if number < SHOWN {
            recall.text.push_str(&row);
            recall.text.push('\n');
        }
    }
    recall
}

fn spans(bounds: &[f64]) -> Vec<String> {
    let pairs = bounds.windows(2);
    pairs.map(|b| format!("{} to {}", b[0], b[1])).collect()
}

/// A table of recall by visibility.
pub(crate) fn by_visibility(recipe: ImageRecipe, finders: &[&str], searched: &Searched) -> Recall {
    let (bounds, what) = match recipe {
        ImageRecipe::Painted => (SIGNALS, "signal over noise [dB]"),
        _ => (CONTRASTS, "contrast [dB]"),
    };
    let decibel = |wake: &Wake| match (recipe, wake.contrast_db) {
        (ImageRecipe::Painted, _) | (_, None) => 20.0 * f64::from(wake.snr).log10(),
        (_, Some(db)) => f64::from(db),
    };
    let value = |image: usize, wake: usize| decibel(&searched.wakes[image][wake]);
    let title = [recipe.name(), what];
    table(title, &spans(&bounds), &bounds, (finders, searched), value)
}

/// Tables of recall by sensor, wind, and the angle between wake and flight, which is upward in the image.
pub(crate) fn by_scene(recipe: ImageRecipe, finders: &[&str], searched: &Searched) -> Recall {
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
    let (all, images) = ((finders, searched), recipe.name());
    let mut angles = spans(&ANGLES[..3]);
    angles.push("60 to 90".to_owned());
    let mut recall = table([images, "sensor"], &names, &numbers, all, sensor);
    let by_wind = table([images, "wind [m/s]"], &spans(&WINDS), &WINDS, all, wind);
    recall.add(&by_wind);
    let by_angle = table(
        [images, "wake to flight [deg]"],
        &angles,
        &ANGLES,
        all,
        angle,
    );
    recall.add(&by_angle);
    recall
}

/// A table of recall by kind of painted wakes.
pub(crate) fn by_kind(painted: Painted, finders: &[&str], searched: &Searched) -> Recall {
    let kinds: Vec<Vec<Kind>> = (0..searched.wakes.len() as u64)
        .map(|index| painted.kinds(index))
        .collect();
    let names = Kind::ALL.map(|kind| kind.name().to_owned());
    let bounds = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0];
    let value = |image: usize, wake: usize| {
        let kind = kinds[image].get(wake);
        let number = Kind::ALL.iter().position(|one| Some(one) == kind);
        number.map_or(f64::NAN, |n| n as f64)
    };
    let title = ["painted", "kind"];
    table(title, &names, &bounds, (finders, searched), value)
}

/// Name of a sensor in scene files.
fn name(sensor: &Sensor) -> String {
    let name = serde_json::to_value(sensor).ok();
    let name = name.and_then(|name| name.as_str().map(str::to_owned));
    name.unwrap_or_else(|| format!("{sensor:?}"))
}
