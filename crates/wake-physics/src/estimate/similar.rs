//! Relative change of an image by a wake, drawn once and stretched and turned to other speeds and headings.
//!
//! In deep water the wakes of all speeds are similar: lengths grow as U². A radar sees a wake that is turned by a few degrees almost like the turned image. So
//! images of nearby speeds and headings follow from one by a similarity transform about midship.

use super::expected::ExpectedImage;
use crate::error::Result;
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
    /// - `scene`: its grid is drawn on
    /// - `midship` at the time of the image, from the middle of the grid \[m\]
    /// - `open`: intensity of the open sea
    pub(super) fn new(scene: &Scene, course: Course, midship: [f64; 2], open: f32) -> Result<Self> {
        let mut scene = scene.clone();
        let run = course.speed * scene.sea.time;
        if let Some(ship) = scene.ships.first_mut() {
            (ship.speed, ship.heading) = (course.speed, course.heading);
            ship.position = Track::new(midship, course.heading, -run).position;
        }
        let mut change = ExpectedImage::new(&scene, &[])?.intensity(&scene)?;
        for value in &mut change.values {
            *value = *value / open - 1.0;
        }
        let grid = &scene.grid;
        Ok(Self {
            change,
            raster: Raster::image(grid.rows, grid.columns, grid.spacing),
            midship,
            course,
        })
    }

    /// Change by a ship of another course.
    ///
    /// - `raster` of the result, `midship` there, `weight` by place relative to midship
    pub(super) fn moved(
        &self,
        raster: &Raster,
        (course, midship): (Course, [f64; 2]),
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
    let down = weights((row - i as f64) as f32);
    let right = weights((column - j as f64) as f32);
    let mut sum = 0.0;
    for (m, down) in down.iter().enumerate() {
        let start = (i + m - 1) * field.columns + j - 1;
        let line = &field.values[start..start + 4];
        sum += down * (line.iter().zip(&right)).map(|(v, w)| v * w).sum::<f32>();
    }
    sum
}

/// Weights of four points at t between the middle two.
fn weights(t: f32) -> [f32; 4] {
    let (square, cube) = (t * t, t * t * t);
    [
        -0.5 * cube + square - 0.5 * t,
        1.5 * cube - 2.5 * square + 1.0,
        -1.5 * cube + 2.0 * square + 0.5 * t,
        0.5 * (cube - square),
    ]
}
