//! Positions and sizes of ships on the map.

use std::path::Path;

use serde_json::{Map, Value};

use crate::error::{Error, Result};

/// A ship with its geographic position, heading, speed and size.
#[derive(Clone, Debug, PartialEq)]
pub struct ShipAt {
    /// Latitude of midship on WGS84, north positive \[degrees\].
    pub latitude: f64,
    /// Longitude of midship, east positive \[degrees\].
    pub longitude: f64,
    /// Direction of travel, clockwise from true north \[degrees\].
    pub heading: f64,
    /// Speed \[m/s\].
    pub speed: f64,
    /// Length \[m\].
    pub length: f64,
    /// Beam \[m\].
    pub beam: f64,
    /// Draft \[m\].
    pub draft: f64,
}

/// Largest number of ships in a file.
const MOST_SHIPS: usize = 10_000;
/// Default ratios of length to beam and length to draft, as of the default scene's ship.
const SLENDERNESS: [f64; 2] = [7.5, 19.5];

/// Reads ships from a GeoJSON file: `Point` features with the properties `heading`, `speed`, `length` and optionally `beam`
/// and `draft`. Other properties are ignored.
///
/// # Errors
///
/// [`Error::Ships`] with the number of the invalid feature and the reason, [`Error::File`] for a file that cannot be read.
pub fn read_ships(path: &Path) -> Result<Vec<ShipAt>> {
    let text = whole_files::read_text(path)?;
    let wrong = |why: String| Error::Ships {
        path: path.to_owned(),
        why,
    };
    let file: Value =
        serde_json::from_str(&text).map_err(|e| wrong(format!("it is not valid JSON: {e}")))?;
    let Some(features) = file.get("features").and_then(Value::as_array) else {
        return Err(wrong(
            "it is not a GeoJSON FeatureCollection: it has no list \"features\"".to_owned(),
        ));
    };
    if features.len() > MOST_SHIPS {
        let count = features.len();
        return Err(wrong(format!(
            "its {count} features exceed the limit of {MOST_SHIPS}; split the file"
        )));
    }
    let ship = |(n, feature): (usize, &Value)| {
        ship(feature).map_err(|why| wrong(format!("feature {}: {why}", n + 1)))
    };
    features.iter().enumerate().map(ship).collect()
}

fn ship(feature: &Value) -> Result<ShipAt, String> {
    let geometry = &feature["geometry"];
    if geometry["type"] != "Point" {
        return Err("its geometry is not a Point".to_owned());
    }
    let degrees = |n: usize, name: &str, most: f64| {
        let value = &geometry["coordinates"][n];
        let number = value.as_f64().filter(|v| (-most..=most).contains(v));
        number.ok_or_else(|| {
            let value = shown(value);
            format!("its {name} is {value}, expected a number from -{most} to {most}")
        })
    };
    let empty = Map::new();
    let properties = feature["properties"].as_object().unwrap_or(&empty);
    let number = |key: &str, default: Option<f64>, range: [f64; 2]| -> Result<f64, String> {
        let value = properties.get(key).unwrap_or(&Value::Null);
        let number = match (value, default) {
            (Value::Null, Some(default)) => Some(default),
            _ => value.as_f64(),
        };
        let [least, most] = range;
        let number = number.filter(|v| (least..=most).contains(v));
        number.ok_or_else(|| {
            let value = shown(value);
            format!("its property {key} is {value}, expected a number from {least} to {most}")
        })
    };
    let length = number("length", None, [1.0, 500.0])?;
    Ok(ShipAt {
        longitude: degrees(0, "longitude", 180.0)?,
        latitude: degrees(1, "latitude", 90.0)?,
        heading: number("heading", None, [-360.0, 360.0])?,
        speed: number("speed", None, [0.0, 40.0])?,
        length,
        beam: number("beam", Some(length / SLENDERNESS[0]), [0.1, 100.0])?,
        draft: number("draft", Some(length / SLENDERNESS[1]), [0.05, 40.0])?,
    })
}

/// A JSON value in a message.
fn shown(value: &Value) -> String {
    match value {
        Value::Null => "missing".to_owned(),
        value => whole_files::quoted(&value.to_string()),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<ShipAt>> {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        read_ships(file.path())
    }

    fn feature(coordinates: &str, properties: &str) -> String {
        format!(
            r#"{{"type": "FeatureCollection", "features": [{{"type": "Feature", "geometry": {{"type": "Point",
            "coordinates": {coordinates}}}, "properties": {properties}}}]}}"#
        )
    }

    #[test]
    fn a_ship_has_a_place_a_heading_and_a_length() {
        let ships = read(&feature(
            "[5.5, -40]",
            r#"{"heading": 45, "speed": 7.5, "length": 150, "name": "x"}"#,
        ));
        let [ship] = &ships.unwrap()[..] else {
            panic!()
        };
        assert_eq!(
            (ship.longitude, ship.latitude, ship.heading),
            (5.5, -40.0, 45.0)
        );
        assert_eq!((ship.speed, ship.length, ship.beam), (7.5, 150.0, 20.0));
        let refused = [
            (
                "[200, 3]",
                r#"{"heading": 45, "speed": 7, "length": 9}"#,
                "longitude",
            ),
            (
                "[2]",
                r#"{"heading": 45, "speed": 7, "length": 9}"#,
                "latitude",
            ),
            ("[2, 3]", r#"{"speed": 7, "length": 9}"#, "heading"),
            (
                "[2, 3]",
                r#"{"heading": 45, "speed": 99, "length": 9}"#,
                "speed",
            ),
            (
                "[2, 3]",
                r#"{"heading": 45, "speed": 7, "length": "long"}"#,
                "length",
            ),
        ];
        for (coordinates, properties, name) in refused {
            let sentence = read(&feature(coordinates, properties))
                .unwrap_err()
                .to_string();
            assert!(
                sentence.contains("feature 1") && sentence.contains(name),
                "{sentence}"
            );
        }
        for text in ["", "[1]", "{}", r#"{"features": [{}]}"#] {
            read(text).unwrap_err();
        }
    }
}
