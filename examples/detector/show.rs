//! Without a command: wakes are found in a few simulated images, which are drawn.

use std::error::Error;
use std::path::Path;

use wake_detector::Detector;
use wake_detector::drawing::sheet;
use wake_detector::judging::compared;
use wake_detector::train::{Recipe, Sample};
use wake_ldm::device_named;
use wake_physics::output::make_folder;

use super::evaluate::{HELD_OUT, SIZE};
use super::{exit, picture, progress};

/// Images that are shown.
const COUNT: u64 = 8;

/// Draws simulated images with their wakes (green) and what is found (red to yellow) into `simulated.png`.
pub(crate) fn show(out: &Path) -> Result<(), Box<dyn Error>> {
    let detector = Detector::pretrained(&device_named("flex")?)?;
    make_folder(out)?;
    let source = Recipe::Detector.source(HELD_OUT, SIZE)?;
    let bar = progress::bar(COUNT, "images");
    let mut pictures = Vec::new();
    for index in 0..COUNT {
        let pair = &source.items(index..index + 1)?[0];
        let sample = Sample::of_pair(pair);
        let image = sample.image();
        let found = detector.find(&image);
        let (wakes, count) = (sample.wakes.len(), found.len());
        let line = format!("image {index}: {wakes} wakes, {count} found");
        bar.suspend(|| exit::say(&line))?;
        pictures.push(compared(&image, &sample.wakes, &found));
        bar.inc(1);
    }
    bar.finish_and_clear();
    let path = out.join("simulated.png");
    picture::write(&sheet(&pictures, 4), &path)?;
    Ok(exit::say(&format!(
        "wakes in green, what was found in red to yellow: {}",
        path.display()
    ))?)
}
