//! An image at half its resolution, on which starts are followed: a quarter of the work.

use crate::raster::Field;
use crate::scene::Scene;

/// Largest pixel that is doubled \[m\]: waves of a ship of 6 m/s still have three pixels on the arms.
const LARGEST_SPACING: f64 = 5.0;

/// An image whose pixels are means over two by two.
pub(super) struct Coarse {
    pub(super) image: Field,
    pub(super) scene: Scene,
    /// Place (x, y) \[m\] of its origin in the image it was made from.
    pub(super) origin: [f64; 2],
}

impl Coarse {
    /// Of an image without an impulse response, whose speckle is independent from pixel to pixel; others, and those of coarse
    /// pixels, are taken as they are.
    pub(super) fn of(image: &Field, scene: &Scene) -> Self {
        let mut coarse = scene.clone();
        let grid = &mut coarse.grid;
        if grid.spacing > LARGEST_SPACING || scene.radar.range_resolution.is_some() {
            return Self {
                image: image.clone(),
                scene: coarse,
                origin: [0.0; 2],
            };
        }
        (grid.rows, grid.columns) = (grid.rows / 2, grid.columns / 2);
        grid.spacing *= 2.0;
        grid.oversampling = Some(1);
        coarse.radar.looks *= 4;
        let columns = grid.columns;
        let mean = |n: usize| {
            let (i, j) = (2 * (n / columns), 2 * (n % columns));
            let pixels = [(i, j), (i, j + 1), (i + 1, j), (i + 1, j + 1)];
            0.25 * pixels.iter().map(|&(i, j)| image.at(i, j)).sum::<f32>()
        };
        let half = |all: usize, halved: usize| {
            scene.grid.spacing * (2.0 * (halved / 2) as f64 + 0.5 - (all / 2) as f64)
        };
        Self {
            image: Field {
                rows: grid.rows,
                columns,
                values: (0..grid.rows * columns).map(mean).collect(),
            },
            origin: [
                half(scene.grid.columns, columns),
                -half(scene.grid.rows, grid.rows),
            ],
            scene: coarse,
        }
    }
}
