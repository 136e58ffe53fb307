//! Results, one line per image.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use serde::{Deserialize, Serialize};
use wake_train::evaluation::EstimatedImage;

use crate::exit::Outcome;

/// Line of `estimates.jsonl`.
#[derive(Serialize, Deserialize)]
pub(super) struct Line {
    pub(super) set: String,
    pub(super) estimate: EstimatedImage,
}

/// Reads the lines of an earlier run; lines that are not valid are left out, such as a truncated last one.
pub(super) fn read(path: &Path) -> Outcome<Vec<Line>> {
    if !path.is_file() {
        return Ok(Vec::new());
    }
    let lines = BufReader::new(File::open(path)?).lines();
    let lines = lines.collect::<Result<Vec<String>, _>>()?;
    Ok(lines
        .iter()
        .filter_map(|line| serde_json::from_str(line).ok())
        .collect())
}
