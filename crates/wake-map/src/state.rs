//! Progress of a search: a file with one line per searched tile.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use serde::{Deserialize, Serialize};
use serde_json::Value;
use wake_detector::{Detection, Extent, Wake};

use crate::error::{Error, Result};

/// A wake in the file.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Line {
    score: f32,
    forward: Option<f32>,
    tip: [f32; 2],
    axis_deg: f32,
    half_angle_deg: f32,
    length: f32,
    /// Measured length and its standard deviation.
    #[serde(default)]
    extent: Option<[f32; 2]>,
}

/// The wakes of a tile.
#[derive(Debug, Serialize, Deserialize)]
struct Tile {
    tile: usize,
    found: Vec<Line>,
}

/// Searched tiles, in memory and in a file.
#[derive(Debug)]
pub(crate) struct State {
    path: PathBuf,
    file: Mutex<File>,
    pub(crate) done: BTreeMap<usize, Vec<Detection>>,
}

impl State {
    /// Opens or creates the file of a search; an incomplete last line, left by a killed run, is dropped.
    ///
    /// - `identity`: inputs of the search, the first line of the file
    pub(crate) fn open(path: &Path, identity: &Value) -> Result<Self> {
        let text = match path.exists() {
            true => String::from_utf8_lossy(&whole_files::read_bytes(path)?).into_owned(),
            false => String::new(),
        };
        let mut lines = text
            .split_inclusive('\n')
            .filter(|line| line.ends_with('\n'));
        let mut done: BTreeMap<usize, Vec<Detection>> = BTreeMap::new();
        if let Some(first) = lines.next() {
            let found: Value = serde_json::from_str(first).unwrap_or(Value::Null);
            if found != *identity {
                return Err(Error::OtherSearch {
                    path: path.to_owned(),
                    what: differs(&found, identity),
                });
            }
            for line in lines {
                // Tiles of damaged lines are searched again.
                if let Ok(tile) = serde_json::from_str::<Tile>(line) {
                    done.insert(tile.tile, tile.found.iter().map(Line::detection).collect());
                }
            }
        }
        let mut kept = format!("{identity}\n");
        for (tile, found) in &done {
            kept.push_str(&line(*tile, found));
        }
        whole_files::write_atomically(path, kept.as_bytes())?;
        let file = OpenOptions::new().append(true).open(path);
        Ok(Self {
            file: Mutex::new(file.map_err(|source| io(path, source))?),
            path: path.to_owned(),
            done,
        })
    }

    /// Records the wakes of a tile.
    pub(crate) fn note(&self, tile: usize, found: &[Detection]) -> Result<()> {
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        let written = file.write_all(line(tile, found).as_bytes());
        written.map_err(|source| io(&self.path, source))
    }
}

fn io(path: &Path, source: std::io::Error) -> Error {
    Error::File(whole_files::Error {
        action: "write",
        path: path.to_owned(),
        source,
    })
}

fn line(tile: usize, found: &[Detection]) -> String {
    let found = found.iter().map(Line::of).collect();
    let line = serde_json::to_string(&Tile { tile, found });
    line.unwrap_or_default() + "\n"
}

/// Description of the first key in which two identities differ.
fn differs(there: &Value, here: &Value) -> String {
    let keys = here.as_object().into_iter().flatten();
    let mut keys = keys.filter(|(key, value)| there.get(key.as_str()) != Some(*value));
    match keys.next() {
        Some((key, value)) => {
            let there = there.get(key.as_str()).unwrap_or(&Value::Null);
            format!("its {key} is {there}, not {value}")
        }
        None => "it has more settings".to_owned(),
    }
}

impl Line {
    fn of(one: &Detection) -> Self {
        Self {
            score: one.score,
            forward: one.forward,
            tip: one.wake.tip,
            axis_deg: one.wake.axis_deg,
            half_angle_deg: one.wake.half_angle_deg,
            length: one.wake.length,
            extent: one.extent.map(|extent| [extent.length, extent.deviation]),
        }
    }

    fn detection(&self) -> Detection {
        let wake = Wake {
            tip: self.tip,
            axis_deg: self.axis_deg,
            half_angle_deg: self.half_angle_deg,
            length: self.length,
            snr: f32::INFINITY,
            contrast_db: None,
        };
        Detection {
            extent: self
                .extent
                .map(|[length, deviation]| Extent { length, deviation }),
            forward: self.forward,
            ..Detection::new(self.score, wake)
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn what_was_searched_is_not_searched_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("search.jsonl");
        let identity = json!({"product": "a", "least_score": 0.1});
        let wake = Line {
            score: 0.123_456_7,
            forward: Some(0.9),
            tip: [100.25, 3e4],
            axis_deg: 12.5,
            half_angle_deg: 0.1,
            length: 88.0,
            extent: Some([91.0, 7.5]),
        };
        let state = State::open(&path, &identity).unwrap();
        state.note(7, &[wake.detection()]).unwrap();
        state.note(2, &[]).unwrap();
        drop(state);
        // An incomplete line, as left by a killed run.
        let mut text = std::fs::read(&path).unwrap();
        text.extend(b"{\"tile\": 9, \"fou");
        std::fs::write(&path, text).unwrap();
        let state = State::open(&path, &identity).unwrap();
        assert_eq!(state.done.keys().copied().collect::<Vec<_>>(), [2, 7]);
        let again = state.done[&7][0];
        assert_eq!(again.score.to_bits(), wake.score.to_bits());
        assert_eq!(again.wake, wake.detection().wake);
        assert_eq!(again.extent, wake.detection().extent);
        let other = json!({"product": "a", "least_score": 0.2});
        let refused = State::open(&path, &other).unwrap_err().to_string();
        assert!(refused.contains("least_score is 0.1, not 0.2"), "{refused}");
    }
}
