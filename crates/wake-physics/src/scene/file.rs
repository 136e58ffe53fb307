//! Scene files: reading, writing, and assignments such as `ship.speed=10`.

use super::Scene;
use super::keys::{NOT_SET_BY_SENSOR, STORED, stored_key};
use crate::error::{Error, Result};
use std::io::Read;
use std::path::Path;
use whole_files::{quoted, sentence};

/// Largest size of a scene file \[bytes\].
const LONGEST: u64 = 1 << 20;

impl Scene {
    /// Reads a scene from the text of a scene file and checks it.
    ///
    /// # Errors
    ///
    /// [`Error::Parse`] with line and key, or what [`Scene::validate`] finds.
    pub fn from_toml(text: &str) -> Result<Self> {
        let scene: Self = toml::from_str(text).map_err(|e| Error::Parse {
            message: with_line(text, &e),
        })?;
        scene.validate()?;
        Ok(scene)
    }

    /// Reads a scene file and checks it.
    ///
    /// # Errors
    ///
    /// [`Error::File`] if the file cannot be read, is longer than 1 MiB or is not a scene, else what [`Scene::validate`] finds.
    pub fn read(path: &Path) -> Result<Self> {
        let text = text_of(path).map_err(|e| Error::File {
            action: "read",
            path: path.to_owned(),
            message: e.to_string(),
        })?;
        Self::from_toml(&text).map_err(|error| match error {
            Error::Parse { message } => Error::File {
                action: "read",
                path: path.to_owned(),
                message,
            },
            other => other,
        })
    }

    /// Returns the scene as the text of a scene file.
    ///
    /// # Errors
    ///
    /// [`Error::Parse`] if a value has no form in TOML.
    pub fn to_toml(&self) -> Result<String> {
        let text = toml::to_string(self).map_err(|e| Error::Parse {
            message: e.to_string(),
        })?;
        Ok(with_keys_of_files(&text))
    }

    /// Applies assignments such as `ship.speed=10` in order, then checks the scene.
    ///
    /// Values are TOML; a bare word is a string. `ship.speed` works with a single ship; with several, the first is
    /// `ship.1.speed`. Setting a key of a ship in a scene without ships, or of the number after the last ship, first adds a
    /// default ship.
    ///
    /// # Errors
    ///
    /// [`Error::Assignment`] for a text without `=`, an unknown key or a wrong type, else as
    /// [`Scene::validate`].
    pub fn with_assignments<S: AsRef<str>>(&self, assignments: &[S]) -> Result<Self> {
        let mut scene = self.clone();
        for text in assignments {
            scene = scene.assigned(text.as_ref())?;
        }
        scene.validate()?;
        Ok(scene)
    }

    fn assigned(&self, assignment: &str) -> Result<Self> {
        let fail = |message: String| Error::Assignment {
            assignment: quoted(assignment),
            message: sentence(&message),
        };
        let (key, value) = assignment
            .split_once('=')
            .ok_or_else(|| fail("there is no '='".to_owned()))?;
        let value = toml_value(value.trim()).ok_or_else(|| fail("there is no value".to_owned()))?;
        let mut root = toml::Table::try_from(self).map_err(|e| fail(e.to_string()))?;
        let key = stored_key(key.trim());
        let path: Vec<&str> = key.split('.').collect();
        let (last, tables) = path.split_last().unwrap_or((&"", &[]));
        if path == ["radar", "sensor"] {
            forget_radar(&mut root);
        }
        let (mut table, tables) = match tables {
            ["ship", keys @ ..] => table_of_ship(&mut root, keys).map_err(&fail)?,
            tables => (&mut root, tables),
        };
        for name in tables {
            let entry = table
                .entry((*name).to_owned())
                .or_insert_with(|| toml::Table::new().into());
            table = entry
                .as_table_mut()
                .ok_or_else(|| fail(format!("{name} is not a table")))?;
        }
        table.insert((*last).to_owned(), value);
        root.try_into()
            .map_err(|e: toml::de::Error| fail(e.message().trim().to_owned()))
    }
}

/// Returns the table of the ship that the keys after `ship` name, and the remaining keys. Numbers count from 1; without a
/// number, the keys are of the only ship.
fn table_of_ship<'t, 'k>(
    root: &'t mut toml::Table,
    keys: &'k [&'k str],
) -> std::result::Result<(&'t mut toml::Table, &'k [&'k str]), String> {
    let entry = root
        .entry("ship".to_owned())
        .or_insert_with(|| toml::Value::Array(Vec::new()));
    if entry.is_table() {
        *entry = toml::Value::Array(vec![entry.clone()]);
    }
    let ships = entry.as_array_mut().ok_or("ship is not a table")?;
    let count = ships.len();
    let number = keys.first().and_then(|key| key.parse::<usize>().ok());
    let (at, rest) = match number {
        Some(number @ 1..) if number <= count + 1 => (number - 1, &keys[1..]),
        Some(_) => {
            return Err(format!(
                "the scene has {count} ships: the first is ship.1, and ship.{} adds another",
                count + 1
            ));
        }
        None if count <= 1 => (0, keys),
        None => {
            return Err(format!(
                "the scene has {count} ships: name one, the first is ship.1"
            ));
        }
    };
    if at == count {
        ships.push(toml::Table::new().into());
    }
    let table = ships[at].as_table_mut().ok_or("the ship is not a table")?;
    Ok((table, rest))
}

/// Replaces the keys of a serialized scene by the keys of a scene file.
fn with_keys_of_files(text: &str) -> String {
    let (mut out, mut radar) = (String::with_capacity(text.len() + 64), false);
    for line in text.lines() {
        if line.starts_with('[') {
            radar = line == "[radar]";
        }
        let value = |stored| line.strip_prefix(stored)?.strip_prefix(" = ");
        let renamed = STORED
            .iter()
            .find_map(|(key, stored)| Some(format!("{key} = {}", value(*stored)?)));
        out.push_str(renamed.as_deref().filter(|_| radar).unwrap_or(line));
        out.push('\n');
    }
    out
}

/// Removes the keys that a sensor sets.
fn forget_radar(root: &mut toml::Table) {
    let mut forget = |table: &str, forgotten: fn(&str) -> bool| {
        if let Some(table) = root.get_mut(table).and_then(toml::Value::as_table_mut) {
            table.retain(|key, _| !forgotten(key));
        }
    };
    forget("radar", |key| key != NOT_SET_BY_SENSOR);
    forget("grid", |key| key == "spacing");
}

/// Reads the text of a file of at most [`LONGEST`] bytes.
fn text_of(path: &Path) -> std::io::Result<String> {
    let mut text = String::new();
    let file = std::fs::File::open(path)?;
    file.take(LONGEST + 1).read_to_string(&mut text)?;
    if text.len() as u64 > LONGEST {
        return Err(std::io::Error::other(
            "the file is longer than 1 MiB, the limit for a scene",
        ));
    }
    Ok(text)
}

/// Message of a TOML error on one line, with the number and text of the line that it is about.
fn with_line(text: &str, error: &toml::de::Error) -> String {
    let message = sentence(&error.message().trim().replace('\n', ", "));
    let Some(span) = error.span() else {
        return message;
    };
    let before = text.get(..span.start).unwrap_or(text);
    let number = before.matches('\n').count();
    let line = text.lines().nth(number).unwrap_or_default().trim();
    format!("line {}, '{}': {message}", number + 1, quoted(line))
}

/// Parses a TOML value. Text that is not TOML is a string; empty text is `None`.
fn toml_value(text: &str) -> Option<toml::Value> {
    if text.is_empty() {
        return None;
    }
    let mut table: toml::Table = toml::from_str(&format!("value = {text}"))
        .unwrap_or_else(|_| toml::Table::from_iter([("value".to_owned(), text.into())]));
    table.remove("value")
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "values that must be the same bits")]
mod tests {
    use super::*;
    use crate::scene::{Grid, Model, Radar, Sea, Term, TermRule, Terms};

    #[test]
    fn an_empty_file_is_an_open_sea_with_defaults() {
        let scene = Scene::from_toml("").unwrap();
        assert_eq!(scene.ships, []);
        assert_eq!(scene.seed, 7);
        assert_eq!(scene.grid, Grid::default());
        assert_eq!(scene.sea, Sea::default());
        assert_eq!(scene.radar, Radar::default());
        assert_eq!(scene.model, Model::default());
        let ship = Scene::from_toml("[ship]").unwrap();
        assert_eq!(ship, Scene::default());
    }

    #[test]
    fn text_and_back() {
        for scene in crate::scene::paper::paper_grid().step_by(97) {
            assert_eq!(Scene::from_toml(&scene.to_toml().unwrap()).unwrap(), scene);
        }
        let mut scene = Scene::default();
        scene.sea.depth = 12.5;
        scene.model.terms = Terms::List(vec![Term::Sea, Term::TiltAverage]);
        assert_eq!(Scene::from_toml(&scene.to_toml().unwrap()).unwrap(), scene);
        scene.sea.depth = f64::INFINITY;
        let json = serde_json::to_string(&scene).unwrap();
        assert_eq!(serde_json::from_str::<Scene>(&json).unwrap(), scene);
    }

    #[test]
    fn unknown_keys_and_wrong_types_are_errors_that_say_where() {
        for (text, word) in [
            ("sead = 1", "sead"),
            ("[sea]\nwind = 3", "wind"),
            ("[ship]\nspeed = \"fast\"", "speed"),
            ("[radar]\npolarization = \"VH\"", "polarization"),
            ("[model]\nterms = [\"waves\"]", "terms"),
            ("[sea\nwind_speed = 3", "line 1"),
            ("[grid]\nrows = -4", "rows"),
        ] {
            let message = Scene::from_toml(text).unwrap_err().to_string();
            assert!(message.contains(word), "{text}: {message}");
        }
    }

    #[test]
    fn depth_can_be_infinite() {
        for text in ["depth = inf", "depth = \"infinite\""] {
            let scene = Scene::from_toml(&format!("[sea]\n{text}")).unwrap();
            assert_eq!(scene.sea.depth, f64::INFINITY);
        }
        assert!(Scene::from_toml("[sea]\ndepth = 5").unwrap().sea.depth == 5.0);
        assert!(Scene::from_toml("[sea]\ndepth = \"deep\"").is_err());
    }

    #[test]
    fn assignments_take_toml_values_and_bare_words() {
        let scene = Scene::default()
            .with_assignments(&[
                "ship.speed=8",
                "ship.position=[10.0, -20]",
                "sea.spectrum = jonswap",
                "radar.polarization=\"HH\"",
                "model.terms=all",
                "seed=11",
            ])
            .unwrap();
        let ship = &scene.ships[0];
        assert_eq!((ship.speed, ship.position), (8.0, [10.0, -20.0]));
        assert_eq!(scene.model.terms, Terms::Rule(TermRule::All));
        assert_eq!(scene.seed, 11);
        let open = Scene::from_toml("").unwrap();
        assert!(
            open.with_assignments(&["ship.speed=8"])
                .unwrap()
                .ships
                .len()
                == 1
        );
    }

    #[test]
    fn several_ships_are_a_list_and_are_counted_from_one() {
        let two = Scene::default()
            .with_assignments(&["ship.2.speed=8", "ship.1.speed=6", "ship.1.length=80"])
            .unwrap();
        let speeds: Vec<f64> = two.ships.iter().map(|ship| ship.speed).collect();
        assert_eq!(speeds, [6.0, 8.0]);
        assert_eq!((two.ships[0].length, two.ships[1].length), (80.0, 195.0));
        let text = two.to_toml().unwrap();
        assert_eq!(text.matches("[[ship]]").count(), 2, "{text}");
        assert_eq!(Scene::from_toml(&text).unwrap(), two);
        let json = serde_json::to_string(&two).unwrap();
        assert_eq!(serde_json::from_str::<Scene>(&json).unwrap(), two);
        // A single ship is written as a table, even if it was read from a list.
        let one = Scene::from_toml("[[ship]]\nspeed = 8").unwrap();
        assert!(one.to_toml().unwrap().contains("[ship]\n"));
        assert_eq!(one, Scene::from_toml("[ship]\nspeed = 8").unwrap());
        let none = Scene::from_toml("ship = []").unwrap();
        assert_eq!(none, Scene::from_toml("").unwrap());
    }

    #[test]
    fn errors_name_the_ship() {
        let two = Scene::default()
            .with_assignments(&["ship.2.speed=8"])
            .unwrap();
        for (assignment, words) in [
            ("ship.speed=3", "2 ships: name one, the first is ship.1"),
            ("ship.4.speed=3", "ship.3 adds another"),
            ("ship.0.speed=3", "the first is ship.1"),
            ("ship.2.speed=50", "ship.2.speed is 50"),
            ("ship.2.beam=300", "ship.2.beam is 300"),
            ("ship.1.sped=3", "sped"),
            ("ship.1=3", "ship.1=3"),
        ] {
            let message = two.with_assignments(&[assignment]).unwrap_err().to_string();
            assert!(message.contains(words), "{assignment}: {message}");
        }
        let text = "[[ship]]\n[[ship]]\nspeed = \"fast\"";
        let message = Scene::from_toml(text).unwrap_err().to_string();
        assert!(
            message.contains("line 3") && message.contains("speed"),
            "{message}"
        );
        let message = Scene::from_toml("ship = 3").unwrap_err().to_string();
        assert!(
            message.contains("a ship as a table, or a list of them"),
            "{message}"
        );
        let many = "[[ship]]\n".repeat(101);
        let message = Scene::from_toml(&many).unwrap_err().to_string();
        assert!(message.contains("number of ships is 101"), "{message}");
        assert!(Scene::from_toml(&"[[ship]]\n".repeat(100)).is_ok());
    }

    #[test]
    fn assignments_that_mean_nothing_say_so() {
        for text in [
            "ship.speed",
            "ship.speed=",
            "=3",
            "ship.sped=3",
            "seed.x=1",
            "a.b.c=1",
            "seed=x",
        ] {
            let message = Scene::default()
                .with_assignments(&[text])
                .unwrap_err()
                .to_string();
            assert!(message.contains(text), "{text}: {message}");
        }
    }

    #[test]
    fn every_seed_can_be_written_read_and_set() {
        for seed in [0, (1 << 63) - 1, 1 << 63, u64::MAX] {
            let scene = Scene {
                seed,
                ..Scene::default()
            };
            assert_eq!(Scene::from_toml(&scene.to_toml().unwrap()).unwrap(), scene);
            let json = serde_json::to_string(&scene).unwrap();
            assert_eq!(serde_json::from_str::<Scene>(&json).unwrap(), scene);
            let set = Scene::default()
                .with_assignments(&[format!("seed={seed}")])
                .unwrap();
            assert_eq!(set.seed, seed);
            // Setting another key keeps the seed.
            assert_eq!(set.with_assignments(&["ship.speed=8"]).unwrap().seed, seed);
        }
        for seed in ["18446744073709551616", "-1", "1.5"] {
            let refused = Scene::default().with_assignments(&[format!("seed={seed}")]);
            assert!(
                refused
                    .unwrap_err()
                    .to_string()
                    .contains("18446744073709551615"),
                "{seed}"
            );
        }
    }

    #[test]
    fn a_place_is_two_numbers() {
        for (numbers, count) in [("[1.0, 2.0, 3.0]", "3"), ("[1]", "1"), ("[]", "0")] {
            let assignment = format!("ship.position={numbers}");
            for refused in [
                Scene::default().with_assignments(&[assignment]),
                Scene::from_toml(&format!("[ship]\nposition = {numbers}")),
            ] {
                let message = refused.unwrap_err().to_string();
                assert!(
                    message.contains(&format!("{count} numbers, expected 2")),
                    "{message}"
                );
            }
        }
    }

    /// Whatever a file or an assignment holds, its error is short, on one line and without control characters.
    #[test]
    fn errors_are_short_and_harmless() {
        let long = "\u{1b}[31m\u{7}x".repeat(20_000);
        let word = "x".repeat(100_000);
        for text in [
            long.clone(),
            format!("[sea]\nspectrum = \"{word}\""),
            format!("{word} = 1"),
            format!("a = \"{long}"),
        ] {
            for refused in [
                Scene::from_toml(&text),
                Scene::default().with_assignments(&[&text]),
                Scene::default().with_assignments(&[format!("sea.spectrum={text}")]),
            ] {
                let message = refused.unwrap_err().to_string();
                assert!(
                    message.chars().count() < 900,
                    "{} characters",
                    message.chars().count()
                );
                assert!(!message.chars().any(char::is_control), "{message:?}");
            }
        }
    }

    /// Endless devices and files that are too long are read only up to the limit.
    #[test]
    fn files_are_read_to_a_limit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.toml");
        std::fs::write(&path, "# ".repeat(1 << 19) + "#").unwrap();
        let mut paths = vec![path];
        if Path::new("/dev/zero").exists() {
            paths.push("/dev/zero".into());
        }
        for path in paths {
            let message = Scene::read(&path).unwrap_err().to_string();
            assert!(message.contains("longer than 1 MiB"), "{message}");
        }
    }

    #[test]
    fn a_missing_file_is_named() {
        let message = Scene::read(Path::new("no/such.toml"))
            .unwrap_err()
            .to_string();
        assert!(
            message.contains("no/such.toml") && message.contains("read"),
            "{message}"
        );
    }
}
