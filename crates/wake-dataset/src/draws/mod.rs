//! Random values of scenes, drawn independently and keyed by their path in a scene file.

mod table;

use super::delivery::Delivery;
use super::distribution::{Distribution, Value, choose, refused};
use crate::error::{Error, Result};
use crate::streams;
use serde::de::Error as _;
use serde::ser::SerializeMap;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::collections::BTreeMap;
use table::{place, replace_radar, set, tenths, toml, with_length};
use wake_nn::noise::NoiseSource;
use wake_physics::Scene;
use wake_physics::scene::{Ship, stored_key};
use whole_files::sentence;

/// Distributions by the path of their value, such as `ship.speed`.
type Values = BTreeMap<String, Distribution>;

/// Distributions of the random values of a recipe.
///
/// ```toml
/// count = [0, 5]                                     # ships, each drawn on its own
/// "ship.length" = { log = [30, 350] }                # beam and draft keep their proportion
/// "ship.position" = "anywhere"                       # midship in the image
/// "radar.looks" = [1, 8]
/// "sea.swell_height" = { one_of = [0, [0.5, 3]], weights = [2, 1] }
/// together = [                                       # values that belong together, a table in so many
///     { weight = 2, "radar.sensor" = "sentinel-1-iw", "grid.spacing" = 10 },
///     { "radar.sensor" = "ers-2-pri", "grid.spacing" = 12.5 },
/// ]
/// ```
///
/// The values of a key depend on seed, index and key alone, not on other keys. Two names of one key, such as `radar.nesz` and
/// `radar.noise_floor`, are equivalent.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Draws {
    values: Values,
    together: Vec<(f64, Values)>,
}

/// Number of ships.
const COUNT: &str = "count";
/// Grey level of the median amplitude minus grey level of zero amplitude, and grey level of zero amplitude; see [`Draws::quick_look`].
const GAIN: &str = "quick_look.gain";
const OFFSET: &str = "quick_look.offset";
/// Image pixels per resolution cell, as the geometric mean of both axes; 0 keeps the spacing.
const PIXELS: &str = "delivery.pixels";
/// Options of the delivery; see [`Delivery`]. Quality 0: no compression.
const RESIZE: &str = "delivery.resize";
const QUALITY: &str = "delivery.quality";
/// Keys that are not scene keys.
const OWN: [&str; 6] = [COUNT, GAIN, OFFSET, PIXELS, RESIZE, QUALITY];
const SENSOR: &str = "radar.sensor";
const POSITION: &str = "ship.position";
/// Value of the position for a uniform draw within the image.
const ANYWHERE: &str = "anywhere";
/// Keys of a ship that need its echo or its wake's edges; a ship drawn without these loses the keys.
const NEEDS: [(&str, &[&str]); 2] = [
    ("echo", &["roll", "roll_period", "scatterers", "halo"]),
    ("edge", &["edge_time", "edge_outflow"]),
];
/// Keys that cannot be drawn, and why.
const REFUSED: [(&str, &str); 3] = [
    ("seed", "no draw: every scene gets its own seed"),
    (
        "grid.rows",
        "no draw: all images of a set have the same size; set scene.grid.rows",
    ),
    (
        "grid.columns",
        "no draw: all images of a set have the same size; set scene.grid.columns",
    ),
];

impl Draws {
    /// Ranges of the paper's grid, all directions, one ship size, the ship anywhere, a fifth open sea.
    pub(super) fn ranges() -> Self {
        let even = |path: &str, low, high| (path.to_owned(), Distribution::Even([low, high]));
        let number = |n| Distribution::Fixed(Value::Number(n));
        let count = Distribution::OneOf {
            one_of: vec![number(0.0), number(1.0)],
            weights: Some(vec![1.0, 4.0]),
        };
        let fetch = Distribution::Logarithmic { log: [10e3, 70e3] };
        let anywhere = Distribution::Fixed(Value::Word(ANYWHERE.to_owned()));
        let values = [
            (COUNT.to_owned(), count),
            (POSITION.to_owned(), anywhere),
            even("ship.speed", 6.0, 12.0),
            even("ship.heading", 0.0, 360.0),
            even("sea.wind_speed", 3.0, 7.0),
            even("sea.wind_toward", 0.0, 360.0),
            ("sea.fetch".to_owned(), fetch),
            even("radar.incidence", 16.0, 32.0),
        ];
        Self {
            values: values.into(),
            together: Vec::new(),
        }
    }

    /// Replaces draws by the draws of a recipe's table.
    pub(super) fn with(mut self, table: &toml::Table) -> Result<Self> {
        for (key, value) in table {
            if key == "together" {
                self.together = together(value)?;
            } else {
                read(&mut self.values, key, value)?;
            }
        }
        Ok(self)
    }

    /// Distributions for scene number `index`: the common ones, and one table of `together`.
    fn chosen(&self, random: NoiseSource, index: u64) -> BTreeMap<&str, &Distribution> {
        let weight = |i: usize| self.together[i].0;
        let place = random.uniform(stream("together"), index);
        let (case, _) = choose(self.together.len(), weight, place);
        self.case(case)
    }

    fn case(&self, case: usize) -> BTreeMap<&str, &Distribution> {
        let values = self.together.get(case).map(|(_, values)| values);
        let all = self.values.iter().chain(values.into_iter().flatten());
        all.map(|(path, distribution)| (path.as_str(), distribution))
            .collect()
    }

    /// Draws scene number `index`: `base` with drawn values, not yet rounded.
    ///
    /// # Errors
    ///
    /// [`Error::Recipe`] for values that cannot be combined in a scene.
    pub(super) fn scene(&self, base: &Scene, random: NoiseSource, index: u64) -> Result<Scene> {
        let chosen = self.chosen(random, index);
        scene(base, &chosen, |path| random.uniform(stream(path), index))
    }

    /// Gain and offset of image number `index` as a quick-look; `None` if the recipe draws none.
    pub(super) fn quick_look(&self, random: NoiseSource, index: u64) -> Option<[f64; 2]> {
        let chosen = self.chosen(random, index);
        let number = |path: &str| number(&chosen, path, random, index);
        Some([number(GAIN)?, number(OFFSET).unwrap_or(0.0)])
    }

    /// Delivery of image number `index`; `None` if it is neither resized nor compressed.
    pub(super) fn delivery(&self, random: NoiseSource, index: u64) -> Option<Delivery> {
        let chosen = self.chosen(random, index);
        let number = |path: &str| number(&chosen, path, random, index);
        let quality = number(QUALITY).filter(|quality| *quality >= 1.0);
        let resize = number(RESIZE).unwrap_or(1.0);
        let phase = |of: &str| (8.0 * random.uniform(stream(of), index)) as usize % 8;
        (quality.is_some() || (resize - 1.0).abs() > 1e-9).then(|| Delivery {
            resize,
            quality: quality.map(|quality| quality as u8),
            phase: ["delivery.row", "delivery.column"].map(phase),
        })
    }

    /// Checks each range alone against the ranges of scenes, on `base`, and all ranges together at both ends.
    pub(super) fn validate(&self, base: &Scene) -> Result<()> {
        for case in 0..self.together.len().max(1) {
            let chosen = self.case(case);
            // Values of all scenes are checked once, with the first table of `together`.
            let own = |path: &str| case == 0 || self.together[case].1.contains_key(path);
            for (&path, distribution) in chosen.iter().filter(|(path, _)| own(path)) {
                self.own(path, distribution)?;
                // Pixels per resolution cell need a resolution, which another key may draw.
                if path == PIXELS {
                    continue;
                }
                for value in distribution.extremes() {
                    let fixed = Distribution::Fixed(value);
                    let mut alone = BTreeMap::from([(path, &fixed)]);
                    if let Some(sensor) = chosen.get(SENSOR).filter(|_| path != SENSOR) {
                        alone.insert(SENSOR, sensor);
                    }
                    let one = Distribution::Fixed(Value::Number(1.0));
                    if path.starts_with("ship.") {
                        alone.insert(COUNT, &one);
                    }
                    scene(base, &alone, |_| 0.0)?.validate()?;
                }
            }
            for end in [0.0, 1.0] {
                scene(base, &chosen, |_| end)?.validate()?;
            }
        }
        Ok(())
    }

    /// Checks values of keys that are not scene keys.
    fn own(&self, path: &str, distribution: &Distribution) -> Result<()> {
        let [low, high] = match path {
            GAIN => [1e-3, 1.0],
            OFFSET => [-1.0, 1.0],
            PIXELS => [0.0, 16.0],
            RESIZE => [0.25, 4.0],
            QUALITY => [0.0, 100.0],
            COUNT => [0.0, 100.0],
            _ => return Ok(()),
        };
        for value in distribution.extremes() {
            match value {
                Value::Number(n)
                    if (low..=high).contains(&n) && (!is_whole(path) || n.fract() == 0.0) => {}
                value => {
                    let kind = if is_whole(path) {
                        "whole numbers"
                    } else {
                        "numbers"
                    };
                    return Err(Error::Value(wake_nn::Error::InvalidOption {
                        option: format!("draw.{path}"),
                        value: value.to_string(),
                        expected: format!("{kind} from {low} to {high}"),
                    }));
                }
            }
        }
        Ok(())
    }
}

/// Reads a key, or the keys of a nested table.
fn read(values: &mut Values, key: &str, value: &toml::Value) -> Result<()> {
    match value {
        toml::Value::Table(table) if !Distribution::is(table) && !table.is_empty() => {
            for (inner, value) in table {
                read(values, &format!("{key}.{inner}"), value)?;
            }
        }
        _ => {
            if let Some((_, expected)) = REFUSED.iter().find(|(path, _)| *path == key) {
                return Err(refused(key, value, expected));
            }
            values.insert(stored_key(key), Distribution::parse(key, value)?);
        }
    }
    Ok(())
}

/// Reads the tables of `together`.
fn together(value: &toml::Value) -> Result<Vec<(f64, Values)>> {
    let expected =
        "a list of tables of keys and distributions, each with an optional weight above 0";
    let fail = || refused("together", value, expected);
    let table = |value: &toml::Value| {
        let mut table = value.as_table().ok_or_else(fail)?.clone();
        let weight = table.remove("weight").unwrap_or(1.into());
        let weight = weight.as_float().or(weight.as_integer().map(|w| w as f64));
        let weight = weight
            .filter(|w| w.is_finite() && *w > 0.0)
            .ok_or_else(fail)?;
        let mut values = Values::new();
        for (key, value) in &table {
            read(&mut values, key, value)?;
        }
        Ok((weight, values))
    };
    value
        .as_array()
        .ok_or_else(fail)?
        .iter()
        .map(table)
        .collect()
}

/// Random stream of a key: FNV-1a hash of its text (Fowler, Noll & Vo), in the upper half of all streams.
fn stream(path: &str) -> u32 {
    let step = |hash: u32, byte: u8| (hash ^ u32::from(byte)).wrapping_mul(16_777_619);
    streams::VALUES | path.bytes().fold(2_166_136_261, step)
}

/// `base` with values drawn at quantiles 0…1 of their distributions, given by `at`.
fn scene(
    base: &Scene,
    drawn: &BTreeMap<&str, &Distribution>,
    at: impl Fn(&str) -> f64,
) -> Result<Scene> {
    let told = |e: &dyn std::fmt::Display| Error::Recipe {
        message: sentence(&e.to_string()),
    };
    let mut table = toml::Table::try_from(base).map_err(|e| told(&e))?;
    let ships = table.remove("ship");
    if drawn.contains_key(SENSOR) {
        replace_radar(&mut table);
    }
    for (path, distribution) in drawn {
        if !OWN.contains(path) && !path.starts_with("ship.") {
            let value = distribution.at(at(path), is_whole(path));
            set(&mut table, path, toml(&value, is_whole(path))).map_err(|e| told(&e))?;
        }
    }
    let parsed = |table: &toml::Table| -> Result<Scene> {
        let scene = table.clone().try_into();
        scene.map_err(|e: toml::de::Error| told(&e.to_string().trim().replace('\n', ", ")))
    };
    let mut sea = parsed(&table)?;
    if let Some(Value::Number(pixels)) = drawn.get(PIXELS).map(|p| p.at(at(PIXELS), false))
        && pixels > 0.0
    {
        let spacing = spacing_of(&sea, pixels)?;
        set(&mut table, "grid.spacing", spacing.into()).map_err(|e| told(&e))?;
        sea = parsed(&table)?;
    }
    let (first, of_base) = match ships {
        Some(toml::Value::Array(several)) => (several.first().cloned(), several.len()),
        one => (one.clone(), usize::from(one.is_some())),
    };
    let count = match drawn.get(COUNT).map(|count| count.at(at(COUNT), true)) {
        Some(Value::Number(count)) => count as usize,
        _ => of_base,
    };
    if count == 0 {
        return Ok(sea);
    }
    let default = || toml::Table::try_from(Ship::default()).map(toml::Value::Table);
    let own = first.map_or_else(default, Ok).map_err(|e| told(&e))?;
    let mut ships = Vec::with_capacity(count);
    for number in 1..=count {
        let place = |key: &str| at(&format!("ship.{number}.{key}"));
        let ship = ship(&own, drawn, &sea, place).map_err(|e| told(&e))?;
        ships.push(ship);
    }
    let ships = match ships.len() {
        1 => ships.swap_remove(0),
        _ => toml::Value::Array(ships),
    };
    table.insert("ship".to_owned(), ships);
    table
        .try_into()
        .map_err(|e: toml::de::Error| told(&e.to_string().trim().replace('\n', ", ")))
}

/// A ship with its drawn values.
fn ship(
    own: &toml::Value,
    drawn: &BTreeMap<&str, &Distribution>,
    sea: &Scene,
    at: impl Fn(&str) -> f64,
) -> Result<toml::Value, String> {
    let mut ship = own.as_table().cloned().unwrap_or_default();
    for (path, distribution) in drawn {
        let Some(key) = path.strip_prefix("ship.") else {
            continue;
        };
        let value = distribution.at(at(key), is_whole(path));
        match (*path, &value) {
            (POSITION, Value::Word(word)) if word == ANYWHERE => {
                let grid = &sea.grid;
                let x = place(grid.columns, grid.spacing, at("x"));
                let y = -place(grid.rows, grid.spacing, at("y"));
                ship.insert("position".to_owned(), vec![x, y].into());
            }
            ("ship.length", Value::Number(length)) => with_length(&mut ship, tenths(*length)),
            _ => set(&mut ship, key, toml(&value, is_whole(path)))?,
        }
    }
    for (of, keys) in NEEDS {
        if ship.get(of).and_then(toml::Value::as_bool) != Some(true) {
            ship.retain(|key, _| !keys.contains(&AsRef::<str>::as_ref(key)));
        }
    }
    Ok(ship.into())
}

/// Pixel spacing \[m\] for a number of pixels per resolution cell, in steps of 1 cm.
fn spacing_of(scene: &Scene, pixels: f64) -> Result<f64> {
    let radar = &scene.radar;
    let range = radar.range_resolution.ok_or_else(|| Error::Recipe {
        message: format!(
            "draw.{PIXELS} needs a resolution; set radar.range_resolution or radar.sensor"
        ),
    })?;
    let cell = (range * radar.azimuth_resolution).sqrt();
    Ok((100.0 * cell / pixels).round().max(10.0) / 100.0)
}

/// Number drawn for a key in image number `index`; `None` if the key is not drawn or not a number.
fn number(
    chosen: &BTreeMap<&str, &Distribution>,
    path: &str,
    random: NoiseSource,
    index: u64,
) -> Option<f64> {
    let place = random.uniform(stream(path), index);
    match chosen.get(path)?.at(place, is_whole(path)) {
        Value::Number(number) => Some(number),
        _ => None,
    }
}

/// Whether the value of a key is a whole number.
fn is_whole(path: &str) -> bool {
    [
        "radar.looks",
        "grid.oversampling",
        "ship.scatterers",
        COUNT,
        QUALITY,
    ]
    .contains(&path)
}

impl Serialize for Draws {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct Case<'a> {
            weight: f64,
            #[serde(flatten)]
            values: &'a Values,
        }
        let mut map = serializer.serialize_map(None)?;
        for (path, distribution) in &self.values {
            map.serialize_entry(path, distribution)?;
        }
        if !self.together.is_empty() {
            let cases = self.together.iter();
            let cases: Vec<Case<'_>> = cases
                .map(|(weight, values)| Case {
                    weight: *weight,
                    values,
                })
                .collect();
            map.serialize_entry("together", &cases)?;
        }
        map.end()
    }
}

impl<'de> Deserialize<'de> for Draws {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let table = toml::Table::deserialize(deserializer)?;
        Self::default().with(&table).map_err(D::Error::custom)
    }
}
