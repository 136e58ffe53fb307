//! `detect`: searches images, draws them with their wakes, and tells them as JSON.

use std::error::Error;
use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};
use wake_detector::drawing::Drawing;
use wake_detector::{Detection, Detector, GreyImage, radon};
use wake_ldm::device_named;

use super::{exit, progress};

/// How wakes are looked for.
#[derive(clap::ValueEnum, Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Method {
    /// The trained network
    Network,
    /// A normalised Radon transform around bright targets and over the whole image
    Radon,
}

#[derive(clap::Args, Debug, Clone)]
pub(crate) struct Options {
    /// Images (PNG, JPEG or TIFF, grey, 8 or 16 bits) or folders of them
    #[arg(required = true, value_name = "FILE|DIR")]
    images: Vec<PathBuf>,
    /// Pixel spacing [m]; without it the scale comes from the image
    #[arg(long, value_parser = spacing)]
    spacing: Option<f32>,
    /// How wakes are looked for
    #[arg(long, value_enum, default_value_t = Method::Network)]
    method: Method,
    /// Weights of the network, by default those in the repository
    #[arg(long, value_name = "FILE")]
    weights: Option<PathBuf>,
    /// Least score that is told, 0 to 1; from 0.25 on there are few false alarms
    #[arg(long, default_value_t = 0.03, value_parser = score)]
    least_score: f32,
    /// Print the wakes as JSON, and nothing else
    #[arg(long)]
    json: bool,
    /// flex, ndarray, wgpu or cuda, where compiled in
    #[arg(long, default_value = "flex")]
    device: String,
    /// Folder of the pictures, made if absent
    #[arg(long, value_name = "DIR", default_value = "out/detector")]
    out: PathBuf,
}

fn bounded(text: &str, low: f32, high: f32, unit: &str) -> Result<f32, String> {
    let number: f32 = text
        .parse()
        .map_err(|_| format!("give a number of {unit}"))?;
    match (low..=high).contains(&number) {
        true => Ok(number),
        false => Err(format!("it lies outside {low} to {high} {unit}")),
    }
}

fn spacing(text: &str) -> Result<f32, String> {
    bounded(text, 0.5, 100.0, "m")
}

fn score(text: &str) -> Result<f32, String> {
    bounded(text, 0.0, 1.0, "probability")
}

/// Something that finds wakes.
pub(crate) enum Finder {
    Network(Box<Detector>),
    Radon,
}

impl Finder {
    /// The network of a file, or the one that ships, which tells wakes from a score on.
    pub(crate) fn network(
        weights: Option<&Path>,
        device: &str,
        least_score: f32,
        spacing: Option<f32>,
    ) -> Result<Self, Box<dyn Error>> {
        let device = device_named(device)?;
        let detector = match weights {
            Some(file) => Detector::load(file, &device)?,
            None => Detector::pretrained(&device)?,
        };
        let detector = detector.with_least_score(least_score)?;
        Ok(Self::Network(Box::new(match spacing {
            Some(metres) => detector.with_spacing(metres)?,
            None => detector,
        })))
    }

    pub(crate) fn find(&self, image: &GreyImage) -> Vec<Detection> {
        match self {
            Self::Network(detector) => detector.find(image),
            Self::Radon => radon::find(image),
        }
    }
}

pub(crate) fn detect(options: &Options) -> Result<(), Box<dyn Error>> {
    let files = files(&options.images)?;
    let finder = match options.method {
        Method::Radon => Finder::Radon,
        Method::Network => {
            let weights = options.weights.as_deref();
            Finder::network(
                weights,
                &options.device,
                options.least_score,
                options.spacing,
            )?
        }
    };
    // What cannot be read leaves no folder behind.
    let first = GreyImage::read(&files[0])?;
    std::fs::create_dir_all(&options.out)
        .map_err(|error| format!("cannot make {}: {error}", options.out.display()))?;
    let bar = progress::bar(files.len() as u64, "images");
    let mut told = Map::new();
    let mut next = Some(first);
    for file in &files {
        let image = match next.take() {
            Some(image) => image,
            None => GreyImage::read(file)?,
        };
        let found = finder.find(&image);
        draw(&image, &found, options, file)?;
        let name = file
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        if !options.json {
            bar.suspend(|| print(&name, &found));
        }
        told.insert(name, found.iter().map(as_json).collect());
        bar.inc(1);
    }
    bar.finish_and_clear();
    let told = json!({ "images": told });
    if options.json {
        exit::say(&format!("{told:#}"))?;
    }
    Ok(())
}

/// The images of a list of files and folders, in order.
fn files(paths: &[PathBuf]) -> Result<Vec<PathBuf>, String> {
    let mut files = Vec::new();
    for path in paths {
        if !path.is_dir() {
            files.push(path.clone());
            continue;
        }
        let unreadable = |error| format!("cannot read {}: {error}", path.display());
        let mut found = Vec::new();
        for entry in std::fs::read_dir(path).map_err(unreadable)? {
            let file = entry.map_err(unreadable)?.path();
            let kind = file
                .extension()
                .unwrap_or_default()
                .to_string_lossy()
                .to_lowercase();
            if ["png", "jpg", "jpeg", "tif", "tiff"].contains(&kind.as_str()) {
                found.push(file);
            }
        }
        if found.is_empty() {
            return Err(format!(
                "{} holds no PNG, JPEG or TIFF file; name another folder",
                path.display()
            ));
        }
        found.sort();
        files.extend(found);
    }
    let mut names: Vec<_> = files.iter().map(|file| file.file_name()).collect();
    names.sort();
    match names.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => Err(format!(
            "two images are called {:?}; search them one after the other",
            pair[0].unwrap_or_default()
        )),
        None => Ok(files),
    }
}

fn draw(
    image: &GreyImage,
    found: &[Detection],
    options: &Options,
    file: &Path,
) -> Result<(), Box<dyn Error>> {
    let mut drawing = Drawing::new(image);
    // Radon's score has no upper end; all that it tells is above its threshold.
    let sure = |one: &&Detection| {
        options.method == Method::Radon || one.score >= Detector::OPERATING_POINT
    };
    drawing.found(found.iter().filter(sure));
    let name = file.file_stem().unwrap_or_default().to_string_lossy();
    let path = options.out.join(format!("{name}.wakes.png"));
    drawing
        .into_picture()
        .save(&path)
        .map_err(|error| format!("cannot write {}: {error}", path.display()))?;
    Ok(())
}

fn print(name: &str, found: &[Detection]) {
    println!(
        "{name}: {} wakes",
        found
            .iter()
            .filter(|one| one.score >= Detector::OPERATING_POINT)
            .count()
    );
    for one in found
        .iter()
        .filter(|one| one.score >= Detector::OPERATING_POINT)
    {
        let (wake, [column, row]) = (&one.wake, one.wake.tip);
        println!(
            "  score {:.2}, tip ({column:.0}, {row:.0}), axis {:.0} deg, {:.0} px long",
            one.score, wake.axis_deg, wake.length
        );
    }
}

/// A detection as the program prints it.
pub(crate) fn as_json(one: &Detection) -> Value {
    json!({
        "score": one.score,
        "tip": one.wake.tip,
        "axis_deg": one.wake.axis_deg,
        "half_angle_deg": one.wake.half_angle_deg,
        "length_px": one.wake.length,
        "oriented_box": one.wake.oriented_box(),
    })
}
