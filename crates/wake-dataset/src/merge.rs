//! Joins the shards of a data set into the set that one run would have made.

use super::layout::{Layout, Manifest, Shard, broken};
use super::metadata::{Rows, parse};
use super::write::{claim, finish, is_text};
use crate::error::Result;
use std::path::{Path, PathBuf};
use whole_files::{entries, failed, read_text};

/// Folder of a shard, below the folder of its set.
pub fn shard_folder(folder: &Path, shard: Shard) -> PathBuf {
    Layout(folder).shard(shard)
}

/// Joins the shards `shard-0`, `shard-1`, … of a folder into one set in that folder, byte for byte the set made without
/// shards, and removes the shards. A merge that was killed can be restarted.
///
/// # Errors
///
/// [`Error::Dataset`](crate::Error::Dataset) if a shard is missing, unfinished, damaged or of another set; then nothing is
/// changed.
pub fn merge(folder: &Path) -> Result<Manifest> {
    if let Some(whole) = merged_before(folder)? {
        remove_shards(folder)?;
        return Ok(whole);
    }
    let shards = shards(folder)?;
    let (mut lines, mut rows) = (Vec::new(), Rows::new());
    for (path, manifest) in &shards {
        let (text, its_rows) = finished_rows(folder, path, manifest)?;
        lines.extend(text);
        rows.extend(its_rows);
    }
    let whole = Manifest {
        shard: None,
        ..shards[0].1.clone()
    };
    let _lock = claim(folder, &manifest_text(&shards[0].0)?, None)?;
    for (path, manifest) in &shards {
        move_files(folder, path, manifest)?;
    }
    whole_files::write_atomically(&Layout(folder).metadata(), &lines)?;
    finish(folder, &whole, &rows)?;
    remove_shards(folder)?;
    Ok(whole)
}

/// The set of an earlier merge that finished, except perhaps for removing the shards.
fn merged_before(folder: &Path) -> Result<Option<Manifest>> {
    let Some(whole) = Manifest::read(folder)? else {
        return Ok(None);
    };
    let last = Layout(folder).yolo();
    let metadata = whole_files::read_regular(&Layout(folder).metadata()).unwrap_or_default();
    let lines = metadata.iter().filter(|&&b| b == b'\n').count();
    let finished = last.is_file() && lines as u64 == whole.count;
    Ok((finished && whole.shard.is_none()).then_some(whole))
}

/// Content of `dataset.json`.
fn manifest_text(folder: &Path) -> Result<String> {
    Ok(read_text(&Layout(folder).manifest())?)
}

/// Folders and manifests of all shards, in order; at least one.
fn shards(folder: &Path) -> Result<Vec<(PathBuf, Manifest)>> {
    let first = shard_at(folder, 0)?;
    let of = first.1.shard.map_or(1, |shard| shard.of);
    let text = manifest_text(&first.0)?;
    let mut shards = vec![first];
    for number in 1..of {
        let (path, manifest) = shard_at(folder, number)?;
        if manifest.shard != Some(Shard { number, of })
            || !is_text(&Layout(&path).manifest(), &text)
        {
            let message = format!(
                "this is not shard {number} of the same set as shard-0; make it again with the same recipe, seed and count"
            );
            return Err(broken(&Layout(&path).manifest(), 1, message));
        }
        shards.push((path, manifest));
    }
    Ok(shards)
}

fn shard_at(folder: &Path, number: u64) -> Result<(PathBuf, Manifest)> {
    let path = Layout(folder).shard(Shard { number, of: 0 });
    match Manifest::read(&path)? {
        Some(manifest) if manifest.shard.is_some_and(|shard| shard.number == number) => {
            Ok((path, manifest))
        }
        Some(_) => {
            let message =
                format!("this is not shard {number}; remove the folder and make the shard again");
            Err(broken(&path, 0, message))
        }
        None => {
            let message = format!("shard {number} is missing; make it in the same folder");
            Err(broken(&path, 0, message))
        }
    }
}

/// Lines and rows of a finished shard, after checking that every file is here or already moved, and unchanged.
fn finished_rows(folder: &Path, path: &Path, manifest: &Manifest) -> Result<(Vec<u8>, Rows)> {
    let metadata = Layout(path).metadata();
    let text = whole_files::read_bytes(&metadata)?;
    let rows = parse(&metadata, &text, manifest)?;
    let unfinished = |what: String| {
        let message = format!("{what}; make the same shard again to finish it");
        broken(&metadata, rows.len(), message)
    };
    let count = manifest.indices().end - manifest.indices().start;
    if rows.len() as u64 != count {
        return Err(unfinished(format!(
            "it has {} of {count} pairs",
            rows.len()
        )));
    }
    let grid = &manifest.recipe.scene.grid;
    for (at, (index, row)) in rows.iter().enumerate() {
        let mut files = Layout(path).files_of(*index);
        for (file, moved) in files.iter_mut().zip(Layout(folder).files_of(*index)) {
            if !file.is_file() && !moved.is_file() {
                return Err(unfinished(format!("{} is missing", file.display())));
            }
            if !file.is_file() {
                *file = moved;
            }
        }
        row.check_files(&files, at + 1, [grid.rows, grid.columns])?;
    }
    Ok((text, rows))
}

fn move_files(folder: &Path, path: &Path, manifest: &Manifest) -> Result<()> {
    for index in manifest.indices() {
        let from = Layout(path).files_of(index);
        let to = Layout(folder).files_of(index);
        for (from, to) in from.iter().zip(&to).filter(|(from, _)| from.is_file()) {
            std::fs::rename(from, to).map_err(|e| failed("move", from, e))?;
        }
    }
    Ok(())
}

/// Removes the remains of a set's shards, and nothing else.
fn remove_shards(folder: &Path) -> Result<()> {
    let text = manifest_text(folder)?;
    for path in entries(folder)? {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let number = name
            .strip_prefix("shard-")
            .and_then(|n| n.parse::<u64>().ok());
        let manifest = Layout(&path).manifest();
        if number.is_some() && (is_text(&manifest, &text) || !manifest.exists()) {
            remove(&path)?;
        }
    }
    Ok(())
}

/// Removes a shard without images, deleting only files that belong to a shard.
fn remove(path: &Path) -> Result<()> {
    let layout = Layout(path);
    let gone = |result: std::io::Result<()>| match result {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(failed("remove", path, e)),
        _ => Ok(()),
    };
    for inner in layout.folders() {
        gone(std::fs::remove_dir(inner))?;
    }
    let [train, val] = layout.lists();
    for file in [
        layout.coco(),
        train,
        val,
        layout.yolo(),
        layout.metadata(),
        layout.shard_note(),
        layout.manifest(),
    ] {
        gone(std::fs::remove_file(file))?;
    }
    Ok(gone(std::fs::remove_dir(path))?)
}
