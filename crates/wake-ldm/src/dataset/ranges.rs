//! Scenes drawn from ranges.

use crate::error::{Error, Result, check_range};
use crate::noise::{NoiseSource, uniform};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};
use std::cmp::Ordering;
use wake_physics::Scene;
use wake_physics::scene::Ship;

/// A closed range, low end first.
type Range = [f64; 2];

/// The ranges that scenes are drawn from, each value on its own.
///
/// Values are uniform, the fetch uniform in its logarithm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ranges {
    /// Share of scenes without a ship, 0 to 1.
    pub open_sea: f64,
    /// Where the ship is.
    pub place: Place,
    /// Ship speed [m/s].
    #[serde(deserialize_with = "two")]
    pub ship_speed: Range,
    /// Where the ship moves to [deg clockwise from azimuth].
    #[serde(deserialize_with = "two")]
    pub ship_heading: Range,
    /// Length of the ship \[m\], in steps of 0.1; beam and draft keep their proportion to it.
    #[serde(deserialize_with = "two")]
    pub ship_length: Range,
    /// Wind speed at 10 m height [m/s].
    #[serde(deserialize_with = "two")]
    pub wind_speed: Range,
    /// Where the wind blows to [deg clockwise from azimuth].
    #[serde(deserialize_with = "two")]
    pub wind_toward: Range,
    /// Fetch \[m\].
    #[serde(deserialize_with = "two")]
    pub fetch: Range,
    /// Incidence angle \[deg\].
    #[serde(deserialize_with = "two")]
    pub incidence: Range,
}

/// Where the ship is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Place {
    /// At the position of the recipe's scene, by default the middle of the image.
    Fixed,
    /// Anywhere in the image.
    Random,
}

impl Default for Ranges {
    /// The span of the paper's grid, all directions, one ship size, the ship anywhere, a fifth open sea.
    fn default() -> Self {
        let length = Ship::default().length;
        Self {
            open_sea: 0.2,
            place: Place::Random,
            ship_speed: [6.0, 12.0],
            ship_heading: [0.0, 360.0],
            ship_length: [length, length],
            wind_speed: [3.0, 7.0],
            wind_toward: [0.0, 360.0],
            fetch: [10e3, 70e3],
            incidence: [16.0, 32.0],
        }
    }
}

/// What is drawn: the number of its stream of random numbers.
#[derive(Clone, Copy)]
enum Value {
    OpenSea,
    ShipX,
    ShipY,
    ShipSpeed,
    ShipHeading,
    ShipLength,
    WindSpeed,
    WindToward,
    Fetch,
    Incidence,
}

impl Ranges {
    /// Scene number `index`: `base` with the drawn values in place of its own, not yet rounded.
    pub(super) fn scene(&self, base: &Scene, source: NoiseSource, index: u64) -> Scene {
        let draw = |value: Value| source.uniform(uniform::VALUES + value as u32, index);
        if draw(Value::OpenSea) < self.open_sea {
            let scene = self.set(base, draw);
            return Scene {
                ships: Vec::new(),
                ..scene
            };
        }
        self.set(base, draw)
    }

    /// `base` with every value at the place 0…1 of its range that `at` says.
    fn set(&self, base: &Scene, at: impl Fn(Value) -> f64) -> Scene {
        let between = |[low, high]: Range, value| low + (high - low) * at(value);
        let mut scene = base.clone();
        scene.sea.wind_speed = between(self.wind_speed, Value::WindSpeed);
        scene.sea.wind_toward = between(self.wind_toward, Value::WindToward);
        scene.sea.fetch = between(self.fetch.map(f64::ln), Value::Fetch)
            .exp()
            .clamp(self.fetch[0], self.fetch[1]);
        scene.radar.incidence = between(self.incidence, Value::Incidence);
        let length = tenths(between(self.ship_length, Value::ShipLength));
        if scene.ships.is_empty() {
            scene.ships.push(Ship::default());
        }
        // Of several ships the first is drawn.
        let ship = &mut scene.ships[0];
        *ship = with_length(ship, length);
        ship.speed = between(self.ship_speed, Value::ShipSpeed);
        ship.heading = between(self.ship_heading, Value::ShipHeading);
        if self.place == Place::Random {
            let grid = &base.grid;
            ship.position = [
                place(grid.columns, grid.spacing, at(Value::ShipX)),
                -place(grid.rows, grid.spacing, at(Value::ShipY)),
            ];
        }
        scene
    }

    /// Checks the ranges, and the scenes at both ends of all of them.
    pub(super) fn validate(&self, base: &Scene) -> Result<()> {
        check_range("draw.ranges.open_sea", self.open_sea, 0.0, 1.0)?;
        for (name, [low, high]) in [
            ("ship_speed", self.ship_speed),
            ("ship_heading", self.ship_heading),
            ("ship_length", self.ship_length),
            ("wind_speed", self.wind_speed),
            ("wind_toward", self.wind_toward),
            ("fetch", self.fetch),
            ("incidence", self.incidence),
        ] {
            if low.partial_cmp(&high).is_none_or(Ordering::is_gt) {
                return Err(Error::InvalidOption {
                    option: format!("draw.ranges.{name}"),
                    value: format!("[{low}, {high}]"),
                    expected: "two numbers, the lower first".to_owned(),
                });
            }
        }
        // Where the fetch is no positive number it has no logarithm to draw from.
        for fetch in self.fetch {
            let mut scene = base.clone();
            scene.sea.fetch = fetch;
            scene.validate()?;
        }
        for end in [0.0, 1.0] {
            self.set(base, |_| end).validate()?;
        }
        Ok(())
    }
}

/// Exactly two numbers.
fn two<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Range, D::Error> {
    let numbers = Vec::<f64>::deserialize(deserializer)?;
    let count = numbers.len();
    let expected =
        |_| D::Error::custom(format!("{count} numbers, expected the two ends of a range"));
    numbers.try_into().map_err(expected)
}

fn tenths(value: f64) -> f64 {
    (10.0 * value).round() / 10.0
}

/// A coordinate \[m\] between the first pixel's centre and the last one's, in steps of 0.1 m.
fn place(pixels: usize, spacing: f64, at: f64) -> f64 {
    let first = -((pixels / 2) as f64);
    let pixel = first + at * (pixels - 1) as f64;
    tenths(spacing * pixel)
}

/// A ship of another length; beam and draft keep their proportion to it, in steps of 0.1 mm, so that every reader of
/// JSON gets the same numbers.
fn with_length(ship: &Ship, length: f64) -> Ship {
    let scaled = |size: f64| (1e4 * size * length / ship.length).round() / 1e4;
    Ship {
        length,
        beam: scaled(ship.beam),
        draft: scaled(ship.draft),
        ..ship.clone()
    }
}
