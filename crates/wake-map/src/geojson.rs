//! Wakes as GeoJSON (RFC 7946).

use serde_json::{Map, Value, json};

use crate::wake::MappedWake;

/// Returns a feature collection with a `LineString` from tip to end of each wake and a `Point` for each echo; wakes without a
/// place on the map are omitted.
///
/// - `image`: name of the image, a property of every feature
#[must_use]
pub fn geojson(wakes: &[MappedWake], image: &str) -> Value {
    let mut features = Vec::new();
    for (n, wake) in wakes.iter().enumerate() {
        let (Some(tip), Some(end)) = (wake.tip, wake.end) else {
            continue;
        };
        let mut properties = properties(wake);
        properties.insert("id".to_owned(), json!(n + 1));
        properties.insert("image".to_owned(), json!(image));
        features.push(json!({
            "type": "Feature",
            "geometry": {"type": "LineString", "coordinates": [tip, end]},
            "properties": properties,
        }));
        if let Some(echo) = &wake.echo {
            features.push(json!({
                "type": "Feature",
                "geometry": {"type": "Point", "coordinates": [echo.longitude, echo.latitude]},
                "properties": {
                    "type": "echo", "id": n + 1, "image": image, "line": echo.line, "pixel": echo.pixel,
                    "displacement_m": echo.displacement, "radial_velocity_m_s": echo.radial_velocity,
                    "radial_velocity_deviation_m_s": echo.radial_velocity_deviation,
                },
            }));
        }
    }
    json!({"type": "FeatureCollection", "features": features})
}

/// Properties of a wake, with units in their names.
pub(crate) fn properties(wake: &MappedWake) -> Map<String, Value> {
    let echo = wake.echo.as_ref();
    let ship = wake.ship.as_ref();
    let properties = json!({
        "type": "wake", "probability": wake.probability, "sure": wake.sure, "score": wake.score,
        "direction_probability": wake.direction_probability, "heading_deg": wake.heading, "length_m": wake.length, "length_sd_m": wake.length_deviation,
        "contrast_db": wake.contrast_db, "kind": wake.kind, "half_angle_deg": wake.half_angle,
        "incidence_deg": wake.incidence, "time": wake.time, "line": wake.line, "pixel": wake.pixel,
        "displacement_m": echo.and_then(|echo| echo.displacement),
        "radial_velocity_m_s": echo.and_then(|echo| echo.radial_velocity),
        "radial_velocity_deviation_m_s": echo.and_then(|echo| echo.radial_velocity_deviation),
        "identifiable": ship.map(|ship| ship.identifiable),
        "speed_m_s": ship.map(|ship| ship.speed), "speed_sd_m_s": ship.map(|ship| ship.speed_deviation),
        "estimated_heading_deg": ship.map(|ship| ship.heading), "estimated_heading_sd_deg": ship.map(|ship| ship.heading_deviation),
        "wind_speed_m_s": ship.map(|ship| ship.wind_speed), "wind_speed_sd_m_s": ship.map(|ship| ship.wind_speed_deviation),
        "wind_toward_deg": ship.map(|ship| ship.wind_toward), "wind_toward_sd_deg": ship.map(|ship| ship.wind_toward_deviation),
        "misfit": ship.map(|ship| ship.misfit),
    });
    match properties {
        Value::Object(properties) => properties,
        _ => Map::new(),
    }
}
