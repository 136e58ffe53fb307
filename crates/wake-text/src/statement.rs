//! Values that a prompt states, and checks of their consistency.

use crate::amounts::Dimension;
use crate::error::{Error, Result};
use crate::pieces::Text;
use crate::subjects::Subject;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::ops::Range;
use wake_physics::{Scene, scene::Ship};

/// Scene values that a prompt states; values that it does not state are `None`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PartialScene {
    /// Whether there is a ship; `Some(false)` is open sea.
    pub ship: Option<bool>,
    /// Ship speed in m/s.
    pub ship_speed: Option<f64>,
    /// Heading of the ship, in degrees clockwise from azimuth, in [0, 360).
    pub ship_heading: Option<f64>,
    /// Wind speed at 10 m height, in m/s.
    pub wind_speed: Option<f64>,
    /// Direction toward which the wind blows, in degrees clockwise from azimuth, in [0, 360).
    pub wind_toward: Option<f64>,
    /// Fetch in m.
    pub fetch: Option<f64>,
    /// Incidence angle in degrees.
    pub incidence: Option<f64>,
}

impl PartialScene {
    /// Values that the prompt of a scene states: speeds rounded to 0.1 m/s, the others to 1, halves away from zero;
    /// directions in [0, 360).
    ///
    /// Without a ship, its speed and heading are `None`; without wind, its direction and the fetch. With several
    /// ships, the first is described.
    pub fn of(scene: &Scene) -> Self {
        let ship = scene.ships.first();
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

    /// Returns `base` with its values replaced by the stated ones.
    ///
    /// A stated speed or heading implies a ship, the default one if `base` has none. With several ships, the first is
    /// changed; "no ship" removes all.
    ///
    /// # Errors
    ///
    /// [`Error::Scene`] if the result is not valid.
    pub fn onto(&self, base: &Scene) -> Result<Scene> {
        let mut scene = base.clone();
        self.set(&mut scene);
        scene.validate()?;
        Ok(scene)
    }

    fn set(&self, scene: &mut Scene) {
        if self.ship == Some(false) {
            scene.ships.clear();
        } else if self.says_of_ships().is_some() {
            if scene.ships.is_empty() {
                scene.ships.push(Ship::default());
            }
            let ship = &mut scene.ships[0];
            ship.speed = self.ship_speed.unwrap_or(ship.speed);
            ship.heading = self.ship_heading.unwrap_or(ship.heading);
        }
        let (sea, radar) = (&mut scene.sea, &mut scene.radar);
        sea.wind_speed = self.wind_speed.unwrap_or(sea.wind_speed);
        sea.wind_toward = self.wind_toward.unwrap_or(sea.wind_toward);
        sea.fetch = self.fetch.unwrap_or(sea.fetch);
        radar.incidence = self.incidence.unwrap_or(radar.incidence);
    }

    /// Fills missing values from `other`; without a ship, the ship's values stay missing.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        let ship = self.says_of_ships().or(other.ship);
        let there = ship != Some(false);
        let either = |ours: Option<f64>, theirs: Option<f64>| ours.or(theirs).filter(|_| there);
        Self {
            ship,
            ship_speed: either(self.ship_speed, other.ship_speed),
            ship_heading: either(self.ship_heading, other.ship_heading),
            wind_speed: self.wind_speed.or(other.wind_speed),
            wind_toward: self.wind_toward.or(other.wind_toward),
            fetch: self.fetch.or(other.fetch),
            incidence: self.incidence.or(other.incidence),
        }
    }

    /// Whether there is a ship; a stated speed or heading implies one.
    pub fn says_of_ships(&self) -> Option<bool> {
        let moves = self.ship_speed.or(self.ship_heading).is_some();
        self.ship.or(moves.then_some(true))
    }

    /// Whether nothing is stated.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Checks that a scene can have the stated values, which the prompt gives in `words`.
    fn check(&self, words: &str) -> Result<()> {
        let mut scene = Scene::default();
        self.set(&mut scene);
        scene.validate().map_err(|source| Error::Impossible {
            words: words.to_owned(),
            source,
        })
    }
}

impl fmt::Display for PartialScene {
    /// Writes whether there is a ship, then the stated values under their scene-file keys, one a line.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self.ship {
            Some(true) => "there is a ship",
            Some(false) => "there is no ship",
            None => "no ship is mentioned",
        })?;
        let values = [
            ("ship.speed", self.ship_speed, "m/s"),
            ("ship.heading", self.ship_heading, "degrees"),
            ("sea.wind_speed", self.wind_speed, "m/s"),
            ("sea.wind_toward", self.wind_toward, "degrees"),
            ("sea.fetch", self.fetch, "m"),
            ("radar.incidence", self.incidence, "degrees"),
        ];
        for (key, value, unit) in values {
            if let Some(value) = value {
                write!(f, "\n{key} = {value} {unit}")?;
            }
        }
        Ok(())
    }
}

/// A value that a prompt can state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Value {
    ShipSpeed,
    ShipHeading,
    WindSpeed,
    WindToward,
    Fetch,
    Incidence,
}

impl Value {
    pub(crate) fn of(subject: Subject, dimension: Dimension) -> Option<Self> {
        match (subject, dimension) {
            (Subject::Ship | Subject::Heading, Dimension::Speed) => Some(Self::ShipSpeed),
            (Subject::Ship | Subject::Heading, Dimension::Angle) => Some(Self::ShipHeading),
            (Subject::Wind | Subject::Fetch, Dimension::Speed) => Some(Self::WindSpeed),
            (Subject::Wind | Subject::Fetch, Dimension::Angle) => Some(Self::WindToward),
            (Subject::Fetch, Dimension::Length) => Some(Self::Fetch),
            (Subject::Incidence, Dimension::Angle) => Some(Self::Incidence),
            _ => None,
        }
    }

    pub(crate) fn is_direction(self) -> bool {
        matches!(self, Self::ShipHeading | Self::WindToward)
    }

    fn slot(self, said: &mut PartialScene) -> &mut Option<f64> {
        match self {
            Self::ShipSpeed => &mut said.ship_speed,
            Self::ShipHeading => &mut said.ship_heading,
            Self::WindSpeed => &mut said.wind_speed,
            Self::WindToward => &mut said.wind_toward,
            Self::Fetch => &mut said.fetch,
            Self::Incidence => &mut said.incidence,
        }
    }
}

/// A stated value: within `margin` of `number`, from the words at `place`.
struct Stated {
    value: Value,
    number: f64,
    margin: f64,
    place: Range<usize>,
}

/// The values found so far and the words that state them.
pub(crate) struct Statement<'p> {
    prompt: &'p str,
    text: &'p Text<'p>,
    values: Vec<Stated>,
    ship: Option<Range<usize>>,
    wake: bool,
    no_ship: Option<Range<usize>>,
}

impl<'p> Statement<'p> {
    pub(crate) fn new(prompt: &'p str, text: &'p Text<'p>) -> Self {
        Self {
            prompt,
            text,
            values: Vec::new(),
            ship: None,
            wake: false,
            no_ship: None,
        }
    }

    /// Records that a subject is named.
    pub(crate) fn name(&mut self, subject: Subject, place: Range<usize>) {
        match subject {
            Subject::Ship => self.ship = Some(place),
            Subject::Wake => self.wake = true,
            _ => {}
        }
    }

    /// Records that there is no ship.
    pub(crate) fn deny_ship(&mut self, place: Range<usize>) {
        self.no_ship = Some(place);
    }

    /// Records a value, which must be possible and agree with any earlier one; the one with the smaller margin is
    /// kept.
    pub(crate) fn set(
        &mut self,
        value: Value,
        number: f64,
        margin: f64,
        place: Range<usize>,
    ) -> Result<()> {
        let mut alone = PartialScene::default();
        *value.slot(&mut alone) = Some(number);
        alone.check(&self.words(&place))?;
        let number = if value.is_direction() {
            number.rem_euclid(360.0) % 360.0
        } else {
            number
        };
        let old = self.values.iter_mut().find(|old| old.value == value);
        let Some(old) = old else {
            self.values.push(Stated {
                value,
                number,
                margin,
                place,
            });
            return Ok(());
        };
        let apart = (number - old.number).abs();
        let apart = if value.is_direction() {
            apart.min(360.0 - apart)
        } else {
            apart
        };
        let allowed = if margin > 0.0 && old.margin > 0.0 {
            0.0
        } else {
            margin.max(old.margin)
        };
        if apart > allowed + 1e-9 * old.number.abs() {
            let first = old.place.clone();
            return Err(self.contradiction(first, place));
        }
        if margin < old.margin {
            *old = Stated {
                value,
                number,
                margin,
                place,
            };
        }
        Ok(())
    }

    pub(crate) fn finish(self) -> Result<PartialScene> {
        let mut said = PartialScene::default();
        for stated in &self.values {
            *stated.value.slot(&mut said) = Some(stated.number);
        }
        let of_ship =
            |stated: &&Stated| matches!(stated.value, Value::ShipSpeed | Value::ShipHeading);
        let stated = self
            .values
            .iter()
            .find(of_ship)
            .map(|stated| stated.place.clone());
        said.ship = match (stated.or(self.ship.clone()), self.no_ship.clone()) {
            (Some(present), Some(absent)) => return Err(self.contradiction(absent, present)),
            (Some(_), None) => Some(true),
            (None, Some(_)) => Some(false),
            (None, None) => self.wake.then_some(true),
        };
        Ok(said)
    }

    fn words(&self, place: &Range<usize>) -> String {
        self.prompt[self.text.span(place.clone())].to_owned()
    }

    fn contradiction(&self, first: Range<usize>, second: Range<usize>) -> Error {
        Error::Contradiction {
            first: self.words(&first),
            second: self.words(&second),
        }
    }
}

/// Rounds to 0.1; never −0.
fn tenths(value: f64) -> f64 {
    (value * 10.0).round() / 10.0 + 0.0
}

/// Rounds to whole degrees in [0, 360).
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
        expected.ships[0].speed = 3.0;
        expected.sea.fetch = 500.0;
        assert_eq!(said.onto(&base), Ok(expected));
        assert_eq!(PartialScene::default().onto(&base), Ok(base));
    }

    #[test]
    fn a_ship_comes_and_goes_as_stated() {
        let open_sea = Scene {
            ships: Vec::new(),
            ..Scene::default()
        };
        let said = |ship, ship_heading| PartialScene {
            ship,
            ship_heading,
            ..PartialScene::default()
        };
        assert_eq!(said(None, None).onto(&open_sea).unwrap().ships, []);
        assert_eq!(
            said(Some(true), None).onto(&open_sea).unwrap().ships,
            [Ship::default()]
        );
        let ships = said(None, Some(7.0)).onto(&open_sea).unwrap().ships;
        assert_eq!(
            ships,
            [Ship {
                heading: 7.0,
                ..Ship::default()
            }]
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

    #[test]
    fn what_is_open_comes_from_the_other() {
        let some = PartialScene {
            wind_speed: Some(7.0),
            ..PartialScene::default()
        };
        let full = PartialScene::of(&Scene::default());
        let both = some.or(full);
        assert_eq!(both.wind_speed, Some(7.0));
        assert_eq!(both.incidence, full.incidence);
        let open_sea = PartialScene {
            ship: Some(false),
            ..PartialScene::default()
        };
        let sea = open_sea.or(full);
        assert_eq!((sea.ship, sea.wind_toward), (Some(false), full.wind_toward));
        assert_eq!((sea.ship_speed, sea.ship_heading), (None, None));
    }
}
