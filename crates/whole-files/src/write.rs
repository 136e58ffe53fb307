//! Atomic file writing.
//!
//! A file is written and locked under a temporary name, `.NAME.PROCESS-NUMBER.tmp`, and renamed when it is complete.

use crate::error::{Result, failed};
use serde::Serialize;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Number that distinguishes files written by one process at the same time.
static COUNTER: AtomicU64 = AtomicU64::new(0);

/// Writes bytes to a temporary file and renames it, so that the file is either complete or unchanged.
///
/// # Errors
///
/// [`Error`](crate::Error) if writing fails; the temporary file is removed.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    write_with(path, |file| file.write_all(bytes)).map_err(|e| failed("write", path, e))
}

/// Writes a file in pieces; the file gets its name when it is complete.
///
/// # Errors
///
/// Errors of the system and of `write`; the temporary file is removed.
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
            // The lock ends here.
            drop(file);
            Ok(())
        });
    if written.is_err() {
        // The error of the write is returned; a failed removal is ignored.
        let _ = std::fs::remove_file(&neighbour);
    }
    written
}

/// Writes a file in pieces, completely or not at all, making its folder if it is missing; the bytes are synced to disk on
/// return.
///
/// # Errors
///
/// [`Error`](crate::Error) if writing fails; the temporary file is removed.
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
/// [`Error`](crate::Error) if encoding or writing fails.
pub fn write_json(path: &Path, value: &impl Serialize) -> Result<()> {
    let mut text = serde_json::to_string_pretty(value).map_err(|e| failed("encode", path, e))?;
    text.push('\n');
    write_atomically(path, text.as_bytes())
}

/// Whether a path has the name of a temporary file of this crate.
pub fn is_temporary(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    name.starts_with('.') && name.ends_with(".tmp")
}

/// Makes a locked temporary file beside `path`; closing the file releases the lock.
pub(crate) fn temporary(path: &Path) -> std::io::Result<(PathBuf, File)> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    loop {
        let number = COUNTER.fetch_add(1, Ordering::Relaxed);
        let neighbour = path.with_file_name(format!(".{name}.{}-{number}.tmp", std::process::id()));
        let file = match File::create_new(&neighbour) {
            // Left by an earlier process with the same number.
            Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => continue,
            other => other?,
        };
        // On systems without locks, nothing is swept either.
        let _ = file.lock();
        // Another process may have swept the file before it was locked.
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
