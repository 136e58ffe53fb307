//! `wake evaluate calibration`: fits and checks probabilities for the detector's scores, on images that no training
//! uses.

mod report;

use std::path::PathBuf;

use wake_detector::calibration::{Beta, Probabilities};
use wake_detector::{Calibration, Detection, Detector};
use wake_nn::device_named;
use wake_physics::Scene;
use wake_train::detector::ImageRecipe;
use wake_train::detector::judging::{DetectionOutcome, EmptySea, KnownImages, Spacing, score_for};

use super::detector::{SIZE, real, real_sea::HELD_OUT};
use crate::exit::{self, Outcome};
use crate::progress;
use report::{Check, Mode, Report};

/// Fit probabilities to the detector's scores, and check them on other images.
#[derive(clap::Args, Debug, Clone)]
pub(crate) struct Options {
    /// Number of images per recipe for the fit, and of images of sea without ships
    #[arg(long, default_value_t = 1000, value_parser = clap::value_parser!(u32).range(100..=100_000))]
    images: u32,
    /// Number of images per recipe for the check
    #[arg(long, default_value_t = 500, value_parser = clap::value_parser!(u32).range(100..=100_000))]
    checked: u32,
    /// Largest rate of false alarms of sure detections, per 1,000 km² of simulated sea without ships
    #[arg(long, default_value_t = FALSE_ALARMS)]
    false_alarms: f64,
    /// Also search the real tiles in this folder, which has labels.json
    #[arg(long, value_name = "DIR")]
    real: Option<PathBuf>,
    /// Weights of the network, beside which the calibration is written as well [default: the shipped weights]
    #[arg(long, value_name = "FILE")]
    weights: Option<PathBuf>,
    /// Device: flex, ndarray, wgpu or cuda, if compiled in
    #[arg(long, default_value = "flex")]
    device: String,
    /// Folder for the results, created if absent
    #[arg(long, value_name = "DIR", default_value = "out/calibration")]
    out: PathBuf,
}

/// Seeds of the images for the fit and of the sea without ships, which no training uses.
const FITTED: u64 = 900_101;
const EMPTY: u64 = 900_201;
/// Default rate of false alarms of sure detections per 1,000 km²: chosen.
const FALSE_ALARMS: f64 = 1.0;
/// Detections with lower scores are not part of any figure.
const LEAST_SCORE: f32 = 0.01;
/// Spacing with which painted images are searched \[m\]; their speckle resembles speckle in pixels of ten metres.
const PAINTED: f32 = 10.0;

/// Writes `detector.calibration.json`, `report.md` and `report.json` into the folder.
pub(crate) fn run(options: &Options) -> Outcome<()> {
    let device = device_named(&options.device)?;
    let weights = options.weights.as_deref();
    let detector = Detector::uncalibrated(weights, &device)?.with_least_score(LEAST_SCORE)?;
    let tiles = options.real.as_deref().map(real::tiles).transpose()?;
    whole_files::make_folder(&options.out)?;
    let counts = [options.images, options.checked].map(u64::from);
    let [fitted, checked] = [(FITTED, counts[0]), (HELD_OUT, counts[1])];
    let fitted = recipes(&detector, fitted, &options.device)?;
    let checked = recipes(&detector, checked, &options.device)?;
    let source = ImageRecipe::empty_sea(EMPTY, SIZE)?;
    let bar = progress::bar(counts[0], "sea without ships");
    let told: [&Spacing<'_>; 2] = [&known, &unknown];
    let empty = KnownImages::search(source.as_ref(), counts[0], &detector, &told, |n| bar.inc(n))?;
    bar.finish_and_clear();
    let mut modes = Vec::new();
    for (k, name) in ["known", "unknown"].into_iter().enumerate() {
        let outcomes = |sets: &[Vec<KnownImages>]| -> Vec<Vec<DetectionOutcome>> {
            sets.iter().map(|set| set[k].outcomes()).collect()
        };
        let probabilities = fit(&outcomes(&fitted).concat(), &empty[k], options.false_alarms);
        let mut checks = Vec::new();
        for (recipe, outcomes) in RECIPES.iter().zip(outcomes(&checked)) {
            checks.push(Check::of(recipe.name(), &probabilities, &outcomes));
        }
        modes.push(Mode::of(
            name,
            probabilities,
            checks,
            &empty[k],
            &checked.iter().map(|set| &set[k]).collect::<Vec<_>>(),
        ));
    }
    let mut report = Report {
        images: counts[0],
        checked: counts[1],
        false_alarms: options.false_alarms,
        weights: detector.weights_checksum().to_owned(),
        modes,
        tiles: None,
    };
    if let Some(tiles) = &tiles {
        let found: Vec<Vec<Detection>> = tiles
            .iter()
            .map(|tile| detector.find(&tile.image))
            .collect();
        report.check_tiles(tiles, &found);
    }
    report.write(&options.out, &calibration(&report), weights)?;
    Ok(exit::say(&format!(
        "{}\nwritten to {}",
        report.text(),
        options.out.display()
    ))?)
}

/// Recipes for the fit, with equal numbers of images.
const RECIPES: [ImageRecipe; 2] = [ImageRecipe::Detector, ImageRecipe::Painted];

/// Searches images of each recipe, with known and with unknown spacing.
fn recipes(
    detector: &Detector,
    (seed, count): (u64, u64),
    device: &str,
) -> Outcome<Vec<Vec<KnownImages>>> {
    let mut all = Vec::new();
    for recipe in RECIPES {
        let source = recipe.source(seed, SIZE, &device_named(device)?)?;
        let bar = progress::bar(count, recipe.name());
        let painted = |_: &Scene| Some(PAINTED);
        let told: [&Spacing<'_>; 2] = match recipe {
            ImageRecipe::Painted => [&painted, &unknown],
            _ => [&known, &unknown],
        };
        all.push(KnownImages::search(
            source.as_ref(),
            count,
            detector,
            &told,
            |n| bar.inc(n),
        )?);
        bar.finish_and_clear();
    }
    Ok(all)
}

fn known(scene: &Scene) -> Option<f32> {
    Some(scene.grid.spacing as f32)
}

fn unknown(_: &Scene) -> Option<f32> {
    None
}

/// Fits the probabilities by maximum likelihood, and finds the score with the given rate of false alarms per 1,000 km²
/// of sea.
fn fit(outcomes: &[DetectionOutcome], empty: &KnownImages, false_alarms: f64) -> Probabilities {
    let scores: Vec<(f64, bool)> = outcomes.iter().map(report::by_score).collect();
    let directions: Vec<(f64, bool)> = outcomes.iter().filter_map(report::by_direction).collect();
    let sure_from = score_for(&empty.scenes, &empty.found, false_alarms, LEAST_SCORE);
    Probabilities {
        wake: Beta::fit(&scores),
        direction: Beta::fit(&directions),
        sure_from,
        false_alarms: EmptySea::count(&empty.scenes, &empty.found, sure_from, |_| true).rate(),
    }
}

fn calibration(report: &Report) -> Calibration {
    Calibration {
        weights: report.weights.clone(),
        known_spacing: report.modes[0].probabilities,
        unknown_spacing: report.modes[1].probabilities,
    }
}
