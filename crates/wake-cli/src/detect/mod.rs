//! `wake detect`: detects wakes in images, draws them and prints them as text or JSON; maps those of satellite
//! products.

mod arguments;
mod product;
mod sure;

use std::fmt::Write;
use std::path::{Path, PathBuf};

use indicatif::ProgressBar;
use serde_json::{Map, Value, json};
use wake_detector::drawing::Drawing;
use wake_detector::{Detection, Finder, GreyImage, Radon, image_files, image_name, picture_name};
use whole_files::make_folder;

use crate::exit::{self, Outcome};
use crate::{named, picture, progress};
pub(crate) use arguments::Arguments;
use arguments::Method;
use sure::how_sure;

/// Prints tip, axis and length of every sure wake, and draws the wakes of `NAME` into `NAME.wakes.png` in `--out`;
/// `--json` prints all detections. Files of a folder that cannot be read are reported, and the others are searched.
pub(crate) fn run(arguments: &Arguments) -> Outcome<()> {
    if let [path] = &arguments.images[..]
        && let Some(found) = product::opened(path, &arguments.product)?
    {
        arguments.check(true)?;
        return product::run(&found, arguments);
    }
    arguments.check(false)?;
    let files = image_files(&arguments.images)?;
    let finder = finder(arguments)?;
    let bar = progress::bar(files.len() as u64, "images");
    let mut told = Told::default();
    let searched = search(&files, finder.as_ref(), arguments, &mut told, &bar);
    bar.finish_and_clear();
    // Prints also if the search ended early: the results so far.
    if arguments.json && !told.images.is_empty() {
        let told = json!({ "images": told.images, "unread": told.unread });
        exit::say(&format!("{told:#}"))?;
    }
    searched?;
    match told.unread.len() {
        0 => Ok(()),
        count => Err(format!(
            "{count} of {} images could not be read; see the errors above",
            files.len()
        )
        .into()),
    }
}

fn finder(arguments: &Arguments) -> Outcome<Box<dyn Finder>> {
    match arguments.method {
        Method::Radon => Ok(Box::new(Radon)),
        Method::Network => {
            let weights = arguments.weights.as_deref();
            let detector = named::network(weights, &arguments.device, arguments.least_score())?;
            Ok(Box::new(match arguments.spacing {
                Some(metres) => detector.with_spacing(metres)?,
                None => detector,
            }))
        }
    }
}

/// Results by image name.
#[derive(Default)]
struct Told {
    /// The wakes of each image.
    images: Map<String, Value>,
    /// Reasons why images were not read.
    unread: Map<String, Value>,
}

/// Searches and draws all files that can be read. An unreadable file is an error if it is the only one; otherwise it is
/// noted.
fn search(
    files: &[PathBuf],
    finder: &dyn Finder,
    arguments: &Arguments,
    told: &mut Told,
    bar: &ProgressBar,
) -> Outcome<()> {
    for file in files {
        let name = image_name(file);
        bar.inc(1);
        let image = match GreyImage::read(file) {
            Ok(image) => image,
            Err(error) if files.len() == 1 => return Err(error.into()),
            Err(error) => {
                bar.suspend(|| exit::note(&format!("error: {error}")));
                told.unread.insert(name, error.to_string().into());
                continue;
            }
        };
        // An unreadable image leaves no folder behind.
        if told.images.is_empty() {
            make_folder(&arguments.out)?;
        }
        let found = finder.find(&image);
        draw(&image, &found, arguments, file)?;
        if !arguments.json {
            bar.suspend(|| exit::say(&summary(&name, &found)))?;
        }
        told.images
            .insert(name, found.iter().map(as_json).collect());
    }
    Ok(())
}

fn draw(image: &GreyImage, found: &[Detection], arguments: &Arguments, file: &Path) -> Outcome<()> {
    let mut drawing = Drawing::new(image);
    drawing.found(found.iter().filter(|one| one.sure));
    let path = arguments.out.join(picture_name(file));
    picture::write(&drawing.into_picture(), &path)
}

/// The sure wakes of an image, a line each.
fn summary(name: &str, found: &[Detection]) -> String {
    let sure: Vec<&Detection> = found.iter().filter(|one| one.sure).collect();
    let mut text = format!("{name}: {} wakes", sure.len());
    for one in sure {
        let (wake, [column, row]) = (&one.wake, one.wake.tip);
        // Writing into a string cannot fail.
        let _ = write!(
            text,
            "\n  {}, tip ({column:.0}, {row:.0}), axis {:.0} deg, {:.0} px long",
            how_sure(one.probability.map(f64::from), f64::from(one.score)),
            wake.axis_deg,
            wake.length
        );
    }
    text
}

/// A detection as printed JSON.
fn as_json(one: &Detection) -> Value {
    json!({
        "probability": one.probability,
        "sure": one.sure,
        "score": one.score,
        "direction_probability": one.direction_probability,
        "tip": one.wake.tip,
        "axis_deg": one.wake.axis_deg,
        "half_angle_deg": one.wake.half_angle_deg,
        "length_px": one.wake.length,
        "length_sd_px": one.extent.map(|extent| extent.deviation),
        "oriented_box": one.wake.oriented_box(),
    })
}
