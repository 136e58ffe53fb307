//! Windows of open sea in an image: squares without ships and without what a mask marks.

use std::ops::Range;

use wake_detector::GreyImage;
use wake_physics::measure::median;

/// A window with a pixel brighter than this many medians is not open sea: chosen.
const BRIGHTEST: f32 = 4.0;

/// The windows of open sea in a range of columns of an image, on a grid without overlap, each with its levels row by row.
///
/// - `mask`: of the image's size; windows with a level above 0 in it are left out
/// - `side`: rows and columns of a window
#[must_use]
pub fn open_windows(
    image: &GreyImage,
    mask: Option<&GreyImage>,
    side: usize,
    columns: Range<usize>,
) -> Vec<Vec<f32>> {
    let mut open = Vec::new();
    for top in (0..(image.rows() + 1).saturating_sub(side)).step_by(side.max(1)) {
        for left in columns.clone().step_by(side.max(1)) {
            if left + side > columns.end {
                break;
            }
            let masked = mask.is_some_and(|mask| {
                let mask = mask.window(top, left, side, side);
                mask.iter().any(|&m| m > 0.0)
            });
            let pixels = image.window(top, left, side, side);
            if !masked && is_open(&pixels) {
                open.push(pixels);
            }
        }
    }
    open
}

/// Windows of open sea from the left and the right half of an image alternately, equally many of both.
///
/// A network trained on the even windows is thus tested on a half that it has not seen.
///
/// - `most`: largest number of windows per half, spread over it
#[must_use]
pub fn paired_windows(
    image: &GreyImage,
    mask: Option<&GreyImage>,
    side: usize,
    most: usize,
) -> Vec<Vec<f32>> {
    let middle = image.columns() / 2;
    let [left, right] =
        [0..middle, middle..image.columns()].map(|half| open_windows(image, mask, side, half));
    let count = left.len().min(right.len()).min(most);
    let spread = |half: Vec<Vec<f32>>| {
        let step = half.len() / count.max(1);
        half.into_iter().step_by(step.max(1)).take(count)
    };
    let pairs = spread(left).zip(spread(right));
    pairs.flat_map(|(left, right)| [left, right]).collect()
}

/// Whether a window has no bright target, and more than one grey.
fn is_open(pixels: &[f32]) -> bool {
    if pixels.is_empty() {
        return false;
    }
    let median = median(pixels);
    let largest = pixels.iter().copied().fold(0.0, f32::max);
    median > 0.0 && largest < BRIGHTEST * median && largest > median
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: usize = 128;

    #[test]
    fn windows_of_sea_hold_no_ship_and_no_flat_grey() {
        let sea: Vec<f32> = (0..SIDE * SIDE).map(|n| 80.0 + (n % 7) as f32).collect();
        assert!(is_open(&sea));
        let mut ship = sea;
        ship[900] = 255.0 * BRIGHTEST;
        assert!(!is_open(&ship) && !is_open(&[0.0; 64]) && !is_open(&[9.0; 64]));
    }

    /// For an image whose left half is dark and right half bright, even windows are dark and odd ones bright.
    #[test]
    fn halves_are_kept_apart_and_masks_are_heeded() {
        let (rows, columns) = (300, 2 * SIDE + 40);
        let level = |n: usize| {
            let (x, y) = (n % columns, n / columns);
            let base = if x < columns / 2 { 40 } else { 120 };
            base + ((x * 7 + y * 3) % 5) as u8
        };
        let levels: Vec<u8> = (0..rows * columns).map(level).collect();
        let image = GreyImage::eight_bits(rows, columns, levels).unwrap();
        let found = paired_windows(&image, None, SIDE, 4);
        assert_eq!(found.len(), 4);
        for (n, window) in found.iter().enumerate() {
            assert_eq!(window[0] > 80.0, n % 2 == 1, "{n}");
        }
        let mut marked = vec![0; rows * columns];
        marked[0] = 1;
        let mask = GreyImage::eight_bits(rows, columns, marked).unwrap();
        let masked = paired_windows(&image, Some(&mask), SIDE, 4);
        assert_eq!(masked.len(), 2);
    }
}
