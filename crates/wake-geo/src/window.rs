//! Windows of an image.

use std::ops::Range;

use crate::error::{Error, Result};
use crate::limits::WINDOW_PIXELS;

/// Pixels of a window, line by line.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Window {
    /// Number of lines.
    pub lines: usize,
    /// Number of pixels of a line.
    pub pixels: usize,
    /// σ⁰ (linear, not dB) of a Sentinel-1 product, samples of other images; NaN where there is no data.
    pub values: Vec<f32>,
    /// Number of values without data.
    pub no_data: usize,
    /// Number of σ⁰ values set to 0 because DN² is below the thermal noise.
    pub below_noise: usize,
}

impl Window {
    /// Resets the window to a number of lines and pixels.
    pub(crate) fn start(&mut self, lines: usize, pixels: usize) {
        (self.lines, self.pixels) = (lines, pixels);
        (self.no_data, self.below_noise) = (0, 0);
        self.values.resize(lines * pixels, 0.0);
    }

    /// One line of the window.
    ///
    /// # Panics
    /// If the window has no such line.
    pub fn line(&self, line: usize) -> &[f32] {
        &self.values[line * self.pixels..(line + 1) * self.pixels]
    }
}

/// Checks that a window lies inside an image of the given lines and pixels, and within the size limit.
pub(crate) fn check_window(
    lines: &Range<usize>,
    pixels: &Range<usize>,
    (size_lines, size_pixels): (usize, usize),
) -> Result<()> {
    let inside = |range: &Range<usize>, size| range.start < range.end && range.end <= size;
    if !inside(lines, size_lines) || !inside(pixels, size_pixels) {
        return Err(Error::Window {
            lines: lines.clone(),
            pixels: pixels.clone(),
            size_lines,
            size_pixels,
        });
    }
    let value = lines.len() as u64 * pixels.len() as u64;
    match value <= WINDOW_PIXELS {
        true => Ok(()),
        false => Err(Error::TooLarge {
            file: "window".to_owned(),
            what: "the number of pixels",
            value,
            limit: WINDOW_PIXELS,
            remedy: "read smaller windows one after the other",
        }),
    }
}

/// Checks that a part lies inside an image of the given lines and pixels and has at least `smallest` of each.
pub(crate) fn check_part(
    lines: &Range<usize>,
    pixels: &Range<usize>,
    (size_lines, size_pixels): (usize, usize),
    smallest: usize,
) -> Result<()> {
    let fits = |range: &Range<usize>, size| {
        range.start < range.end && range.end <= size && range.len() >= smallest
    };
    match fits(lines, size_lines) && fits(pixels, size_pixels) {
        true => Ok(()),
        false => Err(Error::Part {
            lines: lines.clone(),
            pixels: pixels.clone(),
            size_lines,
            size_pixels,
            smallest,
        }),
    }
}
