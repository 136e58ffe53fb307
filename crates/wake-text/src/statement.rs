//! What a prompt states of a scene.

use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};
use wake_physics::{Scene, scene::Ship};

/// The values a prompt states; what it does not say is `None`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PartialScene {
    /// Whether there is a ship; `Some(false)`: open sea.
    pub ship: Option<bool>,
    /// Ship speed in m/s.
    pub ship_speed: Option<f64>,
    /// Where the ship moves to, in degrees clockwise from azimuth, 0 up to 360.
    pub ship_heading: Option<f64>,
    /// Wind speed at 10 m height, in m/s.
    pub wind_speed: Option<f64>,
    /// Where the wind blows to, in degrees clockwise from azimuth, 0 up to 360.
    pub wind_toward: Option<f64>,
    /// Fetch in m.
    pub fetch: Option<f64>,
    /// Incidence angle in degrees.
    pub incidence: Option<f64>,
}

impl PartialScene {
    /// What the prompt of a scene states: speeds rounded to 0.1 m/s, the others to 1, directions within
    /// 0 up to 360; halves away from zero.
    ///
    /// Without a ship its speed and heading stay open; without wind its direction and the fetch.
    pub fn of(scene: &Scene) -> Self {
        let ship = scene.ship.as_ref();
        let wind_speed = tenths(scene.sea.wind_speed);
        let windy = wind_speed > 0.0;
        Self {
            ship: Some(ship.is_some()),
            ship_speed: ship.map(|ship| tenths(ship.speed)),
            ship_heading: ship.map(|ship| direction(ship.heading)),
            wind_speed: Some(wind_speed),
            wind_toward: windy.then(|| direction(scene.sea.wind_toward)),
            fetch: windy.then(|| scene.sea.fetch.round()),
            incidence: Some(scene.radar.incidence.round()),
        }
    }

    /// `base` with the stated values in place of its own.
    ///
    /// A stated speed or heading brings a ship, the default one if `base` has none.
    ///
    /// # Errors
    ///
    /// [`Error::Scene`] if the scene is not valid then.
    pub fn onto(&self, base: &Scene) -> Result<Scene> {
        let mut scene = base.clone();
        self.set(&mut scene);
        scene.validate()?;
        Ok(scene)
    }

    fn set(&self, scene: &mut Scene) {
        if self.ship == Some(false) {
            scene.ship = None;
        } else if self.ship.is_some() || self.ship_speed.or(self.ship_heading).is_some() {
            let ship = scene.ship.get_or_insert_with(Ship::default);
            ship.speed = self.ship_speed.unwrap_or(ship.speed);
            ship.heading = self.ship_heading.unwrap_or(ship.heading);
        }
        let (sea, radar) = (&mut scene.sea, &mut scene.radar);
        sea.wind_speed = self.wind_speed.unwrap_or(sea.wind_speed);
        sea.wind_toward = self.wind_toward.unwrap_or(sea.wind_toward);
        sea.fetch = self.fetch.unwrap_or(sea.fetch);
        radar.incidence = self.incidence.unwrap_or(radar.incidence);
    }

    /// Whether nothing is stated.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Checks that some scene can have the stated values, which the prompt gives in `words`.
    pub(crate) fn check(&self, words: &str) -> Result<()> {
        let mut scene = Scene::default();
        self.set(&mut scene);
        scene.validate().map_err(|source| Error::Impossible {
            words: words.to_owned(),
            source,
        })
    }
}

/// Rounds to 0.1; never −0.
fn tenths(value: f64) -> f64 {
    (value * 10.0).round() / 10.0 + 0.0
}

/// Rounds to whole degrees within 0 up to 360.
fn direction(degrees: f64) -> f64 {
    degrees.rem_euclid(360.0).round() % 360.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unsaid_values_are_those_of_the_base() {
        let mut base = Scene::default();
        base.sea.depth = 12.0;
        let said = PartialScene {
            ship_speed: Some(3.0),
            fetch: Some(500.0),
            ..PartialScene::default()
        };
        let mut expected = base.clone();
        expected.ship.as_mut().unwrap().speed = 3.0;
        expected.sea.fetch = 500.0;
        assert_eq!(said.onto(&base), Ok(expected));
        assert_eq!(PartialScene::default().onto(&base), Ok(base));
    }

    #[test]
    fn a_ship_comes_and_goes_as_stated() {
        let open_sea = Scene {
            ship: None,
            ..Scene::default()
        };
        let said = |ship, ship_heading| PartialScene {
            ship,
            ship_heading,
            ..PartialScene::default()
        };
        assert_eq!(said(None, None).onto(&open_sea).unwrap().ship, None);
        assert_eq!(
            said(Some(true), None).onto(&open_sea).unwrap().ship,
            Some(Ship::default())
        );
        let ship = said(None, Some(7.0)).onto(&open_sea).unwrap().ship.unwrap();
        assert_eq!(
            ship,
            Ship {
                heading: 7.0,
                ..Ship::default()
            }
        );
        assert_eq!(
            said(Some(false), None).onto(&Scene::default()),
            Ok(open_sea)
        );
    }

    #[test]
    fn values_outside_their_range_make_no_scene() {
        let said = PartialScene {
            incidence: Some(76.0),
            ..PartialScene::default()
        };
        assert!(matches!(said.onto(&Scene::default()), Err(Error::Scene(_))));
    }
}
