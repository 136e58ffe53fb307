//! The numbers of a pair that a model can be conditioned on.

use serde::{Deserialize, Serialize};
use wake_physics::Scene;
use wake_physics::scene::Ship;

/// The values of a scene that a data set varies, one column of its table each.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Parameters {
    /// Whether there is a ship; without one the values of the ship are `None`.
    pub ship: bool,
    /// Ship speed [m/s].
    pub ship_speed: Option<f64>,
    /// Where the ship moves to [deg clockwise from azimuth].
    pub ship_heading: Option<f64>,
    /// Ground range of midship \[m\].
    pub ship_x: Option<f64>,
    /// Azimuth of midship \[m\].
    pub ship_y: Option<f64>,
    /// Length of the ship \[m\].
    pub ship_length: Option<f64>,
    /// Wind speed at 10 m height [m/s].
    pub wind_speed: f64,
    /// Where the wind blows to [deg clockwise from azimuth].
    pub wind_toward: f64,
    /// Fetch \[m\].
    pub fetch: f64,
    /// Incidence angle \[deg\].
    pub incidence: f64,
    /// Seed of the sea and of the speckle.
    pub seed: u64,
}

impl Parameters {
    /// The values of a scene.
    pub fn of(scene: &Scene) -> Self {
        let ship = |value: fn(&Ship) -> f64| scene.ship.as_ref().map(value);
        Self {
            ship: scene.ship.is_some(),
            ship_speed: ship(|s| s.speed),
            ship_heading: ship(|s| s.heading),
            ship_x: ship(|s| s.position[0]),
            ship_y: ship(|s| s.position[1]),
            ship_length: ship(|s| s.length),
            wind_speed: scene.sea.wind_speed,
            wind_toward: scene.sea.wind_toward,
            fetch: scene.sea.fetch,
            incidence: scene.radar.incidence,
            seed: scene.seed,
        }
    }

    /// A base that has all other values, with these in the place of its own.
    pub fn onto(&self, base: &Scene) -> Scene {
        let mut scene = base.clone();
        scene.seed = self.seed;
        scene.sea.wind_speed = self.wind_speed;
        scene.sea.wind_toward = self.wind_toward;
        scene.sea.fetch = self.fetch;
        scene.radar.incidence = self.incidence;
        let own = base.ship.clone().unwrap_or_default();
        let position = [
            self.ship_x.unwrap_or(own.position[0]),
            self.ship_y.unwrap_or(own.position[1]),
        ];
        let ship = Ship {
            speed: self.ship_speed.unwrap_or(own.speed),
            heading: self.ship_heading.unwrap_or(own.heading),
            position,
            ..with_length(&own, self.ship_length.unwrap_or(own.length))
        };
        scene.ship = self.ship.then_some(ship);
        scene
    }
}

/// A ship of another length; beam and draft keep their proportion to it.
pub(super) fn with_length(ship: &Ship, length: f64) -> Ship {
    let scale = length / ship.length;
    Ship {
        length,
        beam: scale * ship.beam,
        draft: scale * ship.draft,
        ..ship.clone()
    }
}
