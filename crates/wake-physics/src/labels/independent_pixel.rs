//! Side of an independent pixel of an image.

use crate::scene::Scene;

/// Side of an independent pixel of a scene's image \[pixels\]: the resolution of the impulse response over the pixel spacing, at
/// least 1, as the geometric mean of both directions; 1 without an impulse response.
#[must_use]
pub fn independent_pixel(scene: &Scene) -> f64 {
    let pixels = |resolution: f64| (resolution / scene.grid.spacing).max(1.0);
    scene.radar.range_resolution.map_or(1.0, |range| {
        (pixels(range) * pixels(scene.radar.azimuth_resolution)).sqrt()
    })
}
