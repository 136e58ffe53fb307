//! Pixels that a ship's echo covers, which the mean image does not describe.

use crate::raster::Field;
use crate::scene::Scene;

/// Brightness over the median from which a pixel belongs to an echo: far above speckle of one look and the brightest waves (chosen).
const BRIGHT: f32 = 40.0;

/// Distance from such a pixel that is left out \[m\], beside twice the resolution (chosen).
const AROUND: f64 = 20.0;

/// Echoes of an image.
pub(super) struct Echo {
    columns: usize,
    covered: Vec<bool>,
}

impl Echo {
    pub(super) fn of(image: &Field, scene: &Scene) -> Self {
        let mut sorted = image.values.clone();
        let middle = sorted.len() / 2;
        let (_, median, _) = sorted.select_nth_unstable_by(middle, f32::total_cmp);
        let limit = match *median > 0.0 {
            true => BRIGHT * *median,
            false => f32::INFINITY,
        };
        let resolution = scene.radar.range_resolution.unwrap_or(0.0);
        let around = AROUND + 2.0 * resolution.max(scene.radar.azimuth_resolution);
        let reach = (around / scene.grid.spacing).ceil() as usize;
        let mut covered = vec![false; image.values.len()];
        for (n, _) in image.values.iter().enumerate().filter(|(_, v)| **v > limit) {
            let (i, j) = (n / image.columns, n % image.columns);
            for row in i.saturating_sub(reach)..(i + reach + 1).min(image.rows) {
                let start = row * image.columns;
                let [from, to] = [j.saturating_sub(reach), (j + reach + 1).min(image.columns)];
                covered[start + from..start + to].fill(true);
            }
        }
        Self {
            columns: image.columns,
            covered,
        }
    }

    /// Weight of a pixel: 0 under an echo.
    pub(super) fn shown(&self, row: usize, column: usize) -> f64 {
        f64::from(u8::from(!self.covered[row * self.columns + column]))
    }
}
