//! Without a command: wakes are found in a few simulated images, which are drawn.

use std::error::Error;
use std::path::Path;

use wake_detector::Detector;
use wake_detector::drawing::sheet;
use wake_detector::judging::compared;
use wake_detector::train::{Recipe, Sample};
use wake_ldm::device_named;

use super::evaluate::{HELD_OUT, SIZE};
use super::progress;

/// Images that are shown.
const COUNT: u64 = 8;

/// Draws simulated images with their wakes (green) and what is found (red to yellow) into `simulated.png`.
pub(crate) fn show(out: &Path) -> Result<(), Box<dyn Error>> {
    let detector = Detector::pretrained(&device_named("flex")?)?;
    std::fs::create_dir_all(out)
        .map_err(|error| format!("cannot make {}: {error}", out.display()))?;
    let source = Recipe::Detector.source(HELD_OUT, SIZE)?;
    let bar = progress::bar(COUNT, "images");
    let mut pictures = Vec::new();
    for index in 0..COUNT {
        let pair = &source.items(index..index + 1)?[0];
        let sample = Sample::of_pair(pair);
        let image = sample.image();
        let found = detector.find(&image);
        bar.suspend(|| {
            println!(
                "image {index}: {} wakes, {} found",
                sample.wakes.len(),
                found.len()
            );
        });
        pictures.push(compared(&image, &sample.wakes, &found));
        bar.inc(1);
    }
    bar.finish_and_clear();
    let path = out.join("simulated.png");
    sheet(&pictures, 4).save(&path)?;
    println!(
        "wakes in green, what was found in red to yellow: {}",
        path.display()
    );
    Ok(())
}
