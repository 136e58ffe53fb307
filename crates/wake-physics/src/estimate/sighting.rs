//! Approximate place and heading of a wake, around which it is estimated.

use crate::error::{Error, Result};
use crate::scene::Scene;
use crate::track::Track;

/// Place and heading of a wake, from a detector, by eye, or from the echo of its ship.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sighting {
    /// Midship (x, y) \[m\] according to the wake, at the time of the image.
    pub place: [f64; 2],
    /// Heading [deg clockwise from azimuth].
    pub heading: f64,
    /// Standard deviation of the place along each axis \[m\], above 0.
    pub place_sd: f64,
    /// Standard deviation of the heading \[deg\], above 0.
    pub heading_sd: f64,
}

impl Sighting {
    /// Half width of a search, in standard deviations.
    pub(super) const REACH: f64 = 2.5;

    /// Sighting with standard deviations of 60 m and 3 degrees (chosen for `wake-detector`).
    #[must_use]
    pub fn new(place: [f64; 2], heading: f64) -> Self {
        Self {
            place,
            heading,
            place_sd: 60.0,
            heading_sd: 3.0,
        }
    }

    /// Sighting of the first ship of a scene; `None` without ships.
    #[must_use]
    pub fn of_ship(scene: &Scene) -> Option<Self> {
        let ship = scene.ships.first()?;
        let run = ship.speed * scene.sea.time;
        let track = Track::new(ship.position, ship.heading, run);
        Some(Self::new(track.position, ship.heading))
    }

    pub(super) fn check(&self) -> Result<()> {
        let [x, y] = self.place;
        let numbers = [x, y, self.heading, self.place_sd, self.heading_sd];
        let positive = self.place_sd > 0.0 && self.heading_sd > 0.0;
        if numbers.iter().all(|v| v.is_finite()) && positive {
            return Ok(());
        }
        Err(Error::Conflict {
            name: "sighting".to_owned(),
            value: format!(
                "{x}, {y} m ± {} m, heading {} ± {} degrees",
                self.place_sd, self.heading, self.heading_sd
            ),
            requirement: "but all numbers must be finite and deviations above 0".to_owned(),
        })
    }
}
