//! Pictures of known wakes and detections.

use image::RgbImage;

use crate::detector::FOUND;
use wake_detector::GreyImage;
use wake_detector::drawing::Drawing;
use wake_detector::{Detection, Wake};

/// Colour of known wakes.
const KNOWN: [u8; 3] = [0, 200, 0];

/// Draws the wakes that count in green, and confident detections ([`Detection::sure`]) in red and yellow.
#[must_use]
pub fn compared(image: &GreyImage, wakes: &[Wake], found: &[Detection]) -> RgbImage {
    let mut drawing = Drawing::new(image);
    for wake in wakes.iter().filter(|wake| wake.snr >= FOUND) {
        drawing.ray(wake, KNOWN);
    }
    drawing.found(found.iter().filter(|one| one.sure));
    drawing.into_picture()
}
