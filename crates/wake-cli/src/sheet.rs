//! Pictures for people: images with labels and captions, and sheets of several.

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};
use std::path::Path;
use wake_physics::labels::{Labels, Line, Pixel};
use wake_physics::{Error, output};

/// Red, green, blue.
pub(crate) type Colour = [u8; 3];

/// Colour of wake boxes.
const WAKE: Colour = [255, 176, 0];
/// Colour of wake arms and tips.
const ARMS: Colour = [64, 224, 128];
/// Colour of ship boxes.
const SHIP: Colour = [255, 96, 176];
/// Colour behind captions and between the pictures of a sheet.
pub(crate) const PAPER: Colour = [24, 24, 24];
/// Colour of letters.
pub(crate) const INK: Colour = [240, 240, 240];

/// Width of a letter \[pixels\].
pub(crate) const LETTER: usize = get_raster_width(FontWeight::Regular, RasterHeight::Size16);
/// Distance between lines of text \[pixels\].
pub(crate) const LINE: usize = 18;
/// Distance between the pictures of a sheet \[pixels\].
const GAP: usize = 4;
/// Length of dashes and gaps \[pixels\], so that the image under a line stays visible.
const DASH: usize = 5;

/// A picture in colour.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Picture {
    rows: usize,
    columns: usize,
    pixels: Vec<Colour>,
}

impl Picture {
    /// Reduces a grey image by means over square blocks, the smallest that make neither side longer than `side`;
    /// incomplete blocks at the right and bottom are dropped.
    ///
    /// - `levels`, `columns`: as in [`from_levels`](Self::from_levels)
    ///
    /// # Panics
    ///
    /// If the levels are not whole rows.
    pub(crate) fn reduced(levels: &[u8], columns: usize, side: usize) -> Self {
        let rows = levels.len() / columns.max(1);
        assert!(rows * columns == levels.len(), "levels of whole rows");
        let block = rows.max(columns).div_ceil(side.max(1)).max(1);
        let [down, right] = [rows / block, columns / block];
        let mean = |n: usize| {
            let first = n / right * block * columns + n % right * block;
            let lines = (0..block).map(|line| &levels[first + line * columns..][..block]);
            let sum: usize = lines.flatten().map(|&level| usize::from(level)).sum();
            (sum / (block * block)) as u8
        };
        let levels: Vec<u8> = (0..down * right).map(mean).collect();
        Self::from_levels(&levels, right)
    }

    /// A grey picture from levels of 8 bits, `[rows, columns]`, row after row.
    ///
    /// # Panics
    ///
    /// If the levels are not whole rows.
    pub(crate) fn from_levels(levels: &[u8], columns: usize) -> Self {
        let rows = levels.len() / columns.max(1);
        assert!(rows * columns == levels.len(), "levels of whole rows");
        Self {
            rows,
            columns,
            pixels: levels.iter().map(|&level| [level; 3]).collect(),
        }
    }

    /// A picture from red, green and blue of 8 bits, `[rows, columns, 3]`.
    ///
    /// # Panics
    ///
    /// If they are not whole rows.
    #[cfg(test)]
    pub(crate) fn from_rgb(bytes: &[u8], columns: usize) -> Self {
        let (pixels, rest) = bytes.as_chunks::<3>();
        let rows = pixels.len() / columns.max(1);
        assert!(
            rest.is_empty() && rows * columns == pixels.len(),
            "bytes of whole rows"
        );
        Self {
            rows,
            columns,
            pixels: pixels.to_vec(),
        }
    }

    /// Rows and columns.
    #[cfg(any(feature = "bench", test))]
    pub(crate) fn size(&self) -> [usize; 2] {
        [self.rows, self.columns]
    }

    /// Colour at `[row, column]`.
    ///
    /// # Panics
    ///
    /// If the pixel lies outside the picture.
    #[cfg(any(feature = "bench", test))]
    pub(crate) fn at(&self, row: usize, column: usize) -> Colour {
        assert!(column < self.columns, "a column of the picture");
        self.pixels[row * self.columns + column]
    }

    /// Draws labels: boxes of wakes and ships, arms and centrelines of wakes, and a cross at each tip. Lines are
    /// clipped to the picture.
    ///
    /// Labels are in pixels of the picture, so draw them before adding a caption above it.
    pub(crate) fn draw_labels(&mut self, labels: &Labels) {
        for labelled in &labels.ships {
            let wake = &labelled.wake;
            if let Some(frame) = wake.box_px {
                let lines = wake.arms_px.iter().chain([&wake.centreline_px]);
                for part in lines.flat_map(|line: &Line| line.windows(2)) {
                    self.draw_line([part[0], part[1]], ARMS);
                }
                if let Some(tip) = wake.tip_px {
                    self.draw_cross(tip, ARMS);
                }
                self.draw_box(frame, WAKE);
            }
            if let Some(frame) = labelled.ship.echo_box_px {
                self.draw_box(frame, SHIP);
            }
        }
    }

    /// Draws the frame of a box (x, y, width, height).
    fn draw_box(&mut self, [x, y, width, height]: [f64; 4], colour: Colour) {
        let (right, bottom) = (x + width, y + height);
        let corners = [[x, y], [right, y], [right, bottom], [x, bottom], [x, y]];
        for pair in corners.windows(2) {
            self.draw_line([pair[0], pair[1]], colour);
        }
    }

    /// Draws a small cross at a position.
    fn draw_cross(&mut self, [x, y]: Pixel, colour: Colour) {
        let arm = (DASH - 1) as f64;
        self.draw_line([[x - arm, y], [x + arm, y]], colour);
        self.draw_line([[x, y - arm], [x, y + arm]], colour);
    }

    /// Draws a dashed line, clipped to the picture; a line with an end that is not finite is skipped.
    pub(crate) fn draw_line(&mut self, line: [Pixel; 2], colour: Colour) {
        let Some([from, to]) = self.cut(line) else {
            return;
        };
        let longest = (to[0] - from[0]).abs().max((to[1] - from[1]).abs());
        let steps = longest.ceil().max(1.0) as usize;
        for step in (0..=steps).filter(|step| (step / DASH).is_multiple_of(2)) {
            let t = step as f64 / steps as f64;
            let [column, row] = [0, 1].map(|a| (from[a] + t * (to[a] - from[a])).round() as usize);
            self.pixels[row * self.columns + column] = colour;
        }
    }

    /// Clips a line to the centres of the outermost pixels, after Liang and Barsky (1984).
    fn cut(&self, [from, to]: [Pixel; 2]) -> Option<[Pixel; 2]> {
        if self.pixels.is_empty() || !from.iter().chain(&to).all(|v| v.is_finite()) {
            return None;
        }
        let far = [(self.columns - 1) as f64, (self.rows - 1) as f64];
        let (mut start, mut end) = (0.0f64, 1.0f64);
        for a in 0..2 {
            let along = to[a] - from[a];
            if along == 0.0 {
                if !(0.0..=far[a]).contains(&from[a]) {
                    return None;
                }
                continue;
            }
            let (low, high) = (-from[a] / along, (far[a] - from[a]) / along);
            start = start.max(low.min(high));
            end = end.min(low.max(high));
        }
        let at = |t: f64| [0, 1].map(|a| (from[a] + t * (to[a] - from[a])).clamp(0.0, far[a]));
        (start <= end).then(|| [at(start), at(end)])
    }

    /// Adds lines of text above the picture, wrapped to its width; letters that the font lacks are blank.
    pub(crate) fn captioned(mut self, text: &str) -> Self {
        let lines = broken(text, self.columns / LETTER);
        let above = lines.len() * LINE;
        let mut pixels = vec![PAPER; above * self.columns];
        pixels.append(&mut self.pixels);
        self.pixels = pixels;
        self.rows += above;
        for (k, line) in lines.iter().enumerate() {
            self.write_text(line, k * LINE + 1, 0);
        }
        self
    }

    /// Writes a line of text over the picture, clipped at the right and bottom; letters that the font lacks are blank.
    ///
    /// - `top`, `left`: position of the first letter
    pub(crate) fn write_text(&mut self, text: &str, top: usize, left: usize) {
        for (n, letter) in text.chars().enumerate() {
            self.write_letter(letter, top, left + n * LETTER);
        }
    }

    fn write_letter(&mut self, letter: char, top: usize, left: usize) {
        let Some(shape) = get_raster(letter, FontWeight::Regular, RasterHeight::Size16) else {
            return;
        };
        for (row, line) in shape.rows().enumerate() {
            for (column, &share) in line.iter().enumerate() {
                let [i, j] = [top + row, left + column];
                if i < self.rows && j < self.columns {
                    let pixel = &mut self.pixels[i * self.columns + j];
                    for (below, ink) in pixel.iter_mut().zip(INK) {
                        let [under, over] = [*below, ink].map(u16::from);
                        let share = u16::from(share);
                        *below = ((under * (255 - share) + over * share) / 255) as u8;
                    }
                }
            }
        }
    }

    /// Fills a rectangle, clipped to the picture.
    #[cfg(any(feature = "bench", test))]
    pub(crate) fn fill(&mut self, [left, top, width, height]: [usize; 4], colour: Colour) {
        let right = (left + width).min(self.columns);
        for row in top..(top + height).min(self.rows) {
            let line = &mut self.pixels[row * self.columns..][..self.columns];
            if left < right {
                line[left..right].fill(colour);
            }
        }
    }

    /// Pastes another picture over this one, clipped at the right and bottom.
    #[cfg(any(feature = "bench", test))]
    pub(crate) fn paste(&mut self, other: &Self, top: usize, left: usize) {
        let wide = other.columns.min(self.columns.saturating_sub(left));
        let lines = other.pixels.chunks(other.columns.max(1));
        for (row, line) in (top..self.rows).zip(lines) {
            self.pixels[row * self.columns + left..][..wide].copy_from_slice(&line[..wide]);
        }
    }

    /// Arranges pictures on a sheet, `across` in a row, each at the upper left of its cell.
    pub(crate) fn sheet(pictures: &[Self], across: usize) -> Self {
        let across = across.clamp(1, pictures.len().max(1));
        let largest = |side: fn(&Self) -> usize| pictures.iter().map(side).max().unwrap_or(0);
        let (high, wide) = (largest(|p| p.rows), largest(|p| p.columns));
        let down = pictures.len().div_ceil(across);
        let length = |count: usize, side: usize| (count * (side + GAP)).saturating_sub(GAP);
        let (rows, columns) = (length(down, high), length(across.min(pictures.len()), wide));
        let mut pixels = vec![PAPER; rows * columns];
        for (k, picture) in pictures.iter().enumerate() {
            let (top, left) = (k / across * (high + GAP), k % across * (wide + GAP));
            for (row, line) in picture.pixels.chunks(picture.columns.max(1)).enumerate() {
                pixels[(top + row) * columns + left..][..line.len()].copy_from_slice(line);
            }
        }
        Self {
            rows,
            columns,
            pixels,
        }
    }

    /// Writes the picture as PNG; a picture without colours as grey, which is smaller and faster to compress.
    ///
    /// Pictures are mostly grey speckle: without filters the three equal bytes of a pixel compress to little more than one.
    ///
    /// # Errors
    ///
    /// [`Error::File`].
    pub(crate) fn write(&self, path: &Path) -> wake_physics::Result<()> {
        if self.pixels.iter().all(|[r, g, b]| r == g && g == b) {
            let grey: Vec<u8> = self.pixels.iter().map(|[level, ..]| *level).collect();
            return output::write_png(path, &grey, self.rows, self.columns);
        }
        let (pixels, mut bytes) = (self.pixels.as_flattened(), Vec::new());
        let [width, height] = [self.columns, self.rows].map(|n| n as u32);
        PngEncoder::new_with_quality(&mut bytes, CompressionType::Best, FilterType::NoFilter)
            .write_image(pixels, width, height, ExtendedColorType::Rgb8)
            .map_err(|e| Error::File {
                action: "encode",
                path: path.to_owned(),
                message: e.to_string(),
            })?;
        Ok(whole_files::write_atomically(path, &bytes)?)
    }
}

/// Wraps words into lines of at most `letters` letters; longer words are cut.
fn broken(text: &str, letters: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let word: String = word.chars().take(letters).collect();
        let used = lines.last().map_or(0, |line| line.chars().count());
        let space = usize::from(used > 0);
        match lines.last_mut() {
            Some(line) if used + space + word.chars().count() <= letters => {
                line.push_str(&" "[..space]);
                line.push_str(&word);
            }
            _ => lines.push(word),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::ColorType;
    use wake_physics::{Scene, labels_of};

    fn grey(rows: usize, columns: usize) -> Picture {
        Picture::from_levels(&vec![9; rows * columns], columns)
    }

    fn drawn(picture: &Picture, colour: Colour) -> Vec<[usize; 2]> {
        let [rows, columns] = picture.size();
        let places = (0..rows).flat_map(|i| (0..columns).map(move |j| [i, j]));
        places
            .filter(|&[i, j]| picture.at(i, j) == colour)
            .collect()
    }

    /// Seven columns give three blocks of two, and one column is dropped.
    #[test]
    fn pixels_of_a_small_picture_are_means_of_blocks() {
        let levels: Vec<u8> = (0..4 * 7).map(|n| 10 * (n % 7) + n / 7).collect();
        let small = Picture::reduced(&levels, 7, 4);
        assert_eq!(small.size(), [2, 3]);
        let red: Vec<u8> = small.pixels.iter().map(|pixel| pixel[0]).collect();
        // 10 · (column + ½) + row + ½, rounded down.
        assert_eq!(red, [5, 25, 45, 7, 27, 47]);
        assert_eq!(
            Picture::reduced(&levels, 7, 7),
            Picture::from_levels(&levels, 7)
        );
    }

    #[test]
    fn lines_are_dashed_and_cut_to_the_picture() {
        let mut picture = grey(20, 30);
        picture.draw_line([[-1e9, 7.0], [1e9, 7.0]], WAKE);
        let row: Vec<usize> = drawn(&picture, WAKE)
            .iter()
            .map(|&[i, j]| i * 100 + j)
            .collect();
        let dashes = [0..5, 10..15, 20..25];
        let expected: Vec<usize> = dashes.into_iter().flatten().map(|j| 700 + j).collect();
        assert_eq!(row, expected);
        // Past a corner, along a side outside, with an end that is not finite, backwards through a corner.
        let mut picture = grey(20, 30);
        picture.draw_line([[-10.0, 5.0], [5.0, -10.0]], SHIP);
        picture.draw_line([[0.0, -1.0], [29.0, -1.0]], SHIP);
        picture.draw_line([[0.0, f64::NAN], [29.0, 3.0]], SHIP);
        assert_eq!(drawn(&picture, SHIP), Vec::<[usize; 2]>::new());
        picture.draw_line([[33.0, 23.0], [26.0, 16.0]], SHIP);
        assert_eq!(
            drawn(&picture, SHIP),
            [[16, 26], [17, 27], [18, 28], [19, 29]]
        );
    }

    /// Box, arms and tip of a wake are drawn where the labels are, and nothing else is.
    #[test]
    fn labels_are_drawn_where_they_are() {
        let scene = Scene::default()
            .with_assignments(&["sea.wind_speed=3", "ship.heading=90", "ship.echo=true"])
            .unwrap();
        let labels = labels_of(&scene);
        let mut picture = grey(512, 512);
        picture.draw_labels(&labels);
        let wake = &labels.ships[0].wake;
        let [x, y, width, height] = wake.box_px.unwrap();
        let round = |v: f64| v.round() as usize;
        assert_eq!(picture.at(round(y), round(x) + 1), WAKE);
        let [column, row] = wake.tip_px.unwrap().map(round);
        assert_eq!(picture.at(row, column - 4), ARMS);
        let [ship_x, ship_y, ..] = labels.ships[0].ship.echo_box_px.unwrap();
        assert_eq!(picture.at(round(ship_y), round(ship_x)), SHIP);
        for [i, j] in drawn(&picture, WAKE) {
            let edges = [round(y), round(y + height), round(x), round(x + width)];
            assert!(
                edges[..2].contains(&i) || edges[2..].contains(&j),
                "{i}, {j}"
            );
        }
        // Open sea has no labels.
        let mut open = grey(8, 8);
        open.draw_labels(&Labels::default());
        assert_eq!(open, grey(8, 8));
    }

    #[test]
    fn captions_are_broken_and_stand_above() {
        let wide = 10 * LETTER;
        let picture = grey(5, wide).captioned("a wake at 45°, σ in dB");
        assert_eq!(picture.size(), [5 + 3 * LINE, wide]);
        assert_eq!(
            broken("a wake at 45°, σ in dB", 10),
            ["a wake at", "45°, σ in", "dB"]
        );
        assert!((0..5).all(|i| (0..wide).all(|j| picture.at(3 * LINE + i, j) == [9; 3])));
        // The bar of an L is at its left and is bright.
        let letter = grey(1, LETTER).captioned("L");
        let places = (0..LINE).flat_map(|i| (0..LETTER).map(move |j| [i, j]));
        let bright = places.filter(|&[i, j]| letter.at(i, j)[0] > 140);
        let columns: Vec<usize> = bright.map(|[_, j]| j).collect();
        assert!(columns.len() > 8, "{columns:?}");
        assert!(columns.iter().filter(|&&j| 2 * j < LETTER).count() > columns.len() / 2);
        assert_eq!(broken("", 4), [""]);
        assert_eq!(broken("overlong word", 4), ["over", "word"]);
    }

    #[test]
    fn pictures_are_set_over_others_and_cut() {
        let mut picture = grey(6, 8);
        picture.paste(&Picture::from_levels(&[200; 12], 4), 4, 6);
        assert_eq!(drawn(&picture, [200; 3]), [[4, 6], [4, 7], [5, 6], [5, 7]]);
        picture.fill([0, 5, 2, 9], WAKE);
        picture.fill([9, 0, 2, 2], SHIP);
        assert_eq!(drawn(&picture, WAKE), [[5, 0], [5, 1]]);
        assert_eq!(drawn(&picture, SHIP), Vec::<[usize; 2]>::new());
        picture.write_text("wake", 30, 3);
        assert_eq!(picture.size(), [6, 8]);
    }

    #[test]
    fn sheets_keep_every_pixel() {
        let pictures = [grey(2, 3), Picture::from_levels(&[200; 4], 2), grey(2, 3)];
        let sheet = Picture::sheet(&pictures, 2);
        assert_eq!(sheet.size(), [2 + GAP + 2, 3 + GAP + 3]);
        assert_eq!(drawn(&sheet, [9; 3]).len(), 12);
        assert_eq!(sheet.at(0, 3 + GAP), [200; 3]);
        assert_eq!(sheet.at(2 + GAP, 2), [9; 3]);
        assert_eq!(Picture::sheet(&[], 3).size(), [0, 0]);
    }

    #[test]
    fn a_picture_is_read_back_in_its_colours() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture.png");
        let mut picture = grey(6, 7);
        picture.draw_cross([3.0, 2.0], WAKE);
        picture.write(&path).unwrap();
        let read = image::open(&path).unwrap().into_rgb8();
        let kinds = [(&picture, ColorType::Rgb8), (&grey(6, 7), ColorType::L8)];
        for (picture, kind) in kinds {
            picture.write(&path).unwrap();
            assert_eq!(image::open(&path).unwrap().color(), kind);
        }
        assert_eq!(read.dimensions(), (7, 6));
        assert_eq!(read.get_pixel(3, 2).0, WAKE);
        assert_eq!(read.get_pixel(0, 5).0, [9; 3]);
        assert_eq!(Picture::from_rgb(read.as_raw(), 7), picture);
    }
}
