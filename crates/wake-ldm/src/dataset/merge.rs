//! Joins the shards of a data set into the set that one run would have made.

use super::layout::{Layout, Manifest, Shard, broken, cannot};
use super::log::{Rows, line, parse};
use super::write::{claim, finish};
use crate::error::Result;
use std::path::{Path, PathBuf};
use wake_physics::output;

/// Folder of a shard below that of its set.
pub fn shard_folder(folder: &Path, shard: Shard) -> PathBuf {
    Layout(folder).shard(shard)
}

/// Joins the shards `shard-0`, `shard-1`, … of a folder into one set in the folder itself, byte for byte the one that
/// would have been made without shards, and removes them. A merge that is killed can be started again.
///
/// # Errors
///
/// [`Error::Dataset`](crate::Error::Dataset) if a shard is missing, unfinished or of another set; nothing is changed then.
pub fn merge(folder: &Path) -> Result<Manifest> {
    let shards = shards(folder)?;
    let whole = Manifest {
        shard: None,
        ..shards[0].1.clone()
    };
    let mut rows = Rows::new();
    for (path, manifest) in &shards {
        rows.extend(finished_rows(folder, path, manifest)?);
    }
    claim(folder, &whole)?;
    for (path, manifest) in &shards {
        move_files(folder, path, manifest)?;
    }
    let lines: Result<String> = rows.iter().map(|(_, row)| line(row)).collect();
    output::write_atomically(&Layout(folder).metadata(), lines?.as_bytes())?;
    finish(folder, &whole, &rows)?;
    for (path, _) in &shards {
        remove(path)?;
    }
    Ok(whole)
}

/// Folder and manifest of every shard, in order; at least one.
fn shards(folder: &Path) -> Result<Vec<(PathBuf, Manifest)>> {
    let first = shard_at(folder, 0, None)?;
    let of = first.1.shard.map_or(1, |shard| shard.of);
    let mut shards = vec![first];
    for number in 1..of {
        let next = shard_at(folder, number, Some(&shards[0].1))?;
        shards.push(next);
    }
    Ok(shards)
}

/// Shard `number` of a folder, which must be of the same set as the first.
fn shard_at(folder: &Path, number: u64, first: Option<&Manifest>) -> Result<(PathBuf, Manifest)> {
    let path = Layout(folder).shard(Shard { number, of: 0 });
    let Some(manifest) = Manifest::read(&path)? else {
        let message = format!("shard {number} is missing; make it with --shard {number}/n");
        return Err(broken(&path, 0, message));
    };
    let of = manifest.shard.map_or(0, |shard| shard.of);
    let expected = Manifest {
        shard: Some(Shard { number, of }),
        ..first.unwrap_or(&manifest).clone()
    };
    let same_of = first.is_none_or(|first| first.shard.is_some_and(|shard| shard.of == of));
    if manifest != expected || !same_of {
        let message = format!("not shard {number} of the same set as shard-0");
        return Err(broken(&Layout(&path).manifest(), 1, message));
    }
    Ok((path, manifest))
}

/// The rows of a shard, all of them, with every file here or already moved.
fn finished_rows(folder: &Path, path: &Path, manifest: &Manifest) -> Result<Rows> {
    let metadata = Layout(path).metadata();
    let text = std::fs::read(&metadata).map_err(|e| cannot("read", &metadata, e))?;
    let rows = parse(&metadata, &text, manifest)?;
    let unfinished = |what: String| {
        let message = format!("{what}; run the same --shard again to finish it");
        broken(&metadata, rows.len(), message)
    };
    let count = manifest.indices().end - manifest.indices().start;
    if rows.len() as u64 != count {
        return Err(unfinished(format!("{} of {count} pairs", rows.len())));
    }
    for (index, _) in &rows {
        let here = Layout(path).files_of(*index);
        let moved = Layout(folder).files_of(*index);
        for (here, moved) in here.iter().zip(&moved) {
            if !here.is_file() && !moved.is_file() {
                return Err(unfinished(format!("{} is missing", here.display())));
            }
        }
    }
    Ok(rows)
}

fn move_files(folder: &Path, path: &Path, manifest: &Manifest) -> Result<()> {
    for index in manifest.indices() {
        let from = Layout(path).files_of(index);
        let to = Layout(folder).files_of(index);
        for (from, to) in from.iter().zip(&to).filter(|(from, _)| from.is_file()) {
            std::fs::rename(from, to).map_err(|e| cannot("move", from, e))?;
        }
    }
    Ok(())
}

/// Removes what is left of a merged shard: only files that a shard has.
fn remove(path: &Path) -> Result<()> {
    let layout = Layout(path);
    let gone = |result: std::io::Result<()>| match result {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(cannot("remove", path, e)),
        _ => Ok(()),
    };
    for file in [layout.coco(), layout.yolo()] {
        gone(std::fs::remove_file(file))?;
    }
    for inner in [layout.images(), layout.labels()] {
        gone(std::fs::remove_dir(inner))?;
    }
    // The last two say that the shard was finished: without them a merge cannot be started again.
    for file in [layout.metadata(), layout.manifest()] {
        gone(std::fs::remove_file(file))?;
    }
    gone(std::fs::remove_dir(path))
}
