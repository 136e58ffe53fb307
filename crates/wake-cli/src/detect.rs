//! `wake detect`: searches images, draws them with their wakes, and tells them as JSON.

use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};
use wake_detector::drawing::Drawing;
use wake_detector::{Detection, Detector, Finder, GreyImage, image_files};

use crate::exit::{self, Outcome};
use crate::{named, progress};

/// How wakes are looked for.
#[derive(clap::ValueEnum, Debug, Clone, Copy, PartialEq, Eq)]
enum Method {
    /// The trained network
    Network,
    /// A normalised Radon transform around bright targets and over the whole image
    Radon,
}

/// Find ship wakes in radar images.
#[derive(clap::Args, Debug, Clone)]
pub(crate) struct Arguments {
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
    #[arg(long, value_name = "DIR", default_value = "out/detect")]
    out: PathBuf,
}

/// Draws each image with its wakes into `--out`, and prints every wake by tip, axis, half-angle, visible length and score.
pub(crate) fn run(arguments: &Arguments) -> Outcome<()> {
    let files = image_files(&arguments.images)?;
    let finder = match arguments.method {
        Method::Radon => Finder::Radon,
        Method::Network => {
            let weights = arguments.weights.as_deref();
            let detector = named::network(weights, &arguments.device, arguments.least_score)?;
            Finder::from(match arguments.spacing {
                Some(metres) => detector.with_spacing(metres)?,
                None => detector,
            })
        }
    };
    // What cannot be read leaves no folder behind.
    let first = GreyImage::read(&files[0])?;
    whole_files::make_folder(&arguments.out)?;
    let bar = progress::bar(files.len() as u64, "images");
    let mut told = Map::new();
    let mut next = Some(first);
    for file in &files {
        let image = match next.take() {
            Some(image) => image,
            None => GreyImage::read(file)?,
        };
        let found = finder.find(&image);
        draw(&image, &found, arguments, file)?;
        let name = file
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        if !arguments.json {
            bar.suspend(|| exit::say(&summary(&name, &found)))?;
        }
        told.insert(name, found.iter().map(as_json).collect());
        bar.inc(1);
    }
    bar.finish_and_clear();
    let told = json!({ "images": told });
    if arguments.json {
        exit::say(&format!("{told:#}"))?;
    }
    Ok(())
}

fn draw(
    image: &GreyImage,
    found: &[Detection],
    arguments: &Arguments,
    file: &Path,
) -> Outcome<()> {
    let mut drawing = Drawing::new(image);
    // Radon's score has no upper end; all that it tells is above its threshold.
    let sure = |one: &&Detection| {
        arguments.method == Method::Radon || one.score >= Detector::OPERATING_POINT
    };
    drawing.found(found.iter().filter(sure));
    let name = file.file_stem().unwrap_or_default().to_string_lossy();
    let path = arguments.out.join(format!("{name}.wakes.png"));
    drawing
        .into_picture()
        .save(&path)
        .map_err(|error| format!("cannot write {}: {error}", path.display()))?;
    Ok(())
}

/// What is said of one image.
fn summary(name: &str, found: &[Detection]) -> String {
    let sure = |one: &&Detection| one.score >= Detector::OPERATING_POINT;
    let sure: Vec<&Detection> = found.iter().filter(sure).collect();
    let mut lines = vec![format!("{name}: {} wakes", sure.len())];
    lines.extend(sure.iter().map(|one| {
        let (wake, [column, row]) = (&one.wake, one.wake.tip);
        format!(
            "  score {:.2}, tip ({column:.0}, {row:.0}), axis {:.0} deg, {:.0} px long",
            one.score, wake.axis_deg, wake.length
        )
    }));
    lines.join("\n")
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
