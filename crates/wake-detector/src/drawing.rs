//! Pictures of detections.

use image::{Rgb, RgbImage};

use crate::image::GreyImage;
use crate::scaling::rescaled;
use crate::wake::{Detection, Wake};

/// Longest side of a picture \[pixels\].
const LARGEST: usize = 2048;

/// Grey image with rays drawn on it.
#[derive(Debug, Clone)]
pub struct Drawing {
    picture: RgbImage,
    factor: f32,
}

impl Drawing {
    /// Draws the image from black at its darkest pixel to light grey at its 99th percentile, shrunk if it is large.
    #[must_use]
    pub fn new(image: &GreyImage) -> Self {
        let factor = (LARGEST as f32 / image.rows.max(image.columns) as f32).min(1.0);
        // In bands, so that a large image is never held in memory as floats.
        let band = ((8.0 / factor).ceil() as usize).max(1).next_multiple_of(64);
        let mut lines = Vec::new();
        let mut columns = 1;
        for top in (0..image.rows).step_by(band) {
            let rows = band.min(image.rows - top);
            let piece = image.window(top, 0, rows, image.columns);
            let (_, width, piece) = rescaled(&piece, rows, image.columns, factor);
            columns = width;
            lines.extend(piece);
        }
        let mut sorted = lines.clone();
        let place = sorted.len() * 99 / 100;
        let white = *sorted.select_nth_unstable_by(place, f32::total_cmp).1;
        let black = lines.iter().copied().fold(f32::INFINITY, f32::min);
        let range = (1.3 * (white - black)).max(1e-6);
        let rows = lines.len() / columns;
        let picture = RgbImage::from_fn(columns as u32, rows as u32, |x, y| {
            let grey = (lines[y as usize * columns + x as usize] - black) / range;
            Rgb([(255.0 * grey.clamp(0.0, 1.0)) as u8; 3])
        });
        Self { picture, factor }
    }

    /// Draws a ray from tip to end as two lines on both sides of the wake, which stays visible, and a mark at the tip.
    pub fn ray(&mut self, wake: &Wake, colour: [u8; 3]) {
        let [right, down] = wake.direction();
        let aside = 9.0;
        for side in [-aside, aside] {
            let at = |along: f32| {
                let [x, y] = wake.at(along);
                [x - side * down, y + side * right]
            };
            self.line(at(0.0), at(wake.length), colour);
        }
        let [x, y] = wake.tip;
        self.line(
            [x - aside * down, y + aside * right],
            [x + aside * down, y - aside * right],
            colour,
        );
    }

    /// Draws detections from yellow at low scores to red at high ones, the highest score on top.
    ///
    /// - `found`: in descending order of score
    pub fn found<'a>(&mut self, found: impl DoubleEndedIterator<Item = &'a Detection>) {
        for one in found.rev() {
            let green = (255.0 * (1.0 - one.score.min(1.0))) as u8;
            self.ray(&one.wake, [255, green, 0]);
        }
    }

    fn line(&mut self, from: [f32; 2], to: [f32; 2], colour: [u8; 3]) {
        let [from, to] = [from, to].map(|p| p.map(|x| self.factor * x));
        let steps = (to[0] - from[0])
            .abs()
            .max((to[1] - from[1]).abs())
            .ceil()
            .max(1.0);
        for k in 0..=steps as usize {
            let t = k as f32 / steps;
            let [x, y] = [0, 1].map(|a| (from[a] + t * (to[a] - from[a])).round());
            if x >= 0.0
                && y >= 0.0
                && x < self.picture.width() as f32
                && y < self.picture.height() as f32
            {
                self.picture.put_pixel(x as u32, y as u32, Rgb(colour));
            }
        }
    }

    /// The picture.
    #[must_use]
    pub fn into_picture(self) -> RgbImage {
        self.picture
    }
}

/// Arranges pictures of one size in a table with this number of columns.
#[must_use]
pub fn sheet(pictures: &[RgbImage], columns: usize) -> RgbImage {
    let (width, height) = pictures.first().map_or((1, 1), RgbImage::dimensions);
    let rows = pictures.len().div_ceil(columns) as u32;
    let mut sheet = RgbImage::new(width * columns as u32, height * rows);
    for (i, picture) in pictures.iter().enumerate() {
        let (x, y) = ((i % columns) as u32 * width, (i / columns) as u32 * height);
        image::imageops::replace(&mut sheet, picture, i64::from(x), i64::from(y));
    }
    sheet
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_is_drawn_beside_its_line_and_nothing_outside_the_picture() {
        let mut drawing = Drawing::new(&GreyImage::from_levels(40, 60, &[7.0; 2400]));
        let wake = Wake {
            tip: [30.0, 20.0],
            axis_deg: 90.0,
            half_angle_deg: 0.0,
            length: 500.0,
            snr: 9.0,
            contrast_db: None,
        };
        drawing.ray(&wake, [255, 0, 0]);
        let picture = drawing.into_picture();
        assert_eq!(picture.dimensions(), (60, 40));
        let red = Rgb([255, 0, 0]);
        assert!(*picture.get_pixel(50, 29) == red && *picture.get_pixel(50, 11) == red);
        assert!(*picture.get_pixel(50, 20) != red && *picture.get_pixel(10, 29) != red);
    }
}
