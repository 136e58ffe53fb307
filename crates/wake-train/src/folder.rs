//! The folder of a run: one model, one data set, one process.

use std::path::{Path, PathBuf};

use serde::Serialize;
use serde_json::{Map, Value, json};
use whole_files::FolderLock;

use super::checkpoint::{Checkpoint, difference};
use crate::error::{Error, Result};

/// Folder shared by the stages of one run, locked for this process.
///
/// ```text
/// config.json      the model
/// run.json         the data, and of each stage: the steps its results were made after, and those it shall make
/// checkpoints/     a folder for each stage
/// ```
#[derive(Debug)]
pub(crate) struct RunFolder {
    path: PathBuf,
    record: Map<String, Value>,
    _lock: FolderLock,
}

/// Subfolder of the checkpoints of all stages.
const CHECKPOINTS: &str = "checkpoints";

/// Recorded steps of a stage: those its results were made after, and those requested.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Noted {
    step: usize,
    of: usize,
}

impl RunFolder {
    /// Opens or makes the folder of a run; a refused folder is left unchanged.
    ///
    /// - `model`: configuration of the model
    /// - `data`: identity of the training data, such as the manifest of a data set; `Null` for a stage that needs none
    /// - `stage`: stage to begin, or to resume
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::InvalidOption`] with the first value in which the folder's model or data differ, or as
    /// [`begin`](Self::begin); [`wake_nn::Error::Io`] if another process works there.
    pub(crate) fn open(
        path: &Path,
        model: &impl Serialize,
        data: &Value,
        (stage, resume): (&str, bool),
    ) -> Result<Self> {
        let encode = |source| {
            Error::Value(wake_nn::Error::Json {
                path: path.to_owned(),
                source,
            })
        };
        let model = serde_json::to_value(model).map_err(encode)?;
        compare(path, &model, data)?;
        check_begin(path, &path.join(CHECKPOINTS).join(stage), stage, resume)?;
        let lock = whole_files::lock_folder(path)?;
        let mut record = read(&path.join("run.json"))?.unwrap_or_default();
        if !data.is_null() {
            record.insert("data".to_owned(), data.clone());
        }
        let folder = Self {
            path: path.to_owned(),
            record,
            _lock: lock,
        };
        whole_files::write_json(&path.join("config.json"), &model)?;
        folder.write()?;
        Ok(folder)
    }

    /// Path of the folder.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Folder of the checkpoints of a stage.
    pub(crate) fn checkpoints(&self, stage: &str) -> PathBuf {
        self.path.join(CHECKPOINTS).join(stage)
    }

    /// Returns the checkpoint to resume a stage from, or `None` for a stage that begins.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::InvalidOption`] when there is no checkpoint to resume, or one that a new beginning would lose.
    pub(crate) fn begin(&self, stage: &str, resume: bool) -> Result<Option<Checkpoint>> {
        check_begin(&self.path, &self.checkpoints(stage), stage, resume)?;
        Checkpoint::newest(&self.checkpoints(stage))
    }

    /// Whether the results of a stage exist and were made after `step` steps.
    ///
    /// - `results`: names of the stage's files
    pub(crate) fn is_current(&self, stage: &str, step: usize, results: &[&str]) -> bool {
        let there = results.iter().all(|name| self.path.join(name).is_file());
        there && self.noted(stage).is_some_and(|noted| noted.step == step)
    }

    /// Number of steps that an unfinished stage was begun for; `None` if it is finished, `Some(0)` if it never began.
    ///
    /// A stage whose results are missing or older than its last checkpoint is unfinished.
    ///
    /// # Errors
    ///
    /// As [`Checkpoint::newest`].
    pub(crate) fn unfinished(&self, stage: &str, results: &[&str]) -> Result<Option<usize>> {
        let there = results.iter().all(|name| self.path.join(name).is_file());
        let newest = Checkpoint::newest_step(&self.checkpoints(stage))?;
        Ok(match (newest, self.noted(stage)) {
            // Results were copied there, or their checkpoints were removed.
            (None, _) => (!there).then_some(0),
            (Some(step), Some(noted)) if there && noted.step == step && step >= noted.of => None,
            (Some(step), noted) => Some(noted.map_or(0, |noted| noted.of).max(step)),
        })
    }

    /// Records the steps of a stage: those its results were made after, and those requested.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::Io`] if it cannot be written.
    pub(crate) fn note(&mut self, stage: &str, step: usize, of: usize) -> Result<()> {
        let stages = self.record.entry("stages").or_insert_with(|| json!({}));
        stages[stage] = json!({"results_after": step, "steps": of});
        self.write()
    }

    fn noted(&self, stage: &str) -> Option<Noted> {
        let stage = self.record.get("stages")?.get(stage)?;
        let number = |key: &str| stage[key].as_u64().map(|n| n as usize);
        Some(Noted {
            step: number("results_after")?,
            of: number("steps")?,
        })
    }

    fn write(&self) -> Result<()> {
        Ok(whole_files::write_json(
            &self.path.join("run.json"),
            &self.record,
        )?)
    }
}

/// Checks that a folder is free or belongs to this model and data.
fn compare(path: &Path, model: &Value, data: &Value) -> Result<()> {
    let refuse = |file: &str, (key, there, here): (String, String, String)| {
        Error::Value(wake_nn::Error::InvalidOption {
            option: path.join(file).display().to_string(),
            value: format!("from a run with {key} = {there}"),
            expected: format!("{here}; use the options of that run, or choose another folder"),
        })
    };
    if let Some(there) = read(&path.join("config.json"))?
        && let Some(found) = difference("", &Value::Object(there), model)
    {
        return Err(refuse("config.json", found));
    }
    let record = read(&path.join("run.json"))?.unwrap_or_default();
    match record.get("data") {
        Some(there) if !data.is_null() => match difference("data", there, data) {
            Some(found) => Err(refuse("run.json", found)),
            None => Ok(()),
        },
        _ => Ok(()),
    }
}

/// Refuses to resume a stage that never began, and to begin one that has checkpoints.
///
/// - `path`: the folder of the run
/// - `checkpoints`: folder of the stage's checkpoints
pub(super) fn check_begin(
    path: &Path,
    checkpoints: &Path,
    stage: &str,
    resume: bool,
) -> Result<()> {
    match (Checkpoint::newest_step(checkpoints)?, resume) {
        (Some(_), true) | (None, false) => Ok(()),
        (None, true) => Err(Error::Value(wake_nn::Error::InvalidOption {
            option: "resume".to_owned(),
            value: format!(
                "on, but there is no checkpoint in {}",
                checkpoints.display()
            ),
            expected: "off for a new run".to_owned(),
        })),
        (Some(step), false) => Err(Error::Value(wake_nn::Error::InvalidOption {
            option: path.display().to_string(),
            value: format!("a run whose stage {stage} has made {step} steps"),
            expected: "an empty folder; choose another folder for a new run, or resume this one"
                .to_owned(),
        })),
    }
}

/// Reads a JSON object; `None` if there is no such file.
fn read(path: &Path) -> Result<Option<Map<String, Value>>> {
    if !path.exists() {
        return Ok(None);
    }
    let text = whole_files::read_text(path)?;
    let object = serde_json::from_str(&text).map_err(|source| {
        Error::Value(wake_nn::Error::Json {
            path: path.to_owned(),
            source,
        })
    })?;
    Ok(Some(object))
}

#[cfg(test)]
mod tests {
    use super::*;
    use wake_ldm::conditioning::Vocabulary;
    use wake_ldm::network::WakeModelConfig;

    fn config() -> WakeModelConfig {
        WakeModelConfig::standard(&Vocabulary::new([1, 2]))
    }

    fn checkpoint(folder: &RunFolder, stage: &str, step: usize) {
        let checkpoint = Checkpoint {
            step,
            applied: step,
            state: json!({}),
            tensors: crate::checkpoint::Tensors::new(),
        };
        checkpoint.write(&folder.checkpoints(stage), 2).unwrap();
    }

    #[test]
    fn a_folder_belongs_to_one_model_and_one_set() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run");
        let data = json!({"seed": 7, "count": 10});
        drop(RunFolder::open(&path, &config(), &Value::Null, ("prior", false)).unwrap());
        drop(RunFolder::open(&path, &config(), &data, ("prior", false)).unwrap());
        drop(RunFolder::open(&path, &config(), &Value::Null, ("prior", false)).unwrap());
        let before = std::fs::read(path.join("run.json")).unwrap();
        let other = json!({"seed": 8, "count": 10});
        let refused = RunFolder::open(&path, &config(), &other, ("prior", false))
            .unwrap_err()
            .to_string();
        assert!(
            refused.contains("data.seed = 7") && refused.contains("expected 8"),
            "{refused}"
        );
        let wide = WakeModelConfig {
            prior_width: 64,
            ..config()
        };
        let refused = RunFolder::open(&path, &wide, &data, ("prior", false))
            .unwrap_err()
            .to_string();
        assert!(refused.contains("prior_width = 128"), "{refused}");
        assert_eq!(std::fs::read(path.join("run.json")).unwrap(), before);
        let first = RunFolder::open(&path, &config(), &data, ("prior", false)).unwrap();
        let second = RunFolder::open(&path, &config(), &data, ("prior", false))
            .unwrap_err()
            .to_string();
        assert!(second.contains("another process"), "{second}");
        drop(first);
    }

    #[test]
    fn a_stage_begins_once_and_is_resumed_from_its_last_checkpoint() {
        let folder = tempfile::tempdir().unwrap();
        let run =
            RunFolder::open(folder.path(), &config(), &Value::Null, ("prior", false)).unwrap();
        assert!(
            run.begin("prior", true)
                .unwrap_err()
                .to_string()
                .contains("no checkpoint")
        );
        assert_eq!(run.begin("prior", false).unwrap(), None);
        for step in [100, 20] {
            checkpoint(&run, "prior", step);
        }
        let refused = run.begin("prior", false).unwrap_err().to_string();
        assert!(
            refused.contains("100 steps") && refused.contains("resume this one"),
            "{refused}"
        );
        assert_eq!(run.begin("prior", true).unwrap().unwrap().step, 100);
        assert_eq!(run.begin("parser", false).unwrap(), None);
    }

    #[test]
    fn results_are_current_only_after_their_last_checkpoint() {
        let folder = tempfile::tempdir().unwrap();
        let mut run =
            RunFolder::open(folder.path(), &config(), &Value::Null, ("prior", false)).unwrap();
        let results = ["prior.safetensors"];
        let file = folder.path().join(results[0]);
        assert_eq!(run.unfinished("prior", &results).unwrap(), Some(0));
        std::fs::write(&file, "put there").unwrap();
        assert_eq!(run.unfinished("prior", &results).unwrap(), None);
        checkpoint(&run, "prior", 4);
        assert_eq!(run.unfinished("prior", &results).unwrap(), Some(4));
        run.note("prior", 4, 6).unwrap();
        assert!(run.is_current("prior", 4, &results));
        assert_eq!(run.unfinished("prior", &results).unwrap(), Some(6));
        checkpoint(&run, "prior", 6);
        assert!(!run.is_current("prior", 6, &results));
        assert_eq!(run.unfinished("prior", &results).unwrap(), Some(6));
        run.note("prior", 6, 6).unwrap();
        assert_eq!(run.unfinished("prior", &results).unwrap(), None);
        std::fs::remove_file(file).unwrap();
        assert_eq!(run.unfinished("prior", &results).unwrap(), Some(6));
        assert!(!run.is_current("prior", 6, &results));
    }
}
