//! The numbers of a scene, as far as they are known.

use wake_text::PartialScene;

/// Length of the ship that the small model knows \[m\]: the one of the paper's grid.
pub(super) const SHIP_LENGTH: f64 = 195.0;

/// What is known of a scene; `None` is left open.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Conditions {
    /// Whether there is a ship.
    pub ship: Option<bool>,
    /// Ship speed [m/s].
    pub ship_speed: Option<f64>,
    /// Where the ship moves to [deg clockwise from azimuth].
    pub ship_heading: Option<f64>,
    /// Midship (x, y) \[m\].
    pub ship_position: Option<[f64; 2]>,
    /// Wind speed at 10 m height [m/s].
    pub wind_speed: Option<f64>,
    /// Where the wind blows to [deg clockwise from azimuth].
    pub wind_toward: Option<f64>,
    /// Fetch \[m\].
    pub fetch: Option<f64>,
    /// Incidence angle \[deg\].
    pub incidence: Option<f64>,
}

impl Conditions {
    /// What a prompt states; its ship, if any, is in the middle of the image.
    pub fn of_prompt(said: &PartialScene) -> Self {
        Self {
            ship: said.ship,
            ship_speed: said.ship_speed,
            ship_heading: said.ship_heading,
            ship_position: said.ship_speed.and(Some([0.0, 0.0])),
            wind_speed: said.wind_speed,
            wind_toward: said.wind_toward,
            fetch: said.fetch,
            incidence: said.incidence,
        }
    }

    /// Speed, heading and place of the ship, where all are known.
    pub fn track(&self) -> Option<(f64, f64, [f64; 2])> {
        let known = self.ship != Some(false);
        let (speed, heading) = self.ship_speed.zip(self.ship_heading).filter(|_| known)?;
        Some((speed, heading, self.ship_position?))
    }
}
