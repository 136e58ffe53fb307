//! Training log: one JSON object per line, with an estimate of the time left.

use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::{Value, json};

use super::trainer::StepReport;
use crate::error::{Error, Result};
use whole_files::failed;

/// The log of a run.
#[derive(Debug)]
pub struct TrainLog {
    file: File,
    path: PathBuf,
    begin: Instant,
    first: usize,
}

impl TrainLog {
    /// Opens a log to continue after `step` steps.
    ///
    /// Lines of later steps, which a killed run wrote after its last checkpoint, are dropped.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::Io`] when the file cannot be read or written, [`Error::Data`] with the number of an invalid line.
    pub fn open(path: &Path, step: usize) -> Result<Self> {
        let io = |source| failed("write", path, source);
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder).map_err(io)?;
        }
        let kept = kept_lines(path, step)?;
        whole_files::write_atomically(path, kept.as_bytes())?;
        Ok(Self {
            file: OpenOptions::new().append(true).open(path).map_err(io)?,
            path: path.to_owned(),
            begin: Instant::now(),
            first: step,
        })
    }

    /// Writes and returns the log line of step number `step`, counted from 1.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::Io`] when it cannot be written.
    pub fn write(
        &mut self,
        step: usize,
        of: usize,
        report: StepReport,
        more: &Value,
    ) -> Result<Value> {
        let seconds = self.begin.elapsed().as_secs_f64();
        let each = seconds / step.saturating_sub(self.first).max(1) as f64;
        let mut line = json!({
            "step": step, "loss": report.loss, "gradient_norm": report.norm, "rate": report.rate,
            "applied": report.applied, "seconds_per_step": each,
            "seconds_left": each * of.saturating_sub(step) as f64,
        });
        if let (Value::Object(line), Value::Object(more)) = (&mut line, more) {
            line.extend(more.clone());
        }
        writeln!(self.file, "{line}").map_err(|source| failed("write", &self.path, source))?;
        Ok(line)
    }
}

/// Returns the lines of the first `step` steps, without the incomplete last line that a killed run leaves.
fn kept_lines(path: &Path, step: usize) -> Result<String> {
    let bytes = match whole_files::read_regular(path) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(String::new()),
        Err(source) => return Err(failed("read", path, source).into()),
    };
    let whole = bytes
        .iter()
        .rposition(|&byte| byte == b'\n')
        .map_or(0, |n| n + 1);
    let mut kept = String::new();
    for (number, line) in bytes[..whole]
        .split_inclusive(|&byte| byte == b'\n')
        .enumerate()
    {
        let parsed: Option<Value> = serde_json::from_slice(line).ok();
        let made = parsed.and_then(|line| line["step"].as_u64());
        let (Some(made), Ok(text)) = (made, std::str::from_utf8(line)) else {
            return Err(Error::Data(wake_dataset::Error::Dataset {
                path: path.to_owned(),
                line: number + 1,
                message: "not a line of a training log; move the file away to resume".to_owned(),
            }));
        };
        if made <= step as u64 {
            kept.push_str(text);
        }
    }
    Ok(kept)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_resumed_log_has_no_line_twice() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log/metrics.jsonl");
        let report = StepReport {
            loss: 1.0,
            norm: 2.0,
            rate: 1e-3,
            applied: true,
        };
        let mut metrics = TrainLog::open(&path, 0).unwrap();
        for step in 1..=5 {
            metrics
                .write(step, 8, report, &json!({"grey": 0.5}))
                .unwrap();
        }
        // A killed run leaves half a line.
        metrics.file.write_all(b"{\"step\": 6, \"lo").unwrap();
        let mut metrics = TrainLog::open(&path, 3).unwrap();
        metrics.write(4, 8, report, &json!({})).unwrap();
        let text = fs::read_to_string(&path).unwrap();
        let steps: Vec<u64> = text
            .lines()
            .map(|line| {
                serde_json::from_str::<Value>(line).unwrap()["step"]
                    .as_u64()
                    .unwrap()
            })
            .collect();
        assert_eq!(steps, [1, 2, 3, 4]);
    }

    #[test]
    fn a_broken_line_is_named_and_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("words.jsonl");
        for bad in [&b"{\"step\": \xff}"[..], b"nonsense", b"[]"] {
            let text = [b"{\"step\": 1}\n", bad, b"\n{\"step\": 2}\n"].concat();
            fs::write(&path, &text).unwrap();
            let refused = TrainLog::open(&path, 5).unwrap_err().to_string();
            assert!(refused.contains("words.jsonl, line 2"), "{refused}");
            assert_eq!(fs::read(&path).unwrap(), text);
        }
    }
}
