//! What is known beside what was found, as a picture.

use image::RgbImage;

use crate::detector::FOUND;
use wake_detector::GreyImage;
use wake_detector::drawing::Drawing;
use wake_detector::{Detection, Wake};

/// The colour of wakes that are known.
const KNOWN: [u8; 3] = [0, 200, 0];

/// An image with the wakes that are to be found in green, and in red and yellow what was found with certainty
/// ([`Detection::sure`]).
#[must_use]
pub fn compared(image: &GreyImage, wakes: &[Wake], found: &[Detection]) -> RgbImage {
    let mut drawing = Drawing::new(image);
    for wake in wakes.iter().filter(|wake| wake.snr >= FOUND) {
        drawing.ray(wake, KNOWN);
    }
    drawing.found(found.iter().filter(|one| one.sure));
    drawing.into_picture()
}
