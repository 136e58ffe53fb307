//! The echo of the ship in the image: where it is, and what its displacement tells of the radial velocity.

use super::parameter::{Parameter, State};
use super::value::Value;
use crate::measure::median;
use crate::raster::{Field, Raster};
use crate::sar::geometry::{azimuth_displacement, ship_radial_velocity};
use crate::scene::Scene;

/// Times the median from which a mean of three by three pixels is an echo: sea and speckle of a look stay below.
const BRIGHT: f64 = 12.0;

/// Standard deviation of the echo's middle against midship, of a length of the ship: structures scatter where they stand.
const OFF_MIDSHIP: f64 = 0.15;

/// Smallest standard deviation of the middle of an echo [pixels].
const FINEST: f64 = 0.7;

/// A bright spot that may be a ship.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Echo {
    /// Its middle (x, y) \[m\].
    pub(super) position: [f64; 2],
    /// Standard deviation along each axis \[m\].
    pub(super) deviation: f64,
    /// Radius of what is bright \[m\].
    radius: f64,
}

impl Echo {
    /// The brightest spot of an image, if it is bright enough for a ship.
    pub(super) fn of(image: &Field, scene: &Scene) -> Option<Self> {
        let raster = Raster::image(image.rows, image.columns, scene.grid.spacing);
        let level = f64::from(median(&image.values));
        let mean = |i: usize, j: usize| -> f64 {
            let rows = (i - 1..=i + 1).flat_map(|i| (j - 1..=j + 1).map(move |j| (i, j)));
            rows.map(|(i, j)| f64::from(image.at(i, j))).sum::<f64>() / 9.0
        };
        let inner = |n: usize| {
            let (i, j) = (n / image.columns, n % image.columns);
            let inside = i > 0 && j > 0 && i + 1 < image.rows && j + 1 < image.columns;
            inside.then_some((i, j))
        };
        let bright =
            |(i, j): (usize, usize)| (mean(i, j) > BRIGHT * level).then(|| (mean(i, j), i, j));
        let spots = (0..image.values.len()).filter_map(inner).filter_map(bright);
        let (_, row, column) = spots.max_by(|a, b| a.0.total_cmp(&b.0))?;
        let length = scene.ships.first().map_or(100.0, |ship| ship.length);
        let reach = (length / raster.spacing).ceil() as usize + 1;
        let (mut sum, mut weight) = ([0.0; 2], 0.0);
        let mut far = 0.0f64;
        for i in row.saturating_sub(reach)..(row + reach + 1).min(image.rows) {
            for j in column.saturating_sub(reach)..(column + reach + 1).min(image.columns) {
                let value = f64::from(image.at(i, j)) - 0.5 * BRIGHT * level;
                if value > 0.0 {
                    sum[0] += value * raster.x(j);
                    sum[1] += value * raster.y(i);
                    weight += value;
                    let off = (i as f64 - row as f64).hypot(j as f64 - column as f64);
                    far = far.max(off * raster.spacing);
                }
            }
        }
        (weight > 0.0).then(|| Self {
            position: sum.map(|s| s / weight),
            deviation: (OFF_MIDSHIP * length).hypot(FINEST * raster.spacing),
            radius: far + 4.0 * raster.spacing,
        })
    }

    /// The echo in other coordinates.
    pub(super) fn moved(&self, to: impl Fn([f64; 2]) -> [f64; 2]) -> Self {
        Self {
            position: to(self.position),
            ..*self
        }
    }

    /// Weight of a pixel: 0 where the echo is.
    pub(super) fn shown(&self, scene: &Scene, i: usize, j: usize) -> f64 {
        let raster = Raster::image(scene.grid.rows, scene.grid.columns, scene.grid.spacing);
        let [dx, dy] = [
            raster.x(j) - self.position[0],
            raster.y(i) - self.position[1],
        ];
        // Sidelobes lie along range and azimuth.
        let edge = |d: f64| (d / self.radius - 1.0).clamp(0.0, 1.0);
        edge(dx.hypot(dy))
    }

    /// Residuals along x and y over the deviation, and their slopes by a parameter.
    pub(super) fn residual(&self, state: &State) -> [f64; 2] {
        let [x, y] = [Value::X, Value::Y].map(|v| v.of(&state.scene));
        [
            (self.position[0] - x) / self.deviation,
            (self.position[1] - y - displacement(&state.scene)) / self.deviation,
        ]
    }

    pub(super) fn slope(&self, state: &State, parameter: Parameter) -> [f64; 2] {
        let by_displacement = |value: Value| {
            let step = value.step(&state.scene);
            let [below, above] =
                [-step, step].map(|by| displacement(&value.moved(&state.scene, by)));
            (above - below) / (2.0 * step) / self.deviation
        };
        match parameter {
            Parameter::Value(Value::X) => [1.0 / self.deviation, 0.0],
            Parameter::Value(Value::Y) => [0.0, 1.0 / self.deviation],
            Parameter::Value(value @ (Value::Speed | Value::Heading | Value::Incidence)) => {
                [0.0, by_displacement(value)]
            }
            _ => [0.0; 2],
        }
    }

    /// Velocity toward the radar by the echo's azimuth less that of midship \[m\], with its deviation.
    pub(super) fn radial_velocity(
        &self,
        scene: &Scene,
        [y, deviation]: [f64; 2],
    ) -> Option<[f64; 2]> {
        let ratio = scene.radar.range_to_velocity;
        (ratio > 0.0).then(|| {
            [
                (self.position[1] - y) / ratio,
                self.deviation.hypot(deviation) / ratio,
            ]
        })
    }
}

/// Azimuth of a ship's echo less that of the ship \[m\].
fn displacement(scene: &Scene) -> f64 {
    let [speed, heading, incidence] =
        [Value::Speed, Value::Heading, Value::Incidence].map(|v| v.of(scene));
    let radial = ship_radial_velocity(speed, heading, incidence.to_radians());
    azimuth_displacement(scene.radar.range_to_velocity, radial)
}
