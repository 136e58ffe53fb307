//! Panel of the gallery: an image with scale bar and arrows, and a small copy with its labels.

use wake_physics::labels::{Labels, Line, Pixel};

use crate::sheet::{Colour, INK, LETTER, LINE, PAPER, Picture};

/// Rows and columns of a panel \[pixels\].
pub(crate) const SIDE: usize = 384;
/// Pixels of the panel per pixel of the small copy, along each side.
const SMALLER: usize = 3;
/// Possible lengths of a scale bar \[m\].
const BARS: [f64; 7] = [50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0, 5000.0];
/// Distance of marks from the sides of the panel \[pixels\].
const EDGE: usize = 6;
/// Width of bars and arrows, and length of an arrow \[pixels\].
const STROKE: usize = 2;
const ARROW: usize = 36;
/// Colour of detections.
pub(crate) const FOUND: Colour = [255, 176, 0];

/// The image with scale bar and arrows, and a small copy with labels at the lower right.
///
/// - `levels`: levels of `SIDE` × `SIDE` pixels
/// - `spacing`: pixel spacing \[m\]
pub(crate) fn labelled(levels: &[u8], spacing: f64, labels: &Labels) -> Picture {
    let mut picture = marked(levels, spacing);
    let mut small = Picture::reduced(levels, SIDE, SIDE / SMALLER);
    small.draw_labels(&reduced(labels));
    set_in(&mut picture, &small);
    picture
}

/// The image with scale bar and arrows.
pub(crate) fn marked(levels: &[u8], spacing: f64) -> Picture {
    let mut picture = Picture::from_levels(levels, SIDE);
    scale_bar(&mut picture, spacing);
    arrows(&mut picture);
    picture
}

/// Inserts a small copy with a frame at the lower right.
pub(crate) fn set_in(picture: &mut Picture, small: &Picture) {
    let [rows, columns] = small.size();
    let [top, left] = [SIDE - rows - EDGE, SIDE - columns - EDGE];
    picture.fill([left - 1, top - 1, columns + 2, rows + 2], INK);
    picture.paste(small, top, left);
}

/// Draws a bar of a round length, at most a quarter of the panel, labelled with its length.
fn scale_bar(picture: &mut Picture, spacing: f64) {
    let most = SIDE as f64 * spacing / 4.0;
    let length = BARS.into_iter().rfind(|&bar| bar <= most).unwrap_or(most);
    let pixels = (length / spacing).round() as usize;
    let words = match length {
        metres if metres >= 1000.0 => format!("{} km", metres / 1000.0),
        metres => format!("{metres:.0} m"),
    };
    let wide = pixels.max(words.len() * LETTER) + 2 * EDGE;
    let top = SIDE - LINE - 3 * EDGE;
    picture.fill([EDGE, top, wide, LINE + 2 * EDGE], PAPER);
    picture.write_text(&words, top + 1, 2 * EDGE);
    let below = top + LINE + EDGE / 2;
    picture.fill([2 * EDGE, below, pixels, STROKE], INK);
    for end in [2 * EDGE, 2 * EDGE + pixels] {
        picture.fill([end, below - EDGE / 2, STROKE, EDGE], INK);
    }
}

/// Draws arrows: azimuth upward, along the flight; range to the right, away from the radar.
fn arrows(picture: &mut Picture) {
    let (left, corner) = (2 * EDGE, 2 * EDGE + ARROW);
    let wide = ARROW + EDGE + "range".len() * LETTER + 2 * EDGE;
    picture.fill([EDGE, EDGE, wide, ARROW + 3 * EDGE], PAPER);
    picture.fill([left, 2 * EDGE, STROKE, ARROW], INK);
    picture.fill([left, corner, ARROW, STROKE], INK);
    for step in 0..EDGE {
        let width = 2 * (step / 2) + STROKE;
        picture.fill([left - step / 2, 2 * EDGE + step, width, 1], INK);
        picture.fill([left + ARROW - step, corner - step / 2, 1, width], INK);
    }
    picture.write_text("azimuth", 2 * EDGE, left + EDGE);
    picture.write_text("range", corner - LINE / 2, left + ARROW + EDGE / 2);
}

/// Labels in the pixels of the small copy.
fn reduced(labels: &Labels) -> Labels {
    let small = 1.0 / SMALLER as f64;
    // Pixel centres have integer coordinates.
    let place = |p: Pixel| p.map(|v| (v + 0.5) * small - 0.5);
    let line = |line: &Line| line.iter().map(|&p| place(p)).collect::<Line>();
    let frame = |[x, y, width, height]: [f64; 4]| {
        let [x, y] = place([x, y]);
        [x, y, width * small, height * small]
    };
    let mut labels = labels.clone();
    for labelled in &mut labels.ships {
        let wake = &mut labelled.wake;
        wake.arms_px = wake.arms_px.iter().map(line).collect();
        wake.centreline_px = line(&wake.centreline_px);
        wake.tip_px = wake.tip_px.map(place);
        wake.box_px = wake.box_px.map(frame);
        labelled.ship.echo_box_px = labelled.ship.echo_box_px.map(frame);
    }
    labels
}

/// Resamples an image to `SIDE` × `SIDE` pixels, bilinearly.
pub(crate) fn enlarged(levels: &[u8], side: usize) -> Vec<u8> {
    let at = |row: usize, column: usize| f64::from(levels[row * side + column]);
    let place = |n: usize| {
        let v = ((n as f64 + 0.5) * side as f64 / SIDE as f64 - 0.5).clamp(0.0, (side - 1) as f64);
        let first = (v as usize).min(side.saturating_sub(2));
        (first, v - first as f64)
    };
    let pixel = |n: usize| {
        let ((i, down), (j, right)) = (place(n / SIDE), place(n % SIDE));
        let line = |row| at(row, j) * (1.0 - right) + at(row, j + 1) * right;
        (line(i) * (1.0 - down) + line(i + 1) * down).round() as u8
    };
    (0..SIDE * SIDE).map(pixel).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_enlarged_image_keeps_its_slope() {
        let side = 256;
        let levels: Vec<u8> = (0..side * side).map(|n| (n % side / 2) as u8).collect();
        let large = enlarged(&levels, side);
        let expected = |column: usize| ((column as f64 + 0.5) * 256.0 / 384.0 - 0.5) / 2.0;
        for column in 3..SIDE - 3 {
            let level = f64::from(large[7 * SIDE + column]);
            // Half a level of rounding here, and half a level in the image.
            assert!((level - expected(column)).abs() <= 1.0, "{column}: {level}");
        }
    }

    #[test]
    fn a_scale_bar_has_its_length() {
        let picture = marked(&vec![0; SIDE * SIDE], 10.0);
        let row = SIDE - LINE - 3 * EDGE + LINE + EDGE / 2;
        let bright = (0..SIDE).filter(|&column| picture.at(row, column) == INK);
        // 500 m in pixels of 10 m, and the end's stroke.
        assert_eq!(bright.count(), 50 + STROKE);
    }
}
