//! The page of scene keys, from the code: keys and meanings from the types and their docstrings, ranges and units from
//! what the check of a scene refuses, defaults from the default scene.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use serde_json::Value;
use syn::visit::{self, Visit};
use syn::{Attribute, Expr, ExprLit, Item, Lit, Meta};
use wake_physics::scene::sensor::SensorMode;
use wake_physics::scene::{Scene, Sensor, stored_key};
use wake_physics::window::Window;
use wake_physics::{Error, Result};

/// The page, for the types of the scene in a folder of sources; and what their docstrings say wrongly.
pub(crate) fn page(sources: &Path) -> (String, Vec<String>) {
    let types = structs(sources);
    let default = serde_json::to_value(Scene::default()).expect("a scene as JSON");
    let mut rows = Vec::new();
    walk(&types, "Scene", "", &mut rows);
    let (mut text, mut wrong) = (HEAD.to_owned(), Vec::new());
    for row in &rows {
        let allowed = allowed(&row.key);
        if let Some(said) = row.range()
            && let Allowed::Range { min, max, .. } = &allowed
            && said.map(f64::to_bits) != [*min, *max].map(f64::to_bits)
        {
            wrong.push(format!(
                "{}: the docstring says {said:?}, the check {min} to {max}",
                row.key
            ));
        }
        let pointer = format!("/{}", stored_key(&row.key).replace('.', "/"));
        let default = match default.pointer(&pointer) {
            Some(Value::String(word)) if word == "infinite" => "inf".to_owned(),
            Some(Value::String(word)) => word.clone(),
            Some(Value::Number(n)) => n.as_f64().map_or_else(|| n.to_string(), number),
            Some(Value::Array(list)) => {
                let numbers = list.iter().filter_map(Value::as_f64).map(number);
                format!("[{}]", numbers.collect::<Vec<_>>().join(", "))
            }
            Some(value) => value.to_string(),
            None => "none".to_owned(),
        };
        let (unit, range) = allowed.cells();
        let (key, meaning) = (&row.key, row.meaning());
        let _ = writeln!(
            text,
            "| `{key}` | {unit} | {range} | {default} | {meaning} |"
        );
    }
    text.push_str(SENSORS);
    for sensor in Sensor::ALL {
        text.push_str(&sensor_row(sensor));
    }
    (text, wrong)
}

const HEAD: &str = "\
# Keys of a scene file

Drawn from the code by `DRAW=1 cargo test -p wake --no-default-features --features checks --test tidy`; do not edit. A scene file is TOML;
`--set KEY=VALUE` assigns one key; unknown keys are errors and ranges are closed. \"none\" is a key that may be absent.
[How scene files work](scene.md).

| key | unit | range | default | meaning |
| --- | --- | --- | --- | --- |
";

const SENSORS: &str = "
## Sensors

What `radar.sensor` sets where the scene has no key of its own; distances in metres, resolutions in range and azimuth of
one look, at the incidence given. Where each number comes from is said in `wake_physics::scene::sensor`.

| sensor | GHz | polarization | incidence, imaged range (°) | R/V (s) | pixel | resolution | looks, overlap | windows | noise (dB) |
| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |
";

fn sensor_row(sensor: Sensor) -> String {
    let name = serde_json::to_string(&sensor).expect("a name");
    let mode: SensorMode = sensor.mode();
    let [near, far] = mode.incidence_range;
    let window = |w: Window| match w {
        Window::Uniform => "uniform".to_owned(),
        Window::Hamming(a) => format!("Hamming {a}"),
        Window::Kaiser(b) => format!("Kaiser {b}"),
    };
    format!(
        "| `{}` | {} | {:?} | {}, {near} to {far} | {:.0} | {} | {:.1} × {} | {}, {} | {}, {} | {} |\n",
        name.trim_matches('"'),
        mode.frequency / 1e9,
        mode.polarization,
        mode.incidence,
        mode.range_to_velocity_at(mode.incidence),
        mode.spacing,
        mode.range_resolution_at(mode.incidence),
        mode.azimuth_resolution,
        mode.looks.0,
        mode.looks.1,
        window(mode.windows[0]),
        window(mode.windows[1]),
        mode.nesz,
    )
}

/// A field of a type of the scene.
struct Field {
    name: String,
    docs: String,
    /// Every name in its type.
    types: Vec<String>,
}

/// A key with its docstring.
struct Row {
    key: String,
    docs: String,
}

impl Row {
    /// The range in the docstring: the first "a to b" of two numbers.
    fn range(&self) -> Option<[f64; 2]> {
        let words: Vec<&str> = self.docs.split(' ').collect();
        words.windows(3).find_map(range_of)
    }

    /// The docstring without what has a column of its own: the unit in brackets and the range.
    fn meaning(&self) -> String {
        let mut words: Vec<String> = self.docs.split(' ').map(str::to_owned).collect();
        let parts: Vec<&str> = self.docs.split(' ').collect();
        if let Some(at) = parts.windows(3).position(|w| range_of(w).is_some()) {
            words.drain(at..at + 3);
            if let Some(before) = at.checked_sub(1) {
                let stop = parts[at + 2].chars().last().filter(|c| ".;,:".contains(*c));
                let bare = words[before].trim_end_matches(',');
                words[before] = bare.chars().chain(stop).collect();
            }
        }
        without_unit(&words)
    }
}

/// Words without a unit in brackets, and without the brackets of links.
fn without_unit(words: &[String]) -> String {
    let mut text = words.join(" ").replace("\\[", "[").replace("\\]", "]");
    while let Some(start) = text
        .find(" [")
        .filter(|&at| !text[at + 2..].starts_with('`'))
    {
        let end = start + text[start..].find(']').expect("a closing bracket");
        text.replace_range(start..=end, "");
    }
    let text = text
        .replace("[`", "`")
        .replace("`]", "`")
        .replace("Self::", "");
    text.replace("crate::", "wake_physics::")
        .replace('|', "\\|")
}

fn range_of(words: &[&str]) -> Option<[f64; 2]> {
    let value = |word: &str| -> Option<f64> {
        let word = word.trim_end_matches([',', '.', ';', ':']).replace(',', "");
        match word.as_str() {
            "infinite" => Some(f64::INFINITY),
            word => word.replace('−', "-").parse().ok(),
        }
    };
    (words[1] == "to").then_some(())?;
    Some([value(words[0])?, value(words[2])?])
}

/// Puts down the keys below a type in the order of its fields; a field of a type of the scene is a table.
fn walk(types: &BTreeMap<String, Vec<Field>>, name: &str, prefix: &str, rows: &mut Vec<Row>) {
    for field in &types[name] {
        let key = format!("{prefix}{}", field.name);
        match field.types.iter().find(|name| types.contains_key(*name)) {
            Some(table) => walk(types, table, &format!("{key}."), rows),
            None => rows.push(Row {
                key,
                docs: field.docs.clone(),
            }),
        }
    }
}

/// The public structures in the files of a folder.
fn structs(folder: &Path) -> BTreeMap<String, Vec<Field>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).expect("the sources of the scene") {
        let text = fs::read_to_string(entry.expect("an entry").path()).expect("a source");
        for item in syn::parse_file(&text).expect("Rust").items {
            let Item::Struct(item) = item else { continue };
            if matches!(item.vis, syn::Visibility::Public(_)) {
                let fields = item.fields.iter().map(|field| Field {
                    name: renamed(&field.attrs)
                        .or_else(|| field.ident.as_ref().map(ToString::to_string))
                        .expect("a field with a name"),
                    docs: docs(&field.attrs),
                    types: names(&field.ty),
                });
                found.insert(item.ident.to_string(), fields.collect());
            }
        }
    }
    found
}

/// Every name in a type.
fn names(ty: &syn::Type) -> Vec<String> {
    struct Names(Vec<String>);
    impl Visit<'_> for Names {
        fn visit_path_segment(&mut self, segment: &syn::PathSegment) {
            self.0.push(segment.ident.to_string());
            visit::visit_path_segment(self, segment);
        }
    }
    let mut names = Names(Vec::new());
    names.visit_type(ty);
    names.0
}

fn docs(attributes: &[Attribute]) -> String {
    let lines = attributes
        .iter()
        .filter_map(|attribute| match &attribute.meta {
            Meta::NameValue(meta) if meta.path.is_ident("doc") => match &meta.value {
                Expr::Lit(ExprLit {
                    lit: Lit::Str(line),
                    ..
                }) => Some(line.value().trim().to_owned()),
                _ => None,
            },
            _ => None,
        });
    lines.collect::<Vec<_>>().join(" ")
}

/// The name that `#[serde(rename = …)]` gives.
fn renamed(attributes: &[Attribute]) -> Option<String> {
    let mut name = None;
    for attribute in attributes.iter().filter(|a| a.path().is_ident("serde")) {
        let _ = attribute.parse_nested_meta(|meta| {
            let value: Option<syn::LitStr> = meta.value().ok().and_then(|v| v.parse().ok());
            if meta.path.is_ident("rename") {
                name = value.map(|v| v.value());
            }
            Ok(())
        });
    }
    name
}

/// What a key may be.
enum Allowed {
    Range { min: f64, max: f64, unit: String },
    Any { unit: String },
    Words(String),
}

impl Allowed {
    fn cells(&self) -> (String, String) {
        let unit = |unit: &str| {
            if unit.is_empty() {
                "1".to_owned()
            } else {
                unit.to_owned()
            }
        };
        match self {
            Self::Range { min, max, unit: u } => {
                (unit(u), format!("{} to {}", number(*min), number(*max)))
            }
            Self::Any { unit: u } => (unit(u), "any".to_owned()),
            Self::Words(words) => (String::new(), words.replace('|', "\\|")),
        }
    }
}

/// A number as short as it can be written.
fn number(value: f64) -> String {
    let size = value.abs();
    let plain = size == 0.0 || size.is_infinite() || (1e-3..1e5).contains(&size);
    if plain {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}

/// What a key may be, as the check of a scene says when it refuses wrong values.
fn allowed(key: &str) -> Allowed {
    for value in ["1e300", "-1e300", "1000000000", "inf", "[inf, 0.0]"] {
        match assigned(key, value) {
            Err(Error::OutOfRange { min, max, unit, .. }) => {
                let unit = unit.to_owned();
                return Allowed::Range { min, max, unit };
            }
            Err(Error::NotFinite { unit, .. }) => {
                let unit = unit.to_owned();
                return Allowed::Any { unit };
            }
            _ => {}
        }
    }
    if assigned(key, "true").is_ok() {
        return Allowed::Words("true, false".to_owned());
    }
    let message = assigned(key, "\"?\"").expect_err("no word").to_string();
    let end = message.find("; write KEY").unwrap_or(message.len());
    let begins = ["expected one of ", "expected ", "is not a ", "': "];
    let begin = begins.iter().find_map(|b| Some(message.find(b)? + b.len()));
    Allowed::Words(message[begin.unwrap_or(0)..end].to_owned())
}

/// A scene in which every key may be set, with one key set.
fn assigned(key: &str, value: &str) -> Result<Scene> {
    Scene::default().with_assignments(&[
        "ship.hull=full",
        "radar.range_resolution=10",
        "ship.echo=true",
        "ship.edge=true",
        "radar.azimuth_ambiguity=-25",
        "radar.prf=1000",
        &format!("{key}={value}"),
    ])
}
