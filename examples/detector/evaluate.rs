//! `evaluate`: how well wakes are found in simulated images that were held out, and in real tiles.

use std::error::Error;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use rayon::prelude::*;
use serde_json::json;
use wake_detector::drawing::{Drawing, sheet};
use wake_detector::score::{Found, Judged, Label, Ray, Rule, found_by};
use wake_detector::train::{FOUND, Recipe, Sample};
use wake_detector::{Detection, Detector, GreyImage, Wake};

use super::detect::Finder;
use super::report::{FALSE_ALARMS, Report};
use super::{exit, labels, progress, real_sea};

#[derive(clap::Args, Debug, Clone)]
pub(crate) struct Options {
    /// Simulated images of each recipe
    #[arg(long, default_value_t = 500, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    images: u32,
    /// Folder of real tiles with labels.json, which are then searched, too
    #[arg(long, value_name = "DIR")]
    real: Option<PathBuf>,
    /// Weights of the network, by default those in the repository
    #[arg(long, value_name = "FILE")]
    weights: Option<PathBuf>,
    /// Weights of another run, as a row of the table of what transfer needs; may be repeated
    #[arg(long, value_name = "NAME=FILE", value_parser = rung)]
    rung: Vec<(String, PathBuf)>,
    /// flex, ndarray, wgpu or cuda, where compiled in
    #[arg(long, default_value = "flex")]
    device: String,
    /// Folder of the results, made if absent
    #[arg(long, value_name = "DIR", default_value = "out/detector")]
    out: PathBuf,
}

/// A name and a file.
fn rung(text: &str) -> Result<(String, PathBuf), String> {
    match text.split_once('=') {
        Some((name, file)) if !name.is_empty() && !file.is_empty() => {
            Ok((name.to_owned(), PathBuf::from(file)))
        }
        _ => Err("expected NAME=FILE".to_owned()),
    }
}

/// Seed of held-out images: no run trains on it.
pub(crate) const HELD_OUT: u64 = 900_001;
/// Rows and columns of a simulated image.
pub(crate) const SIZE: usize = 512;
/// Scores below this are no part of any curve.
const LEAST_SCORE: f32 = 0.01;
/// Images searched at a time.
const AT_ONCE: u64 = 16;
/// Contrast from which on a simulated wake is clear \[dB\].
const CLEAR: f64 = 1.0;
/// Bounds of the visibility of wakes that are counted together \[dB\]: contrast of simulated ones, signal over noise of
/// painted ones.
const CONTRASTS: [f64; 7] = [0.0, 0.25, 0.5, 1.0, 2.0, 4.0, 20.0];
const SIGNALS: [f64; 7] = [15.0, 18.0, 21.0, 24.0, 28.0, 32.0, 40.0];

/// Searches, and writes `report.md`, `report.json` and pictures into the folder.
pub(crate) fn evaluate(options: &Options) -> Result<(), Box<dyn Error>> {
    let network =
        |weights: Option<&Path>| Finder::network(weights, &options.device, LEAST_SCORE, None);
    let mut finders = vec![
        ("network", network(options.weights.as_deref())?),
        ("Radon", Finder::Radon),
    ];
    for (name, file) in &options.rung {
        finders.push((name, network(Some(file))?));
    }
    let mut real = Vec::new();
    let mut sea = Vec::new();
    if let Some(folder) = &options.real {
        let clear = labels::read(folder, false)?;
        let both = labels::read(folder, true)?;
        let names: Vec<String> = clear.iter().map(|(name, _)| name.clone()).collect();
        sea = real_sea::windows(folder, &names)?;
        for ((name, clear), (_, both)) in clear.into_iter().zip(both) {
            real.push((GreyImage::read(&folder.join(&name))?, [clear, both]));
        }
    }
    std::fs::create_dir_all(&options.out)
        .map_err(|error| format!("cannot make {}: {error}", options.out.display()))?;
    let mut report = Report {
        rungs: options.rung.iter().map(|(name, _)| name.clone()).collect(),
        ..Report::default()
    };
    for recipe in [Recipe::Detector, Recipe::Painted] {
        simulated(&finders, recipe, options, &mut report)?;
    }
    for (name, finder) in &finders {
        if !real.is_empty() {
            judge_real(name, finder, &real, &options.out, &mut report)?;
        }
    }
    if !sea.is_empty() {
        report.sea = real_sea::told_apart(&sea)?;
    }
    let write = |name: &str, text: String| {
        let path = options.out.join(name);
        std::fs::write(&path, text)
            .map_err(|error| format!("cannot write {}: {error}", path.display()))
    };
    write(
        "report.json",
        format!("{:#}\n", json!({"rows": report.rows, "sea": report.sea})),
    )?;
    write("report.md", report.text())?;
    exit::say(&report.text())?;
    Ok(())
}

/// A wake as the rules see it.
fn label(wake: &Wake) -> Label {
    let inside = wake
        .tip
        .iter()
        .all(|x| (-0.5..SIZE as f32 - 0.5).contains(x));
    Label {
        ray: Ray::from(wake),
        length: f64::from(wake.length),
        counts: wake.snr >= FOUND && inside,
        ambiguous: !inside,
    }
}

fn simulated(
    finders: &[(&str, Finder)],
    recipe: Recipe,
    options: &Options,
    report: &mut Report,
) -> Result<(), Box<dyn Error>> {
    let source = recipe.source(HELD_OUT, SIZE)?;
    let mut judged = vec![Vec::new(); finders.len()];
    let mut pictures = Vec::new();
    let mut wakes: Vec<Vec<Wake>> = Vec::new();
    let mut seconds = 0.0;
    let count = u64::from(options.images);
    let bar = progress::bar(count, recipe.name());
    for first in (0..count).step_by(AT_ONCE as usize) {
        let pairs = source.items(first..count.min(first + AT_ONCE))?;
        let samples: Vec<Sample> = pairs.iter().map(Sample::of_pair).collect();
        let images: Vec<GreyImage> = samples.iter().map(Sample::image).collect();
        if first == 0 {
            // Alone, for its time.
            let begin = Instant::now();
            for image in &images {
                finders[0].1.find(image);
            }
            seconds = begin.elapsed().as_secs_f64() / images.len() as f64;
        }
        let find = |image: &GreyImage| -> Vec<Vec<Detection>> {
            let all = finders.par_iter().map(|(_, finder)| finder.find(image));
            all.collect()
        };
        let found_in: Vec<Vec<Vec<Detection>>> = images.par_iter().map(find).collect();
        for ((image, sample), detections) in images.iter().zip(samples).zip(found_in) {
            if pictures.len() < PICTURES {
                pictures.push(picture(image, &sample.wakes, &detections[0]));
            }
            for (detections, judged) in detections.iter().zip(&mut judged) {
                judged.push(Judged {
                    columns: SIZE as f64,
                    rows: SIZE as f64,
                    labels: sample.wakes.iter().map(label).collect(),
                    found: detections.iter().map(Found::from).collect(),
                });
            }
            wakes.push(sample.wakes);
            bar.inc(1);
        }
    }
    bar.finish_and_clear();
    for ((name, _), judged) in finders.iter().zip(&judged) {
        report.add(recipe.name(), name, judged);
        if recipe == Recipe::Detector {
            let set = format!("{}, above {CLEAR:.0} dB", recipe.name());
            report.add(&set, name, &clear(judged, &wakes));
        }
    }
    let judged: Vec<(&str, Vec<Judged>)> =
        finders.iter().map(|(name, _)| *name).zip(judged).collect();
    report
        .visibility
        .push(by_visibility(recipe, &judged, &wakes));
    let megapixels = (SIZE * SIZE) as f64 * 1e-6;
    println!(
        "{}: {:.2} megapixels a second",
        recipe.name(),
        megapixels / seconds
    );
    let path = options.out.join(format!("{}.png", recipe.name()));
    sheet(&pictures, 4).save(path)?;
    Ok(())
}

/// Images drawn of each recipe.
const PICTURES: usize = 24;

/// The same with all but the clear wakes ignored.
fn clear(images: &[Judged], wakes: &[Vec<Wake>]) -> Vec<Judged> {
    let mut images = images.to_vec();
    for (image, wakes) in images.iter_mut().zip(wakes) {
        for (label, wake) in image.labels.iter_mut().zip(wakes) {
            label.counts &= wake.contrast_db.is_some_and(|db| f64::from(db) > CLEAR);
        }
    }
    images
}

/// A table of recall by visibility, at the score that allows half a false alarm an image.
fn by_visibility(recipe: Recipe, judged: &[(&str, Vec<Judged>)], wakes: &[Vec<Wake>]) -> String {
    let (bounds, what) = match recipe {
        Recipe::Painted => (SIGNALS, "signal over noise"),
        _ => (CONTRASTS, "contrast"),
    };
    let decibel = |wake: &Wake| match (recipe, wake.contrast_db) {
        (Recipe::Painted, _) | (_, None) => 20.0 * f64::from(wake.snr).log10(),
        (_, Some(db)) => f64::from(db),
    };
    let mut text = format!("\n| {}, {what} \\[dB\\] |", recipe.name());
    for bound in bounds.windows(2) {
        // Writing into a string cannot fail.
        let _ = write!(text, " {} to {} |", bound[0], bound[1]);
    }
    text += "\n| --- |";
    text += &" --- |".repeat(bounds.len() - 1);
    text.push('\n');
    for (name, images) in judged {
        let value = |image: usize, label: usize| decibel(&wakes[image][label]);
        let counts = found_by(images, Rule::Ray, FALSE_ALARMS, &bounds, value);
        let _ = write!(text, "| {name} |");
        for [right, all] in counts {
            let _ = match all {
                0 => write!(text, " – |"),
                _ => write!(text, " {:.2} of {all} |", right as f64 / all as f64),
            };
        }
        text.push('\n');
    }
    text
}

/// An image with its wakes in green and what was found in red and yellow.
pub(crate) fn picture(image: &GreyImage, wakes: &[Wake], found: &[Detection]) -> image::RgbImage {
    let mut drawing = Drawing::new(image);
    for wake in wakes.iter().filter(|wake| wake.snr >= FOUND) {
        drawing.ray(wake, [0, 200, 0]);
    }
    let sure = |one: &&Detection| one.score >= Detector::OPERATING_POINT;
    drawing.found(found.iter().filter(sure));
    drawing.into_picture()
}

fn judge_real(
    name: &str,
    finder: &Finder,
    tiles: &[(GreyImage, [Judged; 2])],
    out: &Path,
    report: &mut Report,
) -> Result<(), Box<dyn Error>> {
    let mut judged = [Vec::new(), Vec::new()];
    let mut pictures = Vec::new();
    let found_in = tiles.par_iter().map(|(image, _)| finder.find(image));
    let found_in: Vec<Vec<Detection>> = found_in.collect();
    for ((image, known), detections) in tiles.iter().zip(found_in) {
        for (judged, known) in judged.iter_mut().zip(known) {
            judged.push(Judged {
                found: detections.iter().map(Found::from).collect(),
                ..known.clone()
            });
        }
        let labels: Vec<Wake> = known[1]
            .labels
            .iter()
            .filter(|label| label.counts)
            .map(|label| Wake {
                tip: label.ray.tip.map(|x| x as f32),
                axis_deg: label.ray.axis_deg as f32,
                half_angle_deg: 0.0,
                length: label.length as f32,
                snr: f32::INFINITY,
                contrast_db: None,
            })
            .collect();
        pictures.push(picture(image, &labels, &detections));
    }
    let [clear, both] = judged;
    report.add("real, clear wakes", name, &clear);
    report.add("real, clear and probable wakes", name, &both);
    for (i, picture) in pictures.iter().enumerate() {
        picture.save(out.join(format!("real-{}-{:02}.png", name.to_lowercase(), i + 1)))?;
    }
    Ok(())
}
