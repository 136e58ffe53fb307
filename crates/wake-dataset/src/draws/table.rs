//! Editing of scene values in TOML tables.

use crate::distribution::Value;
use wake_physics::scene::Ship;

/// Removes the keys that a sensor sets: all keys of the radar except `relaxation_rate`, and the spacing.
pub(super) fn replace_radar(table: &mut toml::Table) {
    let mut of = |name: &str, keep: &dyn Fn(&str) -> bool| {
        if let Some(table) = table.get_mut(name).and_then(toml::Value::as_table_mut) {
            table.retain(|key, _| keep(key));
        }
    };
    of("radar", &|key| key == "relaxation_rate");
    of("grid", &|key| key != "spacing");
}

pub(super) fn toml(value: &Value, whole: bool) -> toml::Value {
    match value {
        Value::Flag(flag) => (*flag).into(),
        Value::Word(word) => word.as_str().into(),
        Value::Number(number) if whole => (*number as i64).into(),
        Value::Number(number) => (*number).into(),
    }
}

/// Sets the value at a path of tables.
pub(super) fn set(table: &mut toml::Table, path: &str, value: toml::Value) -> Result<(), String> {
    let (tables, last) = path.rsplit_once('.').unwrap_or(("", path));
    let mut table = table;
    for name in tables.split('.').filter(|name| !name.is_empty()) {
        let entry = table
            .entry(name.to_owned())
            .or_insert_with(|| toml::Table::new().into());
        table = entry
            .as_table_mut()
            .ok_or_else(|| format!("draw.{path}: {name} is not a table"))?;
    }
    table.insert(last.to_owned(), value);
    Ok(())
}

pub(super) fn tenths(value: f64) -> f64 {
    (10.0 * value).round() / 10.0
}

/// Coordinate \[m\] between the centres of the first and the last pixel, in steps of 0.1 m.
pub(super) fn place(pixels: usize, spacing: f64, at: f64) -> f64 {
    let first = -((pixels / 2) as f64);
    let pixel = first + at * pixels.saturating_sub(1) as f64;
    tenths(spacing * pixel)
}

/// Changes the length; beam and draft are scaled in proportion, in steps of 0.1 mm, so that every reader of JSON gets the
/// same numbers.
pub(super) fn with_length(ship: &mut toml::Table, length: f64) {
    let number = |ship: &toml::Table, key: &str, default: f64| {
        ship.get(key)
            .and_then(toml::Value::as_float)
            .unwrap_or(default)
    };
    let default = Ship::default();
    let before = number(ship, "length", default.length);
    for (key, size) in [("beam", default.beam), ("draft", default.draft)] {
        let scaled = (1e4 * number(ship, key, size) * length / before).round() / 1e4;
        ship.insert(key.to_owned(), scaled.into());
    }
    ship.insert("length".to_owned(), length.into());
}
