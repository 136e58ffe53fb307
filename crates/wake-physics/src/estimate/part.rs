//! Coarser images and parts of an image, on which the search is cheap.

use crate::raster::Field;
use crate::scene::Scene;

/// An image with its scene, and the place of its origin in the image it was made from.
#[derive(Debug, Clone)]
pub(super) struct Part {
    pub(super) image: Field,
    pub(super) scene: Scene,
    /// (x, y) \[m\].
    pub(super) origin: [f64; 2],
}

impl Part {
    pub(super) fn whole(image: &Field, scene: &Scene) -> Self {
        Self {
            image: image.clone(),
            scene: scene.clone(),
            origin: [0.0; 2],
        }
    }

    /// Means over squares of pixels. Pixels of an image with an impulse response are not independent, so it is left as it is.
    pub(super) fn coarser(&self, factor: usize) -> Self {
        if factor < 2 || self.scene.radar.range_resolution.is_some() {
            return self.clone();
        }
        let mut scene = self.scene.clone();
        let grid = &mut scene.grid;
        (grid.rows, grid.columns) = (grid.rows / factor, grid.columns / factor);
        grid.spacing *= factor as f64;
        // Waves below the pixels do not matter to a search.
        grid.oversampling = Some(1);
        scene.radar.looks *= (factor * factor) as u32;
        let (rows, columns) = (grid.rows, grid.columns);
        let mean = |n: usize| {
            let (i, j) = (factor * (n / columns), factor * (n % columns));
            let rows =
                (i..i + factor).map(|i| (j..j + factor).map(|j| self.image.at(i, j)).sum::<f32>());
            rows.sum::<f32>() / (factor * factor) as f32
        };
        let off = |all: usize, kept: usize| {
            let middle = (factor * (kept / 2)) as f64 + 0.5 * (factor as f64 - 1.0);
            self.scene.grid.spacing * (middle - (all / 2) as f64)
        };
        Self {
            image: Field {
                rows,
                columns,
                values: (0..rows * columns).map(mean).collect(),
            },
            origin: [
                self.origin[0] + off(self.image.columns, columns),
                self.origin[1] - off(self.image.rows, rows),
            ],
            scene,
        }
    }

    /// The part around a place (x, y) \[m\] of this image, `side` pixels wide or as wide as the image is.
    pub(super) fn around(&self, [x, y]: [f64; 2], side: usize) -> Self {
        let grid = &self.scene.grid;
        let (rows, columns) = (side.min(grid.rows), side.min(grid.columns));
        let first = |middle: f64, all: usize, part: usize| -> usize {
            let first = (middle + (all / 2) as f64).round() - (part / 2) as f64;
            first.clamp(0.0, (all - part) as f64) as usize
        };
        let row = first(-y / grid.spacing, grid.rows, rows);
        let column = first(x / grid.spacing, grid.columns, columns);
        let mut scene = self.scene.clone();
        (scene.grid.rows, scene.grid.columns) = (rows, columns);
        let value = |n: usize| self.image.at(row + n / columns, column + n % columns);
        let off = |first: usize, part: usize, all: usize| {
            grid.spacing * ((first + part / 2) as f64 - (all / 2) as f64)
        };
        Self {
            image: Field {
                rows,
                columns,
                values: (0..rows * columns).map(value).collect(),
            },
            scene,
            origin: [
                self.origin[0] + off(column, columns, grid.columns),
                self.origin[1] - off(row, rows, grid.rows),
            ],
        }
    }

    /// A place of the image this was made from, in this one.
    pub(super) fn from_whole(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [x - self.origin[0], y - self.origin[1]]
    }

    /// A place of this image in the one it was made from.
    pub(super) fn to_whole(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [x + self.origin[0], y + self.origin[1]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::Raster;

    /// A ramp keeps its value at every place of a coarser part.
    #[test]
    fn places_stay() {
        let mut scene = Scene::default();
        (scene.grid.rows, scene.grid.columns, scene.grid.spacing) = (40, 48, 4.0);
        let raster = Raster::image(40, 48, 4.0);
        let ramp = |x: f64, y: f64| (1000.0 + 2.0 * x + 5.0 * y) as f32;
        let image = Field::from_fn(&raster, |i, j| ramp(raster.x(j), raster.y(i)));
        for factor in [1, 2, 4] {
            let part = Part::whole(&image, &scene)
                .coarser(factor)
                .around([30.0, -20.0], 6);
            let grid = &part.scene.grid;
            let own = Raster::image(grid.rows, grid.columns, grid.spacing);
            for (i, j) in [(0, 0), (2, 5), (5, 1)] {
                let [x, y] = part.to_whole([own.x(j), own.y(i)]);
                assert!((part.image.at(i, j) - ramp(x, y)).abs() < 1e-2, "{factor}");
                assert_eq!(part.from_whole([x, y]), [own.x(j), own.y(i)]);
            }
        }
    }
}
