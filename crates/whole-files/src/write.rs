//! Atomic file writing.
//!
//! A file is written under another name, `.NAME.PROCESS-NUMBER.tmp`, and locked while it is; then it takes its own name.

use crate::error::{Result, failed};
use serde::Serialize;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Tells apart the files that one process writes at the same time.
static COUNTER: AtomicU64 = AtomicU64::new(0);

/// Writes bytes to a temporary file and renames it: the file is complete, or as it was before.
///
/// # Errors
///
/// [`Error`](crate::Error); the neighbour is removed.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    write_with(path, |file| file.write_all(bytes)).map_err(|e| failed("write", path, e))
}

/// Writes a file piece by piece; the file gets its name when all of it is on disk.
///
/// # Errors
///
/// Those of the system and of `write`; what was written is removed.
pub fn write_with(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> std::io::Result<()>,
) -> std::io::Result<()> {
    let (neighbour, file) = temporary(path)?;
    let mut writer = BufWriter::with_capacity(1 << 20, file);
    let written = write(&mut writer)
        .and_then(|()| {
            writer
                .into_inner()
                .map_err(std::io::IntoInnerError::into_error)
        })
        .and_then(|file| {
            std::fs::rename(&neighbour, path)?;
            // Locked up to here.
            drop(file);
            Ok(())
        });
    if written.is_err() {
        // The write failed already; what is left of it is the lesser trouble.
        let _ = std::fs::remove_file(&neighbour);
    }
    written
}

/// Writes a file piece by piece, whole or not at all, in a folder that is made where it is missing; its bytes are on disk
/// when this returns.
///
/// # Errors
///
/// [`Error`](crate::Error); what was written is removed.
pub fn write_synced(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> std::io::Result<()>,
) -> Result<()> {
    let fail = |source: std::io::Error| failed("write", path, source);
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(fail)?;
    }
    let synced = |writer: &mut BufWriter<File>| {
        write(writer)?;
        writer.flush()?;
        writer.get_ref().sync_all()
    };
    write_with(path, synced).map_err(fail)
}

/// Writes a value as indented JSON.
///
/// # Errors
///
/// [`Error`](crate::Error).
pub fn write_json(path: &Path, value: &impl Serialize) -> Result<()> {
    let mut text = serde_json::to_string_pretty(value).map_err(|e| failed("encode", path, e))?;
    text.push('\n');
    write_atomically(path, text.as_bytes())
}

/// Whether a name is that of a temporary file of this crate.
pub fn is_temporary(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    name.starts_with('.') && name.ends_with(".tmp")
}

/// A new file beside `path`, locked; the lock ends with the file.
pub(crate) fn temporary(path: &Path) -> std::io::Result<(PathBuf, File)> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    loop {
        let number = COUNTER.fetch_add(1, Ordering::Relaxed);
        let neighbour = path.with_file_name(format!(".{name}.{}-{number}.tmp", std::process::id()));
        let file = match File::create_new(&neighbour) {
            // Left by a process that had this number.
            Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => continue,
            other => other?,
        };
        // Where the system has no locks, nothing is swept either.
        let _ = file.lock();
        // Between its making and its lock another process may have swept it.
        if neighbour.exists() {
            return Ok((neighbour, file));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{make_folder, write_atomically};

    #[test]
    fn a_failed_write_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new/file.txt");
        write_synced(&path, |writer| writer.write_all(b"old")).unwrap();
        let failed = write_synced(&path, |writer| {
            writer.write_all(b"half")?;
            Err(std::io::Error::other("disk full"))
        });
        assert_eq!(failed.unwrap_err().action, "write");
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(
            std::fs::read_dir(path.parent().unwrap()).unwrap().count(),
            1
        );
    }

    #[test]
    fn failures_name_the_path_and_leave_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        std::fs::write(&file, "here").unwrap();
        for result in [
            make_folder(&file.join("below")),
            write_atomically(&file.join("below/x"), b"x"),
        ] {
            let message = result.unwrap_err().to_string();
            assert!(message.starts_with("cannot "), "{message}");
        }
        assert_eq!(std::fs::read_to_string(&file).unwrap(), "here");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
