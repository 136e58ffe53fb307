//! Finding and mapping the weight files of a folder.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::path::{Path, PathBuf};

use memmap2::Mmap;
use safetensors::SafeTensors;
use safetensors::tensor::TensorView;
use serde_json::Value;

use super::header;
use super::names::modern;
use super::read_text;
use crate::error::{Error, Result};

/// File names of models, the preferred ones first; each may also come in shards with an index.
const NAMES: [&str; 4] = [
    "diffusion_pytorch_model.safetensors",
    "model.safetensors",
    "diffusion_pytorch_model.fp16.safetensors",
    "model.fp16.safetensors",
];

/// One tensor in a mapped file.
#[derive(Debug)]
pub(super) struct Stored<'a> {
    pub(super) view: TensorView<'a>,
}

/// The files of one model, mapped into memory.
#[derive(Debug)]
pub(super) struct MappedFiles {
    files: Vec<(PathBuf, Bytes)>,
}

/// The bytes of a file on disk, or of one that is part of the program.
#[derive(Debug)]
enum Bytes {
    Mapped(Mmap),
    Embedded(&'static [u8]),
}

impl std::ops::Deref for Bytes {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        match self {
            Self::Mapped(map) => map,
            Self::Embedded(bytes) => bytes,
        }
    }
}

impl MappedFiles {
    /// Maps a file, or the files of a folder.
    pub(super) fn open(path: &Path) -> Result<Self> {
        let paths = if path.is_dir() {
            weight_files(path)?
        } else {
            vec![path.to_owned()]
        };
        let files = paths
            .into_iter()
            .map(|path| Ok((path.clone(), Bytes::Mapped(map(&path)?))));
        Ok(Self {
            files: files.collect::<Result<_>>()?,
        })
    }

    /// A file that is part of the program; `name` only serves messages.
    pub(super) fn embedded(name: &str, bytes: &'static [u8]) -> Self {
        Self {
            files: vec![(PathBuf::from(name), Bytes::Embedded(bytes))],
        }
    }

    /// Refuses files whose header has an entry that would change the numbers.
    pub(super) fn refuse_metadata(&self, key: &str) -> Result<()> {
        for (path, bytes) in &self.files {
            let header =
                SafeTensors::read_metadata(bytes).map_err(|error| Error::InvalidSafetensors {
                    path: path.clone(),
                    reason: error.to_string(),
                })?;
            let entry = header
                .1
                .metadata()
                .as_ref()
                .and_then(|entries| entries.get(key));
            if let Some(value) = entry {
                return Err(Error::Unsupported {
                    option: key.to_owned(),
                    value: value.chars().take(80).collect(),
                    supported: "absent".to_owned(),
                });
            }
        }
        Ok(())
    }

    /// All tensors under their present names.
    pub(super) fn tensors(&self) -> Result<BTreeMap<String, Stored<'_>>> {
        let mut tensors = BTreeMap::new();
        for (path, bytes) in &self.files {
            let invalid = |reason: String| Error::InvalidSafetensors {
                path: path.clone(),
                reason,
            };
            header::refuse_duplicates(bytes).map_err(invalid)?;
            let file =
                SafeTensors::deserialize(bytes).map_err(|error| invalid(error.to_string()))?;
            for (name, view) in file.tensors() {
                let name = modern(&name);
                if tensors.insert(name.clone(), Stored { view }).is_some() {
                    return Err(invalid(format!("two tensors are called {name}")));
                }
            }
        }
        Ok(tensors)
    }
}

/// The weight files of a folder: one, or all that an index names.
fn weight_files(folder: &Path) -> Result<Vec<PathBuf>> {
    for name in NAMES {
        let whole = folder.join(name);
        if whole.is_file() {
            return Ok(vec![whole]);
        }
        let index = folder.join(format!("{name}.index.json"));
        if index.is_file() {
            return shards(folder, &index);
        }
    }
    let expected = NAMES
        .iter()
        .flat_map(|name| [(*name).to_owned(), format!("{name}.index.json")]);
    Err(Error::MissingFile {
        folder: folder.to_owned(),
        expected: expected.collect(),
    })
}

/// The files that an index names, which must lie beside it.
fn shards(folder: &Path, index: &Path) -> Result<Vec<PathBuf>> {
    let json: Value = serde_json::from_str(&read_text(index)?).map_err(|source| Error::Json {
        path: index.to_owned(),
        source,
    })?;
    let invalid = |reason: &str| Error::InvalidSafetensors {
        path: index.to_owned(),
        reason: reason.to_owned(),
    };
    let map = json["weight_map"]
        .as_object()
        .ok_or_else(|| invalid("no weight_map"))?;
    let mut names = BTreeSet::new();
    for name in map.values() {
        let name = name
            .as_str()
            .ok_or_else(|| invalid("weight_map holds other than names"))?;
        if Path::new(name).file_name() != Some(name.as_ref()) {
            return Err(invalid("a shard lies outside the folder"));
        }
        names.insert(folder.join(name));
    }
    Ok(names.into_iter().collect())
}

#[allow(unsafe_code, reason = "mapping a file has no safe interface")]
fn map(path: &Path) -> Result<Mmap> {
    let io = |source| Error::Io {
        action: "read",
        path: path.to_owned(),
        source,
    };
    let file = File::open(path).map_err(io)?;
    if file.metadata().map_err(io)?.len() < 8 {
        let reason = "too short for a header".to_owned();
        return Err(Error::InvalidSafetensors {
            path: path.to_owned(),
            reason,
        });
    }
    // SAFETY: the map is only read, its header is checked before use, and any bytes are valid
    // numbers. Truncating the file while it is mapped is the one thing that the caller must not do.
    unsafe { Mmap::map(&file) }.map_err(io)
}
