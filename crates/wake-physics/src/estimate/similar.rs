//! Relative change of an image by a wake, drawn once and stretched and turned to other speeds and headings.
//!
//! In deep water the wakes of all speeds are similar: lengths grow as U². Images of nearby speeds and headings therefore follow
//! from one image by a similarity transform about midship. Amplitudes and the displacement by velocity bunching do not follow it,
//! so it serves only for a search.

use super::expected::ExpectedImage;
use crate::error::Result;
use crate::numeric::catmull_rom;
use crate::raster::{Field, Raster};
use crate::scene::Scene;
use crate::track::Track;

/// Speed and heading of a ship.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Course {
    /// Speed [m/s].
    pub(super) speed: f64,
    /// Heading \[deg\].
    pub(super) heading: f64,
}

impl Course {
    /// Courses on a grid around this course.
    ///
    /// - `count`: number of courses on either side
    /// - `step`: steps of the logarithm of the speed and of the heading \[deg\]
    pub(super) fn around(self, count: [i32; 2], step: [f64; 2]) -> Vec<Self> {
        let speeds = -count[0]..=count[0];
        let of_speed = |n: i32| {
            (-count[1]..=count[1]).map(move |m| Self {
                speed: self.speed * (f64::from(n) * step[0]).exp(),
                heading: self.heading + f64::from(m) * step[1],
            })
        };
        speeds.flat_map(of_speed).collect()
    }

    /// The scene with its ship on the course.
    ///
    /// - `midship`: (x, y) at the time of the image \[m\]
    pub(super) fn on(self, scene: &Scene, midship: [f64; 2]) -> Scene {
        let mut scene = scene.clone();
        let run = self.speed * scene.sea.time;
        if let Some(ship) = scene.ships.first_mut() {
            (ship.speed, ship.heading) = (self.speed, self.heading);
            ship.position = Track::new(midship, self.heading, -run).position;
        }
        scene
    }
}

/// Relative change of an image by a wake.
pub(super) struct Drawn {
    change: Field,
    raster: Raster,
    /// Midship in the raster.
    midship: [f64; 2],
    course: Course,
}

impl Drawn {
    /// Draws the wake of the scene's ship.
    ///
    /// - `scene`: the wake is drawn on its grid
    /// - `midship`: (x, y) at the time of the image, from the middle of the grid \[m\]
    /// - `open`: intensity of the open sea
    pub(super) fn new(scene: &Scene, course: Course, midship: [f64; 2], open: f32) -> Result<Self> {
        let scene = course.on(scene, midship);
        let mut change = ExpectedImage::new(&scene, &[])?.intensity(&scene)?;
        for value in &mut change.values {
            *value = (*value / open).ln();
        }
        let grid = &scene.grid;
        Ok(Self {
            change,
            raster: Raster::image(grid.rows, grid.columns, grid.spacing),
            midship,
            course,
        })
    }

    /// Change by a ship on another course.
    ///
    /// - `raster`: raster of the result
    /// - `midship`: midship in that raster
    /// - `weight`: weight by place relative to midship
    pub(super) fn moved(
        &self,
        raster: &Raster,
        course: Course,
        midship: [f64; 2],
        weight: impl Fn([f64; 2]) -> f32,
    ) -> Field {
        let scale = (self.course.speed / course.speed).powi(2);
        let turn = (course.heading - self.course.heading).to_radians();
        let (sin, cos) = turn.sin_cos();
        let [x0, y0] = [self.raster.x(0), self.raster.y(0)];
        let spacing = self.raster.spacing;
        let mut out = Field::constant(raster, 0.0);
        for n in 0..raster.rows * raster.columns {
            let place = [
                raster.x(n % raster.columns) - midship[0],
                raster.y(n / raster.columns) - midship[1],
            ];
            let weight = weight(place);
            if weight == 0.0 {
                continue;
            }
            // Headings turn clockwise.
            let [x, y] = [
                scale * (cos * place[0] - sin * place[1]),
                scale * (sin * place[0] + cos * place[1]),
            ];
            let column = (self.midship[0] + x - x0) / spacing;
            let row = (y0 - self.midship[1] - y) / spacing;
            out.values[n] = weight * cubic(&self.change, row, column);
        }
        out
    }
}

/// Catmull–Rom interpolation; 0 outside.
fn cubic(field: &Field, row: f64, column: f64) -> f32 {
    let inside = |at: f64, count: usize| at >= 1.0 && at < count as f64 - 2.0;
    if !(inside(row, field.rows) && inside(column, field.columns)) {
        return 0.0;
    }
    let (i, j) = (row as usize, column as usize);
    let weights = |part: f64| catmull_rom(part).map(|weight| weight as f32);
    let (down, right) = (weights(row - i as f64), weights(column - j as f64));
    let mut sum = 0.0;
    for (m, down) in down.iter().enumerate() {
        let start = (i + m - 1) * field.columns + j - 1;
        let line = &field.values[start..start + 4];
        sum += down * (line.iter().zip(&right)).map(|(v, w)| v * w).sum::<f32>();
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A spot to port astern that grows as U² and turns with the ship.
    fn spot(course: Course, place: [f64; 2]) -> f64 {
        let scale = (9.0 / course.speed).powi(2);
        let seen = Track::new([0.0; 2], course.heading, 0.0).seen_from_ship(place);
        let [ahead, port] = seen.map(|v| scale * v);
        let (ahead, port) = (ahead + 65.0, port - 25.0);
        (-(ahead * ahead + port * port) / 800.0).exp()
    }

    /// Similar patterns are mapped onto each other, up to the interpolation error (spacing/width)³ = 0.008.
    #[test]
    fn similar_patterns_are_moved_into_each_other() {
        let raster = Raster::image(100, 100, 4.0);
        let of = |speed, heading| Course { speed, heading };
        let pattern = |course, [x, y]: [f64; 2]| {
            let at = |n: usize| [raster.x(n % 100) - x, raster.y(n / 100) - y];
            let values = (0..10_000).map(|n| spot(course, at(n)) as f32);
            Field {
                rows: 100,
                columns: 100,
                values: values.collect(),
            }
        };
        let drawn = Drawn {
            change: pattern(of(9.0, 40.0), [31.0, 42.0]),
            raster,
            midship: [31.0, 42.0],
            course: of(9.0, 40.0),
        };
        let there = [22.0, 51.0];
        let expected = pattern(of(9.6, 52.0), there);
        let off = |course| {
            let found = drawn.moved(&raster, course, there, |_| 1.0);
            found.difference(&expected).0
        };
        assert!(off(of(9.6, 52.0)) < 0.008, "{}", off(of(9.6, 52.0)));
        // Turned or stretched the other way.
        assert!(off(of(9.6, 28.0)) > 0.1 && off(of(8.4, 52.0)) > 0.1);
    }
}
