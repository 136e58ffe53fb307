//! `wake evaluate estimate`: ship and sea read from simulated images, against the scenes they were simulated from.

mod figures;
mod page;

use std::path::PathBuf;

use figures::{Case, Figures};
use serde::Serialize;
use wake_dataset::Recipe;
use wake_physics::estimate::{Detection, Options as Estimation, Parameter, Value, bound, estimate};
use wake_physics::{Scene, simulate};
use wake_train::evaluation::{Reading, held_out};

use crate::exit::{self, Outcome};
use crate::progress;

/// Read ship and sea from simulated images that were held out, and count how often the truth lies within the error bars.
#[derive(clap::Args, Debug, Clone)]
pub(crate) struct Options {
    /// Scenes of the paper's ranges, 256 by 256 pixels of 4 m with speckle of 4 looks
    #[arg(long, default_value_t = 200)]
    count: u64,
    /// Scenes of the recipe `detector` with one ship
    #[arg(long, default_value_t = 100)]
    detector: u64,
    /// Scenes of the paper's ranges without a ship, in which nothing is to be found
    #[arg(long, default_value_t = 50)]
    empty: u64,
    /// Folder of the results, made if absent
    #[arg(long, value_name = "DIR", default_value = "out/evaluate_estimate")]
    out: PathBuf,
    /// Print the report as JSON on standard output, and nothing else
    #[arg(long)]
    json: bool,
}

/// Seed of the scenes of the recipe: no data set begins there.
const SEED: u64 = 900_002;

/// Distance by which a detection is off along each axis, at most \[m\], and within which the ship is looked for.
const OFF: [f64; 2] = [40.0, 80.0];

/// Everything that `report.json` holds.
#[derive(Debug, Serialize)]
pub(crate) struct Report {
    pub(crate) ranges: Figures,
    pub(crate) detector: Figures,
    /// Scenes without a ship, and how many of them gave a wake.
    pub(crate) empty: [u64; 2],
    /// Median seconds of an estimate.
    pub(crate) seconds: f64,
}

pub(crate) fn run(options: &Options) -> Outcome<()> {
    let total = options.count + options.detector + options.empty;
    let bar = progress::bar(total, "scenes");
    let mut cases = Vec::new();
    for index in 0..options.count {
        cases.push(case(&held_out(index), index)?);
        bar.inc(1);
    }
    let mut seconds: Vec<f64> = cases.iter().map(|case| case.seconds).collect();
    seconds.sort_by(f64::total_cmp);
    let ranges = Figures::of(&cases);
    let mut others = Vec::new();
    let scenes = wake_dataset::Simulated::new(Recipe::detector()?, SEED)?;
    let mut index = 0;
    while (others.len() as u64) < options.detector {
        let mut scene = scenes.scene(index)?;
        index += 1;
        // One wake in the middle of the image, as a detector would cut it out.
        if scene.ships.len() != 1 || scene.ships[0].turn_rate != 0.0 {
            continue;
        }
        scene.ships[0].position = [0.0; 2];
        others.push(case(&scene, index)?);
        bar.inc(1);
    }
    let mut found = 0;
    for index in 0..options.empty {
        let mut scene = held_out(options.count + index);
        let ships = std::mem::take(&mut scene.ships);
        let image = simulate(&scene)?.speckled;
        scene.ships = ships;
        let read = estimate(&image, &scene, &detection(index))?;
        found += u64::from(!read.wakes.is_empty());
        bar.inc(1);
    }
    bar.finish_and_clear();
    let report = Report {
        ranges,
        detector: Figures::of(&others),
        empty: [options.empty, found],
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

/// One scene, simulated and read.
fn case(scene: &Scene, index: u64) -> Outcome<Case> {
    let image = simulate(scene)?.speckled;
    let options = detection(index);
    // What is estimated is hidden; the length is a start.
    let mut known = scene.clone();
    for value in [
        Value::Speed,
        Value::Heading,
        Value::WindSpeed,
        Value::WindToward,
    ] {
        value.set(&mut known, value.of(&Scene::default()));
    }
    let clock = std::time::Instant::now();
    let found = estimate(&image, &known, &options)?;
    let seconds = clock.elapsed().as_secs_f64();
    Ok(Case {
        bound: bound(scene, &Parameter::OF_WAKE, &options.priors)?,
        measured: Reading::of(&image, scene)?,
        scene: scene.clone(),
        found: found.wakes.into_iter().next(),
        seconds,
    })
}
