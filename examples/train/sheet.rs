//! Images of a model beside simulated ones.

use std::path::Path;

use wake_ldm::dataset::Pair;
use wake_physics::output;

use super::stages::Outcome;

/// Simulated images above, images of the model below.
pub(crate) fn sheet(examples: &[Pair], drawn: &[Vec<f32>], path: &Path) -> Outcome<()> {
    let (size, width) = (
        examples[0].image.rows,
        examples[0].image.rows * examples.len(),
    );
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
