//! File names and report.

use serde_json::Value;

use super::arguments::Arguments;
use crate::exit::{self, Outcome};

/// Name of file `k` of `count` of one kind.
pub(super) fn numbered(stem: &str, k: usize, count: usize, ending: &str) -> String {
    match count {
        1 => format!("{stem}.{ending}"),
        _ => format!("{stem}-{k}.{ending}"),
    }
}

/// Writes the report and prints a summary.
pub(super) fn finish(arguments: &Arguments, report: &Value) -> Outcome<()> {
    let out = &arguments.out;
    whole_files::write_json(&out.join("report.json"), report)?;
    if arguments.json {
        return Ok(exit::say(&format!("{report:#}"))?);
    }
    let files = report["files"].as_array().into_iter().flatten();
    let files: Vec<&str> = files.filter_map(Value::as_str).collect();
    let seconds = report["seconds"]["total"].as_f64().unwrap_or_default();
    let (files, out) = (files.join(", "), out.display());
    Ok(exit::say(&format!("{files} in {out}, {seconds:.2} s"))?)
}
