//! Sample sheets: images of a model below those it is trained on.

use std::path::Path;

use wake_physics::output;

use crate::error::Result;
use wake_dataset::Pair;

/// Writes a PNG file with training images above and, below each, the model's image of the same scene or prompt.
///
/// - `drawn`: the model's image for each pair, grey 0…1 row by row
///
/// All images are squares of one size.
pub(super) fn write_sheet(examples: &[Pair], drawn: &[Vec<f32>], path: &Path) -> Result<()> {
    let size = examples.first().map_or(0, |pair| pair.image.rows);
    let width = size * examples.len();
    let mut sheet = vec![0; 2 * size * width];
    for (i, (pair, drawn)) in examples.iter().zip(drawn).enumerate() {
        for (row, pixels) in [(0, &pair.image.pixels), (1, drawn)] {
            for (p, &grey) in pixels.iter().enumerate() {
                let (x, y) = (i * size + p % size, row * size + p / size);
                sheet[y * width + x] = (255.0 * grey).round() as u8;
            }
        }
    }
    Ok(output::write_png(path, &sheet, 2 * size, width)?)
}
