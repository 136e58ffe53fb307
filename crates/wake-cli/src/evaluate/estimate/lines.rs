//! Results of each image, a line each.

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

/// Lines of an earlier run; a last one that was cut short is left out.
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
