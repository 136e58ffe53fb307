//! Whether a small network tells the open sea of real tiles from a simulated one.

use std::error::Error;
use std::path::Path;
use std::sync::Arc;

use serde_json::{Value, json};
use wake_detector::GreyImage;
use wake_detector::train::Recipe;
use wake_ldm::dataset::Source;
use wake_ldm::device_named;
use wake_ldm::train::{TwoSampleOptions, two_sample};
use wake_physics::Field;

use super::evaluate::HELD_OUT;

/// Rows and columns of a window of open sea.
const WINDOW: usize = 128;
/// Windows of each half of a tile, at most.
const OF_A_HALF: usize = 4;
/// A window with a pixel brighter than this many medians holds more than sea: chosen.
const BRIGHTEST: f32 = 4.0;

/// Windows of open sea of the tiles of a folder: the even ones of left halves, the odd ones of right halves, so that a network
/// which learns from the even ones is judged on halves that it has not seen.
pub(crate) fn windows(folder: &Path, names: &[String]) -> Result<Vec<Field>, Box<dyn Error>> {
    let mut windows = Vec::new();
    for name in names {
        let image = GreyImage::read(&folder.join(name))?;
        let mask = folder.join(name.replace(".png", "_mask.png"));
        let mask = match mask.is_file() {
            true => Some(GreyImage::read(&mask)?),
            false => None,
        };
        let middle = image.columns() / 2;
        let [left, right] = [0..middle, middle..image.columns()].map(|half| {
            let mut open = Vec::new();
            for top in (0..image.rows().saturating_sub(WINDOW - 1)).step_by(WINDOW) {
                let mut column = half.start;
                while column + WINDOW <= half.end {
                    let place = (top, column);
                    column += WINDOW;
                    let masked = mask.as_ref().is_some_and(|mask| {
                        let mask = mask.window(place.0, place.1, WINDOW, WINDOW);
                        mask.iter().any(|&m| m > 0.0)
                    });
                    let pixels = image.window(place.0, place.1, WINDOW, WINDOW);
                    if !masked && is_open(&pixels) {
                        open.push(field(pixels));
                    }
                }
            }
            open
        });
        let count = left.len().min(right.len()).min(OF_A_HALF);
        let spread = |half: Vec<Field>| -> Vec<Field> {
            let step = half.len() / count.max(1);
            half.into_iter().step_by(step.max(1)).take(count).collect()
        };
        for (left, right) in spread(left).into_iter().zip(spread(right)) {
            windows.extend([left, right]);
        }
    }
    Ok(windows)
}

/// Whether a window holds no bright target, and more than one grey.
fn is_open(pixels: &[f32]) -> bool {
    let mut sorted = pixels.to_vec();
    let middle = sorted.len() / 2;
    let median = *sorted.select_nth_unstable_by(middle, f32::total_cmp).1;
    let largest = pixels.iter().copied().fold(0.0, f32::max);
    median > 0.0 && largest < BRIGHTEST * median && largest > median
}

fn field(values: Vec<f32>) -> Field {
    Field {
        rows: WINDOW,
        columns: WINDOW,
        values,
    }
}

/// As many windows of a source.
fn simulated(source: &Arc<dyn Source>, count: usize) -> Result<Vec<Field>, Box<dyn Error>> {
    let pairs = source.items(0..count as u64)?;
    let levels = |pair: wake_ldm::dataset::Pair| {
        let levels = pair.image.levels();
        field(levels.into_iter().map(f32::from).collect())
    };
    Ok(pairs.into_iter().map(levels).collect())
}

/// How often real windows are told from those of each recipe, and the recipe detector from itself: the floor.
pub(crate) fn told_apart(real: &[Field]) -> Result<Vec<Value>, Box<dyn Error>> {
    let device = device_named("flex")?;
    let sea = |plain: bool, seed: u64| -> Result<Vec<Field>, Box<dyn Error>> {
        simulated(&Recipe::open_sea(plain, seed, WINDOW)?, real.len())
    };
    let detector = sea(false, HELD_OUT)?;
    let rows = [
        (
            "real sea and pixels without response",
            real,
            sea(true, HELD_OUT)?,
        ),
        ("real sea and recipe detector", real, detector.clone()),
        (
            "recipe detector and itself, other seeds",
            &detector,
            sea(false, HELD_OUT + 1)?,
        ),
    ];
    let row = |(name, first, second): (&str, &[Field], Vec<Field>)| {
        let found = two_sample(first, &second, &TwoSampleOptions::default(), &device)?;
        Ok(json!({
            "kinds": name, "accuracy": found.accuracy, "half_width": found.half_width, "images": found.images,
        }))
    };
    rows.into_iter().map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_of_sea_hold_no_ship_and_no_flat_grey() {
        let sea: Vec<f32> = (0..WINDOW * WINDOW)
            .map(|n| 80.0 + (n % 7) as f32)
            .collect();
        assert!(is_open(&sea));
        let mut ship = sea;
        ship[900] = 255.0 * BRIGHTEST;
        assert!(!is_open(&ship) && !is_open(&[0.0; 64]) && !is_open(&[9.0; 64]));
    }

    /// Of a tile whose left half is dark and right half bright, even windows are dark and odd ones bright.
    #[test]
    fn halves_of_tiles_are_kept_apart() {
        let folder = tempfile::tempdir().unwrap();
        let (rows, columns) = (300, 2 * WINDOW + 40);
        let mut picture = image::GrayImage::new(columns as u32, rows);
        for (x, y, pixel) in picture.enumerate_pixels_mut() {
            let base = if x < columns as u32 / 2 { 40 } else { 120 };
            *pixel = image::Luma([base + ((x * 7 + y * 3) % 5) as u8]);
        }
        picture.save(folder.path().join("a.png")).unwrap();
        let found = windows(folder.path(), &["a.png".to_owned()]).unwrap();
        assert_eq!(found.len(), 4);
        for (n, window) in found.iter().enumerate() {
            assert_eq!(window.mean() > 80.0, n % 2 == 1, "{n}");
        }
    }
}
