//! Boxes of a detector: corner of the image as origin, pixels as unit.

use wake_physics::labels::{Class, Labels};

/// A box (x, y, width, height) \[pixels\], from the upper left corner of the image.
pub(super) type Box2 = [f64; 4];

/// Class and box of what is seen in the image.
///
/// Labels count from the centre of the first pixel, boxes from its corner, half a pixel before. Steps of 0.01 pixels.
/// A ship has a box only where its echo is drawn: what cannot be seen cannot be found.
pub(super) fn boxes(labels: &Labels, echo: bool) -> Vec<(u32, Box2)> {
    let wake = labels.wake.box_px.map(|b| (Class::Wake, b));
    let ship = labels.ship.echo_box_px.filter(|_| echo);
    let ship = ship.map(|b| (Class::Ship, b));
    let cornered = |[x, y, w, h]: Box2| [x + 0.5, y + 0.5, w, h].map(hundredths);
    [wake, ship]
        .into_iter()
        .flatten()
        .map(|(class, b)| (class.number(), cornered(b)))
        .collect()
}

fn hundredths(value: f64) -> f64 {
    (100.0 * value).round() / 100.0
}

#[cfg(test)]
#[path = "label_tests.rs"]
mod tests;
