//! `detect`: searches images, draws them with their wakes, and tells them as JSON.

use std::error::Error;
use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};
use wake_detector::drawing::Drawing;
use wake_detector::{Detection, Detector, Finder, GreyImage, image_files};

use super::{exit, named, progress};

/// How wakes are looked for.
#[derive(clap::ValueEnum, Debug, Clone, Copy, PartialEq, Eq)]
enum Method {
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
    #[arg(long, value_parser = named::spacing)]
    spacing: Option<f32>,
    /// How wakes are looked for
    #[arg(long, value_enum, default_value_t = Method::Network)]
    method: Method,
    /// Weights of the network, by default those in the repository
    #[arg(long, value_name = "FILE")]
    weights: Option<PathBuf>,
    /// Least score that is told, 0 to 1; from 0.25 on there are few false alarms
    #[arg(long, default_value_t = 0.03, value_parser = named::score)]
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

pub(crate) fn detect(options: &Options) -> Result<(), Box<dyn Error>> {
    let files = image_files(&options.images)?;
    let finder = match options.method {
        Method::Radon => Finder::Radon,
        Method::Network => {
            let weights = options.weights.as_deref();
            let detector = named::network(weights, &options.device, options.least_score)?;
            Finder::from(match options.spacing {
                Some(metres) => detector.with_spacing(metres)?,
                None => detector,
            })
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
    let sure = || {
        let sure = |one: &&Detection| one.score >= Detector::OPERATING_POINT;
        found.iter().filter(sure)
    };
    println!("{name}: {} wakes", sure().count());
    for one in sure() {
        let (wake, [column, row]) = (&one.wake, one.wake.tip);
        println!(
            "  score {:.2}, tip ({column:.0}, {row:.0}), axis {:.0} deg, {:.0} px long",
            one.score, wake.axis_deg, wake.length
        );
    }
}

/// A detection as the program prints it.
fn as_json(one: &Detection) -> Value {
    json!({
        "score": one.score,
        "tip": one.wake.tip,
        "axis_deg": one.wake.axis_deg,
        "half_angle_deg": one.wake.half_angle_deg,
        "length_px": one.wake.length,
        "oriented_box": one.wake.oriented_box(),
    })
}
