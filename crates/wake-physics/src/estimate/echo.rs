//! Pixels covered by a ship's echo, which the mean image does not describe, and the echo's displacement.

use super::search::SPEEDS;
use crate::raster::{Field, Raster};
use crate::scene::Scene;
use crate::track::Track;

/// Ratio to the median above which a pixel belongs to an echo: far above single-look speckle and the brightest waves (chosen).
const BRIGHT: f32 = 40.0;

/// Ratio to the mean image of the wake above which such a pixel is not a crest of the wake (chosen): single-look speckle is
/// brighter in 5 of 100,000 pixels.
const UNEXPLAINED: f64 = 10.0;

/// Distance around such a pixel that is masked \[m\], in addition to twice the resolution (chosen).
const AROUND: f64 = 20.0;

/// Standard deviation of the distance of an echo's middle from midship, as a fraction of the ship's length (chosen).
const OFF_MIDSHIP: f64 = 0.15;

/// Echoes of an image.
pub(super) struct Echo {
    columns: usize,
    covered: Vec<bool>,
    /// Index in the image, (x, y) and brightness of bright pixels.
    bright: Vec<(usize, [f64; 2], f64)>,
    resolution: f64,
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
        let raster = Raster::image(image.rows, image.columns, scene.grid.spacing);
        let mut bright = Vec::new();
        for (n, value) in image.values.iter().enumerate().filter(|(_, v)| **v > limit) {
            let (i, j) = (n / image.columns, n % image.columns);
            bright.push((n, [raster.x(j), raster.y(i)], f64::from(*value)));
            for row in i.saturating_sub(reach)..(i + reach + 1).min(image.rows) {
                let start = row * image.columns;
                let [from, to] = [j.saturating_sub(reach), (j + reach + 1).min(image.columns)];
                covered[start + from..start + to].fill(true);
            }
        }
        Self {
            columns: image.columns,
            covered,
            bright,
            resolution: resolution.max(scene.radar.azimuth_resolution),
        }
    }

    /// Velocity of a scene's ship toward the radar and its standard deviation [m/s], from the azimuth displacement of its echo:
    /// (y of the echo − y of midship)/(R/V). `None` without an echo at the ship's range.
    ///
    /// - `deviation`: standard deviation of the ship's y \[m\]
    /// - `mean`: image that explains the wake, so that bright crests are not mistaken for echoes
    pub(super) fn radial_velocity(
        &self,
        scene: &Scene,
        mean: &Field,
        deviation: f64,
    ) -> Option<[f64; 2]> {
        let ship = scene.ships.first()?;
        let ratio = scene.radar.range_to_velocity;
        let track = Track::new(ship.position, ship.heading, ship.speed * scene.sea.time);
        let [x, y] = track.position;
        let size = 0.5 * ship.length + 2.0 * self.resolution;
        let reach = ratio * SPEEDS[1] * scene.radar.incidence.to_radians().sin() + size;
        let near = |place: &[f64; 2], [x, y]: [f64; 2], [across, along]: [f64; 2]| {
            (place[0] - x).abs() < across && (place[1] - y).abs() < along
        };
        let is_echo = |n: usize, value: f64| value > UNEXPLAINED * f64::from(mean.values[n]);
        let echoes = self.bright.iter().filter(|one| is_echo(one.0, one.2));
        let echoes: Vec<([f64; 2], f64)> = echoes.map(|one| (one.1, one.2)).collect();
        let of_ship = echoes
            .iter()
            .filter(|(place, _)| near(place, [x, y], [size, reach]));
        let (brightest, _) = of_ship.max_by(|a, b| a.1.total_cmp(&b.1))?;
        let body = echoes
            .iter()
            .filter(|(place, _)| near(place, *brightest, [size; 2]));
        let (sum, total) = body.fold((0.0, 0.0), |(sum, total), (place, value)| {
            (sum + value * place[1], total + value)
        });
        let along = OFF_MIDSHIP * ship.length * ship.heading.to_radians().cos();
        let off = along.hypot(deviation).hypot(0.25 * self.resolution);
        (ratio > 0.0).then(|| [(sum / total - y) / ratio, off / ratio])
    }

    /// Weight of a pixel: 0 under an echo.
    pub(super) fn shown(&self, row: usize, column: usize) -> f64 {
        f64::from(u8::from(!self.covered[row * self.columns + column]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A pixel 60 times as bright as the sea is an echo where the mean image has a crest of twice the sea, but not where the
    /// crest is 30 times as bright.
    #[test]
    fn a_crest_that_the_mean_image_has_is_no_echo() {
        let keys = [
            "grid.rows=64",
            "grid.columns=64",
            "grid.spacing=4",
            "ship.heading=0",
            "ship.position=[0, 0]",
        ];
        let scene = Scene::default().with_assignments(&keys).unwrap();
        let raster = Raster::image(64, 64, 4.0);
        let bright = 40 * 64 + 32;
        let mut image = Field::constant(&raster, 1.0);
        image.values[bright] = 60.0;
        let echo = Echo::of(&image, &scene);
        assert!(echo.shown(40, 32) < 0.5 && echo.shown(10, 10) > 0.5);
        let velocity = |crest: f32| {
            let mut mean = Field::constant(&raster, 1.0);
            mean.values[bright] = crest;
            echo.radial_velocity(&scene, &mean, 1.0)
        };
        // Eight rows of 4 m toward smaller y.
        let expected = -32.0 / scene.radar.range_to_velocity;
        let [found, _] = velocity(2.0).unwrap();
        assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        assert_eq!(velocity(30.0), None);
    }
}
