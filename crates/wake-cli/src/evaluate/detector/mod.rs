//! `wake evaluate detector`: evaluates detectors on held-out simulated images and on real tiles.

mod plot;
pub(crate) mod real;
pub(crate) mod real_sea;
mod recall;
mod report;

use std::path::{Path, PathBuf};

use image::RgbImage;
use wake_detector::drawing::sheet;
use wake_detector::{Finder, Radon};
use wake_train::detector::judging::{Searched, Tile, compared};
use wake_train::detector::{ImageRecipe, Painted};

use crate::exit::{self, Outcome};
use crate::{named, picture, progress};
use real_sea::HELD_OUT;
use recall::{by_kind, by_scene, by_visibility};
use report::Report;

/// Evaluate the detector on held-out simulated images and on real tiles.
#[derive(clap::Args, Debug, Clone)]
pub(crate) struct Options {
    /// Number of simulated images per recipe
    #[arg(long, default_value_t = 500, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    images: u32,
    /// Also search the real tiles in this folder, which has labels.json
    #[arg(long, value_name = "DIR")]
    real: Option<PathBuf>,
    /// Weights of the network [default: the shipped weights]
    #[arg(long, value_name = "FILE")]
    weights: Option<PathBuf>,
    /// Weights of another training, as a row of the transfer table; may be repeated
    #[arg(long, value_name = "NAME=FILE", value_parser = rung)]
    rung: Vec<(String, PathBuf)>,
    /// Leave-one-out trainings: evaluate each TILE with DIR/TILE/detector.safetensors; may be repeated
    #[arg(long, value_name = "NAME=DIR", value_parser = rung, requires = "real")]
    left_out: Vec<(String, PathBuf)>,
    /// Device: flex, ndarray, wgpu or cuda, if compiled in
    #[arg(long, default_value = "flex")]
    device: String,
    /// Folder for the results, created if absent
    #[arg(long, value_name = "DIR", default_value = "out/evaluate_detector")]
    out: PathBuf,
}

/// Parses a name and a path.
fn rung(text: &str) -> Result<(String, PathBuf), String> {
    match text.split_once('=') {
        Some((name, file))
            if !name.is_empty() && !name.contains(['/', '\\', ',']) && !file.is_empty() =>
        {
            Ok((name.to_owned(), PathBuf::from(file)))
        }
        _ => Err("expected NAME=FILE, with a NAME without slashes and commas".to_owned()),
    }
}

/// Rows and columns of a simulated image.
pub(crate) const SIZE: usize = 512;
/// Detections with lower scores are not part of any curve.
const LEAST_SCORE: f32 = 0.01;
/// Contrast above which a simulated wake is clear \[dB\].
const CLEAR: f64 = 1.0;
/// Number of pictures per recipe.
const PICTURES: usize = 24;

/// Searches, and writes `report.md`, `report.json`, `recall.csv`, plots and pictures into the folder.
pub(crate) fn run(options: &Options) -> Outcome<()> {
    let network = |weights: Option<&Path>| -> Outcome<Box<dyn Finder>> {
        let detector = named::network(weights, &options.device, LEAST_SCORE)?;
        Ok(Box::new(detector))
    };
    let mut finders: Vec<(&str, Box<dyn Finder>)> = vec![
        ("network", network(options.weights.as_deref())?),
        ("Radon", Box::new(Radon)),
    ];
    for (name, file) in &options.rung {
        // File names of pictures contain these names in lower case.
        if finders
            .iter()
            .any(|(other, _)| other.eq_ignore_ascii_case(name))
        {
            return Err(format!(
                "--rung {name}: another detector has this name; choose another one"
            )
            .into());
        }
        finders.push((name, network(Some(file))?));
    }
    let (tiles, sea) = match &options.real {
        None => (Vec::new(), Vec::new()),
        Some(folder) => {
            let tiles = real::tiles(folder)?;
            let sea = real_sea::windows(folder, &tiles)?;
            (tiles, sea)
        }
    };
    // One network per tile, read before the search begins.
    let mut left_out: Vec<(&str, Vec<Box<dyn Finder>>)> = Vec::new();
    for (name, runs) in &options.left_out {
        let of_tile = |tile: &Tile| {
            let folder = runs.join(Path::new(&tile.name).with_extension(""));
            network(Some(&folder.join("detector.safetensors")))
        };
        left_out.push((name, tiles.iter().map(of_tile).collect::<Outcome<_>>()?));
    }
    whole_files::make_folder(&options.out)?;
    let mut report = Report {
        rungs: options.rung.iter().map(|(name, _)| name.clone()).collect(),
        left_out: options
            .left_out
            .iter()
            .map(|(name, _)| name.clone())
            .collect(),
        ..Report::default()
    };
    let mut speeds = String::new();
    for recipe in [
        ImageRecipe::Satellites,
        ImageRecipe::Detector,
        ImageRecipe::Painted,
    ] {
        speeds.push_str(&simulated(&finders, recipe, options, &mut report)?);
    }
    for (name, finder) in &finders {
        if !tiles.is_empty() {
            real::judge(name, |_| finder.as_ref(), &tiles, &options.out, &mut report)?;
        }
    }
    for (name, finders) in &left_out {
        let finder = |n: usize| finders[n].as_ref();
        real::judge(name, finder, &tiles, &options.out, &mut report)?;
    }
    if !sea.is_empty() {
        report.sea = real_sea::told_apart(&sea)?;
    }
    report.write(&options.out)?;
    Ok(exit::say(&format!("{speeds}{}", report.text()))?)
}

/// Adds the rows of a recipe and draws its first images; returns a line with the speed of the search.
fn simulated(
    finders: &[(&str, Box<dyn Finder>)],
    recipe: ImageRecipe,
    options: &Options,
    report: &mut Report,
) -> Outcome<String> {
    let source = recipe.source(HELD_OUT, SIZE, &wake_nn::device_named(&options.device)?)?;
    let count = u64::from(options.images);
    let bar = progress::bar(count, recipe.name());
    let mut pictures: Vec<RgbImage> = Vec::new();
    let all: Vec<&dyn Finder> = finders.iter().map(|(_, f)| f.as_ref()).collect();
    let searched = Searched::of(source.as_ref(), count, &all, |image, wakes, found| {
        if pictures.len() < PICTURES {
            pictures.push(compared(image, wakes, &found[0]));
        }
        bar.inc(1);
    })?;
    bar.finish_and_clear();
    for (number, (name, _)) in finders.iter().enumerate() {
        report.add(recipe.name(), name, &searched.judged[number]);
        if recipe != ImageRecipe::Painted {
            let set = format!("{}, above {CLEAR:.0} dB", recipe.name());
            report.add(&set, name, &searched.clear(number, CLEAR));
        }
    }
    let names: Vec<&str> = finders.iter().map(|(name, _)| *name).collect();
    let by_visibility = by_visibility(recipe, &names, &searched);
    report.visibility.add(&by_visibility);
    if recipe == ImageRecipe::Detector {
        report.scenes = by_scene(recipe, &names, &searched);
    }
    if recipe == ImageRecipe::Painted {
        let painted = Painted {
            seed: HELD_OUT,
            size: SIZE,
        };
        report.kinds = by_kind(painted, &names, &searched);
    }
    let megapixels = (SIZE * SIZE) as f64 * 1e-6;
    let path = options.out.join(format!("{}.png", recipe.name()));
    picture::write(&sheet(&pictures, 4), &path)?;
    let speed = megapixels / searched.seconds;
    Ok(format!(
        "{}: {speed:.2} megapixels a second\n",
        recipe.name()
    ))
}
