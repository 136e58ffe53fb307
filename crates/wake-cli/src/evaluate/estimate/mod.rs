//! `wake evaluate estimate`: ship and sea read from simulated images, against the scenes they were simulated from.

mod figures;
mod page;

use std::path::PathBuf;

use figures::{Case, Figures, Report};
use wake_physics::estimate::{Detection, Options as Estimation, Parameter, Value, bound, estimate};
use wake_physics::{Scene, simulate};
use wake_train::evaluation::{HeldOut, Reading};

use crate::exit::{self, Outcome};
use crate::progress;

/// Read ship and sea from simulated images that were held out, and count how often the truth lies within the error bars.
#[derive(clap::Args, Debug, Clone)]
pub(crate) struct Options {
    /// Scenes of the paper's ranges, 256 by 256 pixels of 4 m with speckle of 4 looks
    #[arg(long, default_value_t = 200)]
    count: u64,
    /// Scenes of the paper's ranges without a ship, in which nothing is to be found
    #[arg(long, default_value_t = 20)]
    empty: u64,
    /// First scene: other parts of the same scenes
    #[arg(long, default_value_t = 0)]
    first: u64,
    /// Folder of the results, made if absent
    #[arg(long, value_name = "DIR", default_value = "out/evaluate_estimate")]
    out: PathBuf,
    /// Print the report as JSON on standard output, and nothing else
    #[arg(long)]
    json: bool,
}

/// Distance by which a detection is off along each axis, at most \[m\], and within which the ship is searched.
const OFF: [f64; 2] = [40.0, 80.0];

pub(crate) fn run(options: &Options) -> Outcome<()> {
    let bar = progress::bar(options.count + options.empty, "scenes");
    let held_out = HeldOut::default();
    let mut cases = Vec::new();
    for index in options.first..options.first + options.count {
        cases.push(case(&held_out.scene(index), index)?);
        bar.inc(1);
    }
    let mut seconds: Vec<f64> = cases.iter().map(|case| case.seconds).collect();
    seconds.sort_by(f64::total_cmp);
    let (mut found, mut largest) = (0, f64::NEG_INFINITY);
    for index in 0..options.empty {
        let mut scene = held_out.scene(options.first + options.count + index);
        let ships = std::mem::take(&mut scene.ships);
        let image = simulate(&scene)?.speckled;
        scene.ships = ships;
        let read = estimate(&image, &hidden(&scene), &detection(index))?;
        found += u64::from(read.wake.is_some());
        largest = largest.max(read.above_sea);
        bar.inc(1);
    }
    bar.finish_and_clear();
    let report = Report {
        ranges: Figures::of(&cases),
        empty: [options.empty, found],
        largest_of_empty: largest,
        seconds: seconds.get(seconds.len() / 2).copied().unwrap_or(f64::NAN),
    };
    whole_files::make_folder(&options.out)?;
    let text = page::page(&report);
    whole_files::write_json(&options.out.join("report.json"), &report)?;
    whole_files::write_atomically(&options.out.join("report.md"), text.as_bytes())?;
    let text = match options.json {
        true => serde_json::to_string_pretty(&report)?,
        false => format!("{text}\nwritten to {}", options.out.display()),
    };
    Ok(exit::say(&text)?)
}

/// A detection that is off the true ship.
fn detection(index: u64) -> Estimation {
    // Equidistributed over the square of what detections are off.
    let part = |factor: f64| 2.0 * (factor * (index + 1) as f64).fract() - 1.0;
    Estimation {
        detection: Some(Detection {
            position: [0.754_877_666, 0.569_840_291].map(|f| OFF[0] * part(f)),
            within: OFF[1],
            heading: None,
        }),
        ..Estimation::default()
    }
}

/// A scene without the values that are estimated; the length is a start.
fn hidden(scene: &Scene) -> Scene {
    let mut known = scene.clone();
    for value in [
        Value::Speed,
        Value::Heading,
        Value::X,
        Value::Y,
        Value::WindSpeed,
        Value::WindToward,
    ] {
        value.set(&mut known, value.of(&Scene::default()));
    }
    // Another sea than that of the image.
    known.seed ^= 1 << 40;
    known
}

/// One scene, simulated and read.
fn case(scene: &Scene, index: u64) -> Outcome<Case> {
    let image = simulate(scene)?.speckled;
    let options = detection(index);
    let known = hidden(scene);
    let clock = std::time::Instant::now();
    let found = estimate(&image, &known, &options)?;
    let seconds = clock.elapsed().as_secs_f64();
    Ok(Case {
        bound: bound(scene, &Parameter::OF_WAKE, &options.priors)?,
        measured: Reading::of_speckled(&image, scene)?,
        scene: scene.clone(),
        found: found.wake,
        seconds,
    })
}
