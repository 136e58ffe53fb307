//! Checkpoints: everything needed to resume a run, in a folder that is either complete or absent.
//!
//! ```text
//! FOLDER/step-00001200/state.json
//! FOLDER/step-00001200/tensors.safetensors
//! ```
//!
//! `state.json` holds checksums of the tensor file and of itself. Tensors are written and read one by one, so the extra memory
//! is at most the size of the largest tensor.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use safetensors::tensor::{Dtype, View};
use serde::Deserialize;
use serde_json::{Value, json};
use wake_nn::weights::files::WeightFiles;
use whole_files::{entries, failed, file_checksum, sealed, unsealed};

use crate::error::{Error, Result};

/// Name of the tensor file.
const TENSORS: &str = "tensors.safetensors";
/// Tensors by name: shape and numbers.
pub type Tensors = BTreeMap<String, (Vec<usize>, Vec<f32>)>;

/// The state of a run after some steps.
#[derive(Debug, Clone, PartialEq)]
pub struct Checkpoint {
    /// Steps made.
    pub step: usize,
    /// Steps that changed the weights.
    pub applied: usize,
    /// Description of the run, compared when it is resumed.
    pub state: Value,
    /// Weights, averaged weights and averages of the optimizer.
    pub tensors: Tensors,
}

impl Checkpoint {
    /// Writes the checkpoint below a folder and removes older ones.
    ///
    /// Leftovers of killed runs are removed too: a folder belongs to one run and one process.
    ///
    /// - `keep`: number of checkpoints to keep, at least this one
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::Io`] when something cannot be written; older checkpoints are then still there.
    pub fn write(&self, folder: &Path, keep: usize) -> Result<PathBuf> {
        let target = folder.join(format!("step-{:08}", self.step));
        let temporary = folder.join(format!(".step-{:08}.{}.tmp", self.step, std::process::id()));
        let written = self.write_files(&temporary).and_then(|()| {
            if target.exists() {
                fs::remove_dir_all(&target)?;
            }
            fs::rename(&temporary, &target)
        });
        if written.is_err() {
            // The error of the write is reported, not that of the clean-up.
            fs::remove_dir_all(&temporary).ok();
        }
        written.map_err(|source| failed("write", &target, source))?;
        sweep(folder)?;
        let mut old = checkpoints(folder)?;
        old.truncate(old.len().saturating_sub(keep.max(1)));
        for (_, path) in old {
            fs::remove_dir_all(&path).map_err(|source| failed("remove", &path, source))?;
        }
        Ok(target)
    }

    /// Error that prevents a run of this `state` from resuming here, if any.
    pub(super) fn differs(&self, state: &Value) -> Option<Error> {
        let (key, there, here) = difference("", &self.state, state)?;
        Some(Error::Value(wake_nn::Error::InvalidOption {
            option: "checkpoint".to_owned(),
            value: format!("from a run with {key} = {there}"),
            expected: format!(
                "{here}; resume with the options of that run, or choose another folder"
            ),
        }))
    }

    fn write_files(&self, folder: &Path) -> std::io::Result<()> {
        fs::create_dir_all(folder)?;
        let file = folder.join(TENSORS);
        let tensors = self.tensors.iter();
        let tensors = tensors.map(|(name, (shape, numbers))| (name, Numbers { shape, numbers }));
        safetensors::serialize_to_file(tensors, None, &file).map_err(std::io::Error::other)?;
        let state = json!({
            "step": self.step, "applied": self.applied, "state": self.state,
            "tensors": file_checksum(&file)?,
        });
        let state = sealed(&format!("{state:#}")) + "\n";
        fs::write(folder.join("state.json"), state)?;
        for entry in fs::read_dir(folder)? {
            fs::File::open(entry?.path())?.sync_all()?;
        }
        Ok(())
    }

    /// Reads the newest checkpoint below a folder; `None` where there is none.
    ///
    /// # Errors
    ///
    /// [`Error::Data`] with the file whose checksum does not match, [`wake_nn::Error::Io`] or
    /// [`wake_nn::Error::InvalidSafetensors`] for a checkpoint that cannot be read.
    pub fn newest(folder: &Path) -> Result<Option<Self>> {
        match checkpoints(folder)?.pop() {
            None => Ok(None),
            Some((_, path)) => Self::read(&path).map(Some),
        }
    }

    /// The step of the newest checkpoint below a folder.
    pub(super) fn newest_step(folder: &Path) -> Result<Option<usize>> {
        Ok(checkpoints(folder)?.pop().map(|(step, _)| step))
    }

    /// Reads one checkpoint.
    ///
    /// # Errors
    ///
    /// As [`newest`](Self::newest).
    pub fn read(path: &Path) -> Result<Self> {
        let file = path.join("state.json");
        let text = whole_files::read_text(&file)?;
        let object = text.strip_suffix('\n').and_then(unsealed);
        let state = object.and_then(|object| serde_json::from_str::<State>(&object).ok());
        let State {
            step,
            applied,
            state,
            tensors,
        } = state.ok_or_else(|| damaged(&file))?;
        let file = path.join(TENSORS);
        let found = file_checksum(&file).map_err(|source| match source.kind() {
            ErrorKind::NotFound => damaged(&file),
            _ => failed("read", &file, source).into(),
        })?;
        if found != tensors {
            return Err(damaged(&file));
        }
        let mut tensors = Tensors::new();
        for (name, stored) in WeightFiles::open(&file)?.tensors()? {
            tensors.insert(name, (stored.shape().to_vec(), stored.numbers()?));
        }
        Ok(Self {
            step,
            applied,
            state,
            tensors,
        })
    }
}

/// The content of `state.json`.
#[derive(Deserialize)]
struct State {
    step: usize,
    applied: usize,
    state: Value,
    /// Checksum of the tensor file.
    tensors: String,
}

/// Error for a file that is missing or whose checksum does not match.
fn damaged(file: &Path) -> Error {
    let folder = file.parent().unwrap_or(file);
    Error::Data(wake_dataset::Error::Dataset {
        path: file.to_owned(),
        line: 0,
        message: format!(
            "missing, damaged, or from another version (its checksum does not match); remove the folder {} to resume from \
             the previous checkpoint",
            folder.file_name().unwrap_or_default().display()
        ),
    })
}

/// The first value in which two trees differ: its path, and both values.
pub(super) fn difference(path: &str, a: &Value, b: &Value) -> Option<(String, String, String)> {
    let below = |key: &str| match path {
        "" => key.to_owned(),
        _ => format!("{path}.{key}"),
    };
    match (a, b) {
        _ if a == b => None,
        (Value::Object(x), Value::Object(y)) => {
            let keys: std::collections::BTreeSet<&String> = x.keys().chain(y.keys()).collect();
            let find = |key: &String| difference(&below(key), &a[key], &b[key]);
            keys.into_iter().find_map(find)
        }
        (Value::Array(x), Value::Array(y)) if x.len() == y.len() => {
            let find = |k: usize| difference(&below(&k.to_string()), &x[k], &y[k]);
            (0..x.len()).find_map(find)
        }
        _ => Some((path.to_owned(), short(a), short(b))),
    }
}

/// Value as text for a message, at most 80 characters.
fn short(value: &Value) -> String {
    match value {
        Value::Null => "nothing".to_owned(),
        _ => value.to_string().chars().take(80).collect(),
    }
}

/// Removes half-written checkpoints.
fn sweep(folder: &Path) -> Result<()> {
    for path in entries(folder)? {
        if whole_files::is_temporary(&path) {
            fs::remove_dir_all(&path).map_err(|source| failed("remove", &path, source))?;
        }
    }
    Ok(())
}

/// The checkpoints below a folder, the newest last.
fn checkpoints(folder: &Path) -> Result<Vec<(usize, PathBuf)>> {
    if !folder.exists() {
        return Ok(Vec::new());
    }
    let mut found = Vec::new();
    for path in entries(folder)? {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if let Some(step) = name
            .strip_prefix("step-")
            .and_then(|step| step.parse().ok())
        {
            found.push((step, path));
        }
    }
    found.sort();
    Ok(found)
}

/// Tensor that is converted to bytes only when it is written.
struct Numbers<'a> {
    shape: &'a [usize],
    numbers: &'a [f32],
}

impl View for Numbers<'_> {
    fn dtype(&self) -> Dtype {
        Dtype::F32
    }

    fn shape(&self) -> &[usize] {
        self.shape
    }

    fn data(&self) -> Cow<'_, [u8]> {
        let bytes = self.numbers.iter().flat_map(|x| x.to_le_bytes());
        Cow::Owned(bytes.collect())
    }

    fn data_len(&self) -> usize {
        4 * self.numbers.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checkpoint(step: usize) -> Checkpoint {
        Checkpoint {
            step,
            applied: step - 1,
            state: serde_json::json!({"seed": 3}),
            tensors: BTreeMap::from([
                (
                    "a".to_owned(),
                    (vec![2, 2], vec![1.0, -0.0, f32::MIN_POSITIVE, step as f32]),
                ),
                ("b".to_owned(), (vec![300, 2], vec![0.25; 600])),
            ]),
        }
    }

    #[test]
    fn the_newest_comes_back_and_two_are_kept() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(
            Checkpoint::newest(&folder.path().join("none")).unwrap(),
            None
        );
        for step in [5, 20, 100] {
            checkpoint(step).write(folder.path(), 2).unwrap();
        }
        assert_eq!(
            Checkpoint::newest(folder.path()).unwrap(),
            Some(checkpoint(100))
        );
        let left = checkpoints(folder.path()).unwrap();
        assert_eq!(
            left.iter().map(|(step, _)| *step).collect::<Vec<_>>(),
            [20, 100]
        );
    }

    #[test]
    fn half_a_checkpoint_is_none() {
        let folder = tempfile::tempdir().unwrap();
        checkpoint(7).write(folder.path(), 2).unwrap();
        // A killed run leaves a folder of another name.
        let half = folder.path().join(".step-00000009.1.tmp");
        fs::create_dir(&half).unwrap();
        assert_eq!(
            Checkpoint::newest(folder.path()).unwrap().map(|c| c.step),
            Some(7)
        );
        checkpoint(8).write(folder.path(), 2).unwrap();
        assert!(!half.exists());
        fs::remove_dir_all(folder.path().join("step-00000008")).unwrap();
        let file = folder.path().join("step-00000007/tensors.safetensors");
        fs::write(&file, b"short").unwrap();
        let refused = Checkpoint::newest(folder.path()).unwrap_err().to_string();
        assert!(
            refused.contains("tensors.safetensors: missing, damaged"),
            "{refused}"
        );
    }

    /// Flips a bit in each byte of each file, and removes a file; following the message's advice makes the run resumable.
    #[test]
    fn a_damaged_checkpoint_is_refused_by_the_name_of_its_file() {
        let folder = tempfile::tempdir().unwrap();
        let small = |step| Checkpoint {
            state: serde_json::json!({"rate": 0.1234567890123456789, "list": [1.0, null]}),
            tensors: BTreeMap::from([("a".to_owned(), (vec![3], vec![1.0, -0.0, 2e-45]))]),
            ..checkpoint(step)
        };
        for step in [7, 8] {
            small(step).write(folder.path(), 2).unwrap();
        }
        let newest = folder.path().join("step-00000008");
        for name in ["state.json", "tensors.safetensors"] {
            let file = newest.join(name);
            let whole = fs::read(&file).unwrap();
            for at in 0..whole.len() {
                let mut damaged = whole.clone();
                damaged[at] ^= 1 << (at % 8);
                fs::write(&file, &damaged).unwrap();
                let refused = Checkpoint::newest(folder.path()).unwrap_err().to_string();
                assert!(refused.contains(name), "byte {at}: {refused}");
            }
            fs::write(&file, &whole).unwrap();
            assert_eq!(Checkpoint::newest(folder.path()).unwrap(), Some(small(8)));
        }
        let file = newest.join("tensors.safetensors");
        fs::write(&file, b"").unwrap();
        let refused = Checkpoint::newest(folder.path()).unwrap_err().to_string();
        assert!(
            refused.contains("remove the folder step-00000008"),
            "{refused}"
        );
        fs::remove_file(&file).unwrap();
        let refused = Checkpoint::newest(folder.path()).unwrap_err().to_string();
        assert!(refused.contains("tensors.safetensors"), "{refused}");
        fs::remove_dir_all(newest).unwrap();
        assert_eq!(Checkpoint::newest(folder.path()).unwrap(), Some(small(7)));
    }
}
