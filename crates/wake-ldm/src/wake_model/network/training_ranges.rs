//! Ranges of the scenes that a model was trained on.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::Value;
use wake_physics::Scene;

use crate::error::{Error, Result};

/// Keys that may have any value: seed, time, directions, speckle, accuracy, and the sensor, whose values have other keys.
const ANY: [&str; 9] = [
    "seed",
    "sea.time",
    "sea.wind_toward",
    "sea.swell_toward",
    "ship.heading",
    "radar.looks",
    "radar.look_overlap",
    "radar.sensor",
    "grid.oversampling",
];
/// Prefix of further keys of this kind.
const ANY_OF: &str = "model.";
/// Key for the number of ships of a scene.
const SHIPS: &str = "ships";
/// Fraction of a range by which a number may exceed it, because the ends of the sampled range were not all sampled.
const BEYOND: f64 = 0.02;

/// Values of the scenes of a training set by key: the smallest and largest number, and all other values.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct TrainingRanges(BTreeMap<String, Seen>);

/// Values of one key.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Seen {
    /// Smallest and largest number.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    range: Option<[f64; 2]>,
    /// Strings, booleans, and `null` for a key that some scenes lack.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    values: Vec<Value>,
}

impl TrainingRanges {
    /// Ranges of some scenes.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::Json`] for a scene that cannot be written.
    pub fn of<'a>(scenes: impl IntoIterator<Item = &'a Scene>) -> Result<Self> {
        let mut ranges = Self::default();
        for scene in scenes {
            for (key, value) in leaves(scene)? {
                ranges.0.entry(key).or_default().add(&value);
            }
        }
        Ok(ranges)
    }

    /// Checks that a scene is within the ranges; empty ranges contain every scene.
    ///
    /// Keys that are missing in the ranges must have their default.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::InvalidOption`] with the first value outside the ranges, named as in a scene file.
    pub fn check(&self, scene: &Scene) -> Result<()> {
        if self.0.is_empty() {
            return Ok(());
        }
        let defaults = Self::of([&Scene::default()])?;
        for (option, value) in leaves(scene)? {
            let seen = self.0.get(&option).or_else(|| defaults.0.get(&option));
            let seen = seen.cloned().unwrap_or_default();
            if !seen.holds(&value) {
                return Err(Error::Model(wake_nn::Error::InvalidOption {
                    option,
                    value: value.to_string(),
                    expected: format!("{seen}, as in the training images of the model"),
                }));
            }
        }
        Ok(())
    }
}

impl Seen {
    fn add(&mut self, value: &Value) {
        match value.as_f64() {
            Some(number) => {
                let [low, high] = self.range.unwrap_or([number; 2]);
                self.range = Some([low.min(number), high.max(number)]);
            }
            None if !self.values.contains(value) => self.values.push(value.clone()),
            None => {}
        }
    }

    fn holds(&self, value: &Value) -> bool {
        match (value.as_f64(), self.range) {
            (Some(number), Some([low, high])) => {
                let beyond = BEYOND * (high - low) + 1e-9 * high.abs();
                (low - beyond..=high + beyond).contains(&number)
            }
            (Some(_), None) => false,
            (None, _) => self.values.contains(value),
        }
    }
}

impl std::fmt::Display for Seen {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut parts = Vec::new();
        if let Some([low, high]) = self.range {
            parts.push(match high > low {
                true => format!("{low} to {high}"),
                false => low.to_string(),
            });
        }
        parts.extend(self.values.iter().map(|value| match value {
            Value::Null => "absent".to_owned(),
            value => value.to_string(),
        }));
        match parts.is_empty() {
            true => write!(f, "absent"),
            false => write!(f, "{}", parts.join(" or ")),
        }
    }
}

/// All values of a scene by key, with the same keys for every ship. An infinite depth is a string.
fn leaves(scene: &Scene) -> Result<Vec<(String, Value)>> {
    let json = |source| {
        Error::Model(wake_nn::Error::Json {
            path: "scene".into(),
            source,
        })
    };
    let mut shared = scene.clone();
    let ships = std::mem::take(&mut shared.ships);
    let mut found = vec![(SHIPS.to_owned(), Value::from(ships.len()))];
    walk(
        "",
        &serde_json::to_value(&shared).map_err(json)?,
        &mut found,
    );
    for ship in &ships {
        walk(
            "ship",
            &serde_json::to_value(ship).map_err(json)?,
            &mut found,
        );
    }
    found.retain(|(key, _)| !ANY.contains(&key.as_str()) && !key.starts_with(ANY_OF));
    Ok(found)
}

fn walk(name: &str, value: &Value, found: &mut Vec<(String, Value)>) {
    match value {
        Value::Object(entries) => {
            for (key, value) in entries {
                let name = match name {
                    "" => key.clone(),
                    _ => format!("{name}.{key}"),
                };
                walk(&name, value, found);
            }
        }
        // Positions are read axis by axis; all lists of a scene hold values of one kind.
        Value::Array(list) => list.iter().for_each(|value| walk(name, value, found)),
        value => found.push((name.to_owned(), value.clone())),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;

    fn scene(assignments: &[&str]) -> Scene {
        Scene::default().with_assignments(assignments).unwrap()
    }

    #[test]
    fn what_lies_between_scenes_that_were_seen_is_held_and_nothing_else() {
        let mut open = scene(&[
            "sea.wind_speed=3.0",
            "sea.depth=12.0",
            "radar.range_resolution=8.0",
        ]);
        open.ships.clear();
        let ranges =
            TrainingRanges::of(&[scene(&["sea.wind_speed=9.0", "ship.length=80.0"]), open])
                .unwrap();
        let check = |assignments: &[&str]| ranges.check(&scene(assignments));
        assert!(check(&["sea.wind_speed=6.0", "ship.length=80.0"]).is_ok());
        assert!(
            check(&[
                "ship.length=80.0",
                "radar.range_resolution=8.0",
                "seed=4",
                "radar.looks=20"
            ])
            .is_ok()
        );
        assert!(check(&["ship.length=80.0", "model.tolerance=0.05", "sea.depth=12.0"]).is_ok());
        for (assignment, told) in [
            (
                "sea.wind_speed=9.5",
                "sea.wind_speed is 9.5, expected 3 to 9,",
            ),
            ("ship.length=81.0", "ship.length is 81.0, expected 80,"),
            (
                "radar.polarization=HH",
                "radar.polarization is \"HH\", expected \"VV\",",
            ),
            ("sea.depth=40.0", "sea.depth is 40.0, expected 12 or"),
            (
                "radar.noise_floor=-20.0",
                "radar.noise_floor is -20.0, expected absent,",
            ),
            (
                "radar.range_resolution=20.0",
                "radar.range_resolution is 20.0, expected 8,",
            ),
        ] {
            let refused = check(&["ship.length=80.0", assignment])
                .unwrap_err()
                .to_string();
            assert!(refused.contains(told), "{refused}");
        }
        let mut two = scene(&["ship.length=80.0"]);
        two.ships.push(two.ships[0].clone());
        let refused = ranges.check(&two).unwrap_err().to_string();
        assert!(refused.contains("ships is 2, expected 0 to 1"), "{refused}");
    }

    #[test]
    fn it_is_read_as_it_was_written() {
        let ranges = TrainingRanges::of(&[
            scene(&[]),
            scene(&["ship.echo=true", "radar.noise_floor=-20.0"]),
        ]);
        let ranges = ranges.unwrap();
        let text = serde_json::to_string(&ranges).unwrap();
        assert_eq!(
            serde_json::from_str::<TrainingRanges>(&text).unwrap(),
            ranges
        );
    }
}
