//! Recipes of data sets: the paper's grid, or random values.

use super::draws::Draws;
use crate::error::{Error, Result};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::path::Path;
use wake_physics::Scene;
use wake_physics::grey::GreyScale;
use wake_physics::scene::{Grid, stored_key};
use whole_files::sentence;

/// Recipe of satellite products.
const SATELLITES: &str = include_str!("satellites.toml");
/// Changes of the detector's recipe to it.
const DETECTOR: &str = include_str!("detector.toml");
/// Prefixes of keys for the format of images, not their content.
const OF_A_SET: [&str; 3] = ["grid.rows", "grid.columns", "quick_look."];

/// Recipe of a data set: its scenes, and how they are turned into images and prompts.
///
/// In a TOML file, absent keys are taken from the recipe named by `base`, by default `ranges`, and unknown keys are
/// errors:
///
/// ```toml
/// base = "detector"         # paper, ranges, satellites, detector or model
/// speckle = true            # false: the image before speckle
/// paraphrase = false        # true: four wordings in turn, false: the paper's
/// [grey]                    # σ⁰ to grey, linear in decibel or in amplitude
/// mapping = "amplitude"
/// darkest_db = -60.0
/// brightest_db = -2.0
/// [scene.grid]              # [scene] is a scene file: what is not drawn
/// rows = 128
/// [draw]                    # see Draws
/// count = [0, 2]
/// "ship.speed" = [6.0, 12.0]
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recipe {
    /// Whether images have speckle.
    pub speckle: bool,
    /// Whether prompts use all wordings of [`wake_text::Wording`] at random, or only the paper's.
    pub paraphrase: bool,
    /// Mapping from σ⁰ to grey, unless the recipe draws quick-looks.
    #[serde(default)]
    pub grey: GreyScale,
    /// Choice of the scenes.
    pub draw: Draw,
    /// Values that are not drawn.
    pub scene: Scene,
}

/// Choice of the scenes.
#[derive(Debug, Clone, PartialEq)]
pub enum Draw {
    /// The 3,456 scenes of the paper's grid in a fixed mixed order, repeated with other seas: `"paper-grid"`.
    PaperGrid,
    /// Values drawn independently.
    Values(Draws),
}

impl Draw {
    const PAPER: &str = "paper-grid";

    /// Applies the `draw` value of a recipe.
    fn with(self, change: &toml::Value) -> Result<Self> {
        match (self, change) {
            (_, toml::Value::String(name)) if name == Self::PAPER => Ok(Self::PaperGrid),
            (Self::PaperGrid, toml::Value::Table(table)) => {
                Ok(Self::Values(Draws::default().with(table)?))
            }
            (Self::Values(draws), toml::Value::Table(table)) => {
                Ok(Self::Values(draws.with(table)?))
            }
            (_, other) => Err(Error::Value(wake_nn::Error::InvalidOption {
                option: "draw".to_owned(),
                value: sentence(&other.to_string()),
                expected: "\"paper-grid\", or a table of keys with what they are drawn from"
                    .to_owned(),
            })),
        }
    }
}

impl Serialize for Draw {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::PaperGrid => serializer.serialize_str(Self::PAPER),
            Self::Values(draws) => draws.serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for Draw {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let value = toml::Value::deserialize(deserializer)?;
        Self::PaperGrid.with(&value).map_err(D::Error::custom)
    }
}

impl Default for Recipe {
    /// The recipe `ranges`, for a small model: ranges of the paper's grid, all directions, one ship size, the ship anywhere, a
    /// fifth open sea; 256 × 256 pixels of 4 m, no speckle, tolerance 1e-2.
    fn default() -> Self {
        let mut scene = Scene {
            grid: Grid {
                rows: 256,
                columns: 256,
                spacing: 4.0,
                oversampling: None,
            },
            ..Scene::default()
        };
        scene.model.tolerance = 1e-2;
        Self {
            speckle: false,
            paraphrase: false,
            grey: GreyScale::default(),
            draw: Draw::Values(Draws::ranges()),
            scene,
        }
    }
}

impl Recipe {
    /// The recipe `paper`: the paper's grid at the defaults of a scene file, 512 × 512 pixels of 2.5 m, with speckle.
    pub fn paper() -> Self {
        Self {
            speckle: true,
            paraphrase: false,
            grey: GreyScale::default(),
            draw: Draw::PaperGrid,
            scene: Scene::default(),
        }
    }

    /// The recipe `satellites`: products of seven sensors, with ships of all sizes and wake look-alikes; see docs/dataset.md.
    ///
    /// # Errors
    ///
    /// None, unless a sensor or range was changed without the recipe.
    pub fn satellites() -> Result<Self> {
        let empty = Self {
            draw: Draw::Values(Draws::default()),
            scene: Scene::from_toml("")?,
            ..Self::default()
        };
        empty.merged(SATELLITES)
    }

    /// The recipe `detector`: [`satellites`](Self::satellites) with delivered images; see docs/dataset.md.
    ///
    /// # Errors
    ///
    /// As [`satellites`](Self::satellites).
    pub fn detector() -> Result<Self> {
        Self::satellites()?.merged(DETECTOR)
    }

    /// The recipe `model`, of the shipped wake model: scenes of `ranges` and of [`satellites`](Self::satellites), equally likely,
    /// with one mapping to grey and without speckle.
    ///
    /// # Errors
    ///
    /// As [`satellites`](Self::satellites).
    pub fn model() -> Result<Self> {
        let mut satellites = parsed(SATELLITES)?;
        let mut draw = table_of(&mut satellites, "draw");
        let cases = match draw.remove("together") {
            Some(toml::Value::Array(cases)) => cases,
            _ => Vec::new(),
        };
        let weight = |case: &toml::Table| case.get("weight").and_then(number).unwrap_or(1.0);
        let cases: Vec<toml::Table> = cases.into_iter().filter_map(table).collect();
        let total: f64 = cases.iter().map(weight).sum();
        // Values shared by all satellite scenes must apply to those scenes alone.
        let mut shared = toml::Table::new();
        flatten("", table_of(&mut satellites, "scene"), &mut shared);
        shared.extend(draw);
        shared.retain(|key, _| !OF_A_SET.iter().any(|prefix| key.starts_with(prefix)));
        let merged = cases.into_iter().map(|case| {
            let mut all = shared.clone();
            all.extend(case);
            toml::Value::Table(all)
        });
        let mut ranges = toml::Table::new();
        ranges.insert("weight".to_owned(), total.into());
        let mut together = vec![toml::Value::Table(ranges)];
        together.extend(merged);
        let mut draw = toml::Table::new();
        draw.insert("together".to_owned(), together.into());
        let mut changes = toml::Table::new();
        changes.insert("draw".to_owned(), draw.into());
        changes.insert("paraphrase".to_owned(), true.into());
        Self::default().changed(changes, "")
    }

    /// Returns a built-in recipe by name: paper, ranges, satellites, detector or model.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::InvalidOption`] for another name.
    pub fn named(name: &str) -> Result<Self> {
        let names = "paper, ranges, satellites, detector or model";
        Self::built_in(name).unwrap_or_else(|| Err(unknown(name, names)))
    }

    fn built_in(name: &str) -> Option<Result<Self>> {
        match name {
            "paper" => Some(Ok(Self::paper())),
            "ranges" => Some(Ok(Self::default())),
            "satellites" => Some(Self::satellites()),
            "detector" => Some(Self::detector()),
            "model" => Some(Self::model()),
            _ => None,
        }
    }

    /// Returns a built-in recipe by name, else reads a file; a file cannot shadow a built-in name.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::InvalidOption`] if there is no such file, else as [`Recipe::read`].
    pub fn named_or_read(name: &str) -> Result<Self> {
        match (Self::built_in(name), Path::new(name)) {
            (Some(recipe), _) => recipe,
            (None, file) if file.is_file() => Self::read(file),
            (None, _) => Err(unknown(
                name,
                "paper, ranges, satellites, detector, model or an existing TOML file",
            )),
        }
    }

    /// Reads a recipe from the text of a TOML file and checks it.
    ///
    /// # Errors
    ///
    /// [`Error::Recipe`] with the key or line at fault, [`wake_nn::Error::InvalidOption`] for a value that is not a distribution,
    /// [`Error::Scene`] for a value out of range.
    pub fn from_toml(text: &str) -> Result<Self> {
        let mut changes = parsed(text)?;
        let base = match changes.remove("base") {
            None => Self::default(),
            Some(toml::Value::String(name)) => Self::named(&name)?,
            Some(other) => Self::named(&other.to_string())?,
        };
        base.changed(changes, text)
    }

    /// Reads a recipe file and checks it.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::Io`] if the file cannot be read, else as [`Recipe::from_toml`].
    pub fn read(path: &Path) -> Result<Self> {
        Self::from_toml(&whole_files::read_text(path)?)
    }

    /// Applies assignments such as `scene.radar.looks=1` in order, checking the recipe after each.
    ///
    /// The value is TOML; a bare word is a string.
    ///
    /// # Errors
    ///
    /// As [`Recipe::from_toml`].
    pub fn with_assignments<S: AsRef<str>>(&self, assignments: &[S]) -> Result<Self> {
        let mut recipe = self.clone();
        for assignment in assignments {
            let text = assignment.as_ref();
            let quoted = text
                .split_once('=')
                .map(|(key, word)| format!("{key}={:?}", word.trim()));
            let quoted = quoted.filter(|quoted| {
                toml::from_str::<toml::Table>(text).is_err()
                    && toml::from_str::<toml::Table>(quoted).is_ok()
            });
            recipe = recipe.merged(quoted.as_deref().unwrap_or(text))?;
        }
        Ok(recipe)
    }

    fn merged(&self, text: &str) -> Result<Self> {
        self.changed(parsed(text)?, text)
    }

    /// Replaces values by a table's values; `text` is the source of the table, for messages.
    fn changed(&self, mut changes: toml::Table, text: &str) -> Result<Self> {
        let fail = |message: String| Error::Recipe {
            message: sentence(&message),
        };
        let draw = match changes.remove("draw") {
            Some(change) => self.draw.clone().with(&change)?,
            None => self.draw.clone(),
        };
        let mut table = toml::Table::try_from(self).map_err(|e| fail(e.to_string()))?;
        with_stored_keys(&mut changes);
        merge(&mut table, changes);
        let recipe: Self = table
            .try_into()
            .map_err(|e: toml::de::Error| fail(one_line(text, &e)))?;
        let recipe = Self { draw, ..recipe };
        recipe.validate()?;
        Ok(recipe)
    }

    /// Checks every value against its range.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::OutOfRange`] or [`Error::Scene`] with name, value and range.
    pub fn validate(&self) -> Result<()> {
        self.scene.validate()?;
        self.grey.validate()?;
        match &self.draw {
            Draw::PaperGrid => Ok(()),
            Draw::Values(draws) => draws.validate(&self.scene),
        }
    }
}

/// Removes an inner table from a table; empty if there is none.
fn table_of(from: &mut toml::Table, key: &str) -> toml::Table {
    from.remove(key).and_then(table).unwrap_or_default()
}

fn table(value: toml::Value) -> Option<toml::Table> {
    match value {
        toml::Value::Table(table) => Some(table),
        _ => None,
    }
}

fn number(value: &toml::Value) -> Option<f64> {
    value.as_float().or(value.as_integer().map(|n| n as f64))
}

/// Flattens nested tables to values by path.
fn flatten(name: &str, table: toml::Table, into: &mut toml::Table) {
    for (key, value) in table {
        let path = match name {
            "" => key,
            _ => format!("{name}.{key}"),
        };
        match value {
            toml::Value::Table(inner) => flatten(&path, inner, into),
            value => {
                into.insert(path, value);
            }
        }
    }
}

/// Parses TOML text to a table.
fn parsed(text: &str) -> Result<toml::Table> {
    toml::from_str(text).map_err(|e| Error::Recipe {
        message: sentence(&one_line(text, &e)),
    })
}

/// Error message in one line, with the line of the text at fault if it is known.
fn one_line(text: &str, error: &toml::de::Error) -> String {
    match error.span() {
        Some(span) => {
            let line = 1 + text
                .bytes()
                .take(span.start)
                .filter(|&b| b == b'\n')
                .count();
            format!("line {line}: {}", error.message())
        }
        None => error.to_string().trim().replace('\n', ", "),
    }
}

/// Renames the radar's keys as in a serialized scene.
fn with_stored_keys(changes: &mut toml::Table) {
    let scene = changes.get_mut("scene").and_then(toml::Value::as_table_mut);
    let radar = scene.and_then(|scene| scene.get_mut("radar"));
    let Some(radar) = radar.and_then(toml::Value::as_table_mut) else {
        return;
    };
    let stored = |(key, value): (String, toml::Value)| {
        let path = stored_key(&format!("radar.{key}"));
        let key = path.strip_prefix("radar.").map_or(key, str::to_owned);
        (key, value)
    };
    *radar = std::mem::take(radar).into_iter().map(stored).collect();
}

/// Replaces values of `table` by values of `changes`, recursively.
fn merge(table: &mut toml::Table, changes: toml::Table) {
    for (key, change) in changes {
        match (table.get_mut(&key), change) {
            (Some(toml::Value::Table(inner)), toml::Value::Table(change)) => merge(inner, change),
            (_, change) => {
                table.insert(key, change);
            }
        }
    }
}

/// The error for a name that is no recipe.
fn unknown(name: &str, expected: &str) -> Error {
    Error::Value(wake_nn::Error::InvalidOption {
        option: "recipe".to_owned(),
        value: sentence(name),
        expected: expected.to_owned(),
    })
}
