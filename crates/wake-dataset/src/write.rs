//! Makes a data set in a folder, or completes one.

use super::annotations::{Coco, data_yaml};
use super::layout::{Layout, Manifest, Shard, broken};
use super::metadata::{Log, Row, Rows};
use super::ordered::Ordered;
use super::scenes::Simulated;
use crate::error::{Error, Result};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;
use wake_physics::output;
use whole_files::{FolderLock, checksum, failed};

/// Progress of making a data set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Number of finished pairs.
    pub done: u64,
    /// Total number of pairs.
    pub total: u64,
    /// Number of pairs made by this run.
    pub made: u64,
}

/// Makes the data set of a manifest in a folder on `jobs` threads, continuing an earlier run.
///
/// The folder's content is a function of the manifest alone, byte for byte. A killed run leaves no half-written file; the next
/// run continues after checking existing files against their checksums. `watch` is called at the start and after every pair.
///
/// - `source`: the manifest's source, on the learnt sea that the manifest names, if any
///
/// # Errors
///
/// [`Error::Dataset`] if the folder holds something else or a damaged file, [`wake_nn::Error::Io`] if it cannot be written,
/// [`wake_nn::Error::InvalidOption`] for a source of another recipe or seed, or if only one of source and manifest has a sea.
pub fn write(
    folder: &Path,
    manifest: &Manifest,
    source: &Simulated,
    jobs: usize,
    mut watch: impl FnMut(Progress),
) -> Result<()> {
    check_source(manifest, source)?;
    let _lock = claim(folder, &manifest.text()?, manifest.shard)?;
    let mut log = Log::open(folder, manifest)?;
    let missing = missing(folder, manifest, &log.rows)?;
    let total = manifest.indices().end - manifest.indices().start;
    let mut progress = Progress {
        done: total - missing.indices.len() as u64,
        total,
        made: 0,
    };
    watch(progress);
    let next = manifest.indices().start + log.rows.len() as u64;
    for made in make(folder, source, jobs, missing)? {
        let (index, row) = made?;
        if index >= next {
            log.push(index, row)?;
        }
        progress.done += 1;
        progress.made += 1;
        watch(progress);
    }
    finish(folder, manifest, &log.finish()?)
}

/// Checks that a source makes the pairs of a manifest.
fn check_source(manifest: &Manifest, source: &Simulated) -> Result<()> {
    let same = source.seed() == manifest.seed && *source.recipe() == manifest.recipe;
    let refuse = |value: &str, expected: &str| {
        Error::Value(wake_nn::Error::InvalidOption {
            option: "source".to_owned(),
            value: value.to_owned(),
            expected: expected.to_owned(),
        })
    };
    match (source.sea(), &manifest.sea) {
        _ if !same => Err(refuse(
            "of another recipe or seed",
            "one of the manifest's recipe and seed",
        )),
        (Some(_), None) => Err(refuse(
            "on a learnt sea",
            "a manifest with the fingerprint of its file",
        )),
        (None, Some(_)) => Err(refuse(
            "without a learnt sea",
            "the learnt sea that the manifest names",
        )),
        _ => Ok(()),
    }
}

/// Locks a folder that is empty, or that an earlier run began with the same `dataset.json` and shard.
///
/// The folder belongs to this process until the lock is dropped.
pub(super) fn claim(folder: &Path, manifest: &str, shard: Option<Shard>) -> Result<FolderLock> {
    let lock = whole_files::lock_folder(folder)?;
    let layout = Layout(folder);
    let path = layout.manifest();
    match Manifest::read(folder)? {
        // Compare texts, because numbers parsed from JSON may differ in their last bit.
        Some(found) if found.shard == shard && is_text(&path, manifest) => {}
        Some(_) => {
            let message =
                "this set has another recipe, seed, count or shard; choose another folder";
            return Err(broken(&path, 1, message));
        }
        None if is_free(folder, shard)? => {
            if let Some(shard) = shard {
                whole_files::write_json(&layout.shard_note(), &shard)?;
            }
            whole_files::write_atomically(&path, manifest.as_bytes())?;
        }
        None => {
            let message = "this folder is not empty and not a data set; choose another folder";
            return Err(broken(folder, 0, message));
        }
    }
    for inner in layout.folders() {
        whole_files::make_folder(&inner)?;
    }
    Ok(lock)
}

/// Whether a file has exactly this content.
pub(super) fn is_text(path: &Path, text: &str) -> bool {
    whole_files::read_regular(path).is_ok_and(|found| found == text.as_bytes())
}

/// Whether a folder holds only files that may precede its `dataset.json`: shards, its own `shard.json`, temporary files.
fn is_free(folder: &Path, shard: Option<Shard>) -> Result<bool> {
    let mut entries = std::fs::read_dir(folder).map_err(|e| failed("read", folder, e))?;
    Ok(entries.all(|entry| {
        entry.is_ok_and(|e| {
            let name = e.file_name();
            let name = name.to_string_lossy();
            let own_note = shard.is_some() && name == "shard.json";
            own_note || name.starts_with("shard-") || whole_files::is_temporary(&e.path())
        })
    }))
}

/// Pairs that are still to be made.
struct Missing {
    indices: Vec<u64>,
    /// Line number and row of pairs that have a line but lack files.
    lines: BTreeMap<u64, (usize, Row)>,
}

/// Finds pairs without a line or without all of their files.
///
/// # Errors
///
/// [`Error::Dataset`] for the first file that differs from what was written.
fn missing(folder: &Path, manifest: &Manifest, rows: &Rows) -> Result<Missing> {
    let grid = &manifest.recipe.scene.grid;
    let size = [grid.rows, grid.columns];
    let is_there = |(at, (index, row)): (usize, &(u64, Row))| -> Result<bool> {
        let files = Layout(folder).files_of(*index);
        let [image, labels @ ..] = &files;
        let is_there = std::fs::metadata(image).is_ok_and(|file| file.len() > 0)
            && labels.iter().all(|labels| labels.exists());
        if is_there {
            row.check_files(&files, at + 1, size)?;
        }
        Ok(is_there)
    };
    let are_there: Vec<Result<bool>> = rows.par_iter().enumerate().map(is_there).collect();
    let mut lines = BTreeMap::new();
    for (at, (is_there, (index, row))) in are_there.into_iter().zip(rows).enumerate() {
        if !is_there? {
            lines.insert(*index, (at + 1, row.clone()));
        }
    }
    let indices = manifest.indices();
    let new = indices.start + rows.len() as u64..indices.end;
    Ok(Missing {
        indices: lines.keys().copied().chain(new).collect(),
        lines,
    })
}

/// Makes pairs and writes their files on `jobs` threads; rows are returned in order.
fn make(
    folder: &Path,
    source: &Simulated,
    jobs: usize,
    missing: Missing,
) -> Result<Ordered<(u64, Row)>> {
    let (source, folder) = (source.clone(), folder.to_owned());
    let Missing { indices, lines } = missing;
    Ordered::new(indices.into_iter(), jobs, move |index| {
        let pair = source.pair(index)?;
        let [image, labels @ ..] = Layout(&folder).files_of(index);
        let size = [pair.image.rows, pair.image.columns];
        let png = output::encode_png(&image, &pair.image.levels(), size[0], size[1])?;
        let row = Row::of(&pair, checksum(&png));
        if let Some((line, _)) = lines.get(&index).filter(|(_, kept)| *kept != row) {
            let message = format!(
                "pair {index} differs from this line, as it may on another processor or version; continue with those that \
                 made the set, or make it again in another folder"
            );
            return Err(broken(&Layout(&folder).metadata(), *line, message));
        }
        whole_files::write_atomically(&image, &png)?;
        for (path, text) in labels.iter().zip(row.labels(size)) {
            whole_files::write_atomically(path, text.as_bytes())?;
        }
        Ok((index, row))
    })
}

/// Writes the files that need all pairs: COCO labels, lists of the splits and `data.yaml`.
pub(super) fn finish(folder: &Path, manifest: &Manifest, rows: &Rows) -> Result<()> {
    let (layout, grid) = (Layout(folder), &manifest.recipe.scene.grid);
    let images = rows
        .iter()
        .map(|(index, row)| (*index, row.file_name.as_str(), &row.objects));
    let coco = Coco::of(images, [grid.rows, grid.columns]);
    whole_files::write_json(&layout.coco(), &coco)?;
    for (path, val) in layout.lists().iter().zip([false, true]) {
        let of = rows
            .iter()
            .filter(|(index, _)| manifest.is_val(*index) == val);
        let list: String = of
            .map(|(_, row)| format!("./{}\n", row.file_name))
            .collect();
        whole_files::write_atomically(path, list.as_bytes())?;
    }
    whole_files::write_atomically(&layout.yolo(), data_yaml().as_bytes())?;
    Ok(())
}
