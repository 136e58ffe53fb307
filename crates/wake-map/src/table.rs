//! Wakes as a CSV table.

use serde_json::Value;

use crate::geojson::properties;
use crate::wake::MappedWake;

/// The columns of the table.
const COLUMNS: [&str; 27] = [
    "probability",
    "sure",
    "score",
    "heading_deg",
    "direction_probability",
    "length_m",
    "length_sd_m",
    "contrast_db",
    "kind",
    "half_angle_deg",
    "incidence_deg",
    "time",
    "line",
    "pixel",
    "displacement_m",
    "radial_velocity_m_s",
    "radial_velocity_deviation_m_s",
    "identifiable",
    "speed_m_s",
    "speed_sd_m_s",
    "estimated_heading_deg",
    "estimated_heading_sd_deg",
    "wind_speed_m_s",
    "wind_speed_sd_m_s",
    "wind_toward_deg",
    "wind_toward_sd_deg",
    "misfit",
];

/// Returns comma-separated values with a header and one line per wake, in the given order; unknown values are empty.
#[must_use]
pub fn csv(wakes: &[MappedWake]) -> String {
    let places = ["longitude", "latitude", "end_longitude", "end_latitude"];
    let mut text = [&["id"][..], &places, &COLUMNS].concat().join(",") + "\n";
    for (n, wake) in wakes.iter().enumerate() {
        let ends = [wake.tip, wake.end].map(|place| place.map_or([None; 2], |p| p.map(Some)));
        let places = ends.concat();
        let places = places
            .iter()
            .map(|v| v.map_or(String::new(), |v| format!("{v:.6}")));
        let properties = properties(wake);
        let cell = |name: &&str| match &properties[*name] {
            Value::Null => String::new(),
            Value::String(text) => text.clone(),
            value => value.to_string(),
        };
        let cells = std::iter::once((n + 1).to_string());
        let cells: Vec<String> = cells
            .chain(places)
            .chain(COLUMNS.iter().map(cell))
            .collect();
        text.push_str(&(cells.join(",") + "\n"));
    }
    text
}
