//! The index of a model in shards: which tensor lies in which file.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::error::{Error, Result};
use whole_files::read_text;

/// Files listed in an index, each with its tensors.
#[derive(Debug)]
pub(super) struct ShardIndex {
    path: PathBuf,
    shards: BTreeMap<String, BTreeSet<String>>,
}

impl ShardIndex {
    /// Reads an index, whose shards must be in the same folder.
    pub(super) fn read(path: &Path) -> Result<Self> {
        let json: Value =
            serde_json::from_str(&read_text(path)?).map_err(|source| Error::Json {
                path: path.to_owned(),
                source,
            })?;
        let mut index = Self {
            path: path.to_owned(),
            shards: BTreeMap::new(),
        };
        let map = json["weight_map"].as_object();
        for (tensor, shard) in map.ok_or_else(|| index.invalid("weight_map is missing"))? {
            let Some(shard) = shard.as_str() else {
                return Err(index.invalid("a value of weight_map is not a file name"));
            };
            if Path::new(shard).file_name() != Some(shard.as_ref()) {
                return Err(index.invalid(&format!("shard {shard} lies outside the folder")));
            }
            let tensors = index.shards.entry(shard.to_owned()).or_default();
            tensors.insert(tensor.clone());
        }
        Ok(index)
    }

    pub(super) fn paths(&self) -> impl Iterator<Item = PathBuf> {
        self.shards
            .keys()
            .map(|name| self.path.with_file_name(name))
    }

    /// Rejects a shard that lacks a tensor listed for it or holds one that is not listed.
    pub(super) fn check(&self, shard: &Path, found: Vec<String>) -> Result<()> {
        let shard = shard.file_name().unwrap_or_default().to_string_lossy();
        let found: BTreeSet<String> = found.into_iter().collect();
        let Some(listed) = self.shards.get(shard.as_ref()) else {
            return Ok(());
        };
        if let Some(name) = listed.difference(&found).next() {
            return Err(self.invalid(&format!("{shard} does not hold {name}")));
        }
        match found.difference(listed).next() {
            Some(name) => Err(self.invalid(&format!("{shard} holds {name}, which is not listed"))),
            None => Ok(()),
        }
    }

    fn invalid(&self, reason: &str) -> Error {
        Error::InvalidSafetensors {
            path: self.path.clone(),
            reason: reason.into(),
        }
    }
}
