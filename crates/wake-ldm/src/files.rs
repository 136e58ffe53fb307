//! Text files that are read to a limit, and files that are either whole or not there.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::error::{Error, Result};

/// No configuration file is longer than this.
const LONGEST_TEXT: u64 = 16 << 20;

/// Tells apart the files that one process writes at the same time.
static COUNTER: AtomicU64 = AtomicU64::new(0);

/// Reads a configuration file.
pub(crate) fn read_text(path: &Path) -> Result<String> {
    let io = |source| unreadable(path, source);
    if fs::metadata(path).map_err(io)?.len() > LONGEST_TEXT {
        return Err(io(std::io::Error::other(
            "longer than 16 MiB, so no configuration",
        )));
    }
    fs::read_to_string(path).map_err(io)
}

/// The error for a file that cannot be read.
pub(crate) fn unreadable(path: &Path, source: std::io::Error) -> Error {
    Error::Io {
        action: "read",
        path: path.to_owned(),
        source,
    }
}

/// Writes a file under another name beside its target and renames it when all of it is on disk.
pub(crate) fn write_atomically(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> std::io::Result<()>,
) -> Result<()> {
    let failed = |source| Error::Io {
        action: "write",
        path: path.to_owned(),
        source,
    };
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).map_err(failed)?;
    }
    let number = COUNTER.fetch_add(1, Ordering::Relaxed);
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let temporary = path.with_file_name(format!(".{name}.{}-{number}.tmp", std::process::id()));
    let written = write_all(&temporary, write).and_then(|()| fs::rename(&temporary, path));
    if written.is_err() {
        // The write failed already; a left-over temporary file is the lesser trouble.
        fs::remove_file(&temporary).ok();
    }
    written.map_err(failed)
}

fn write_all(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> std::io::Result<()>,
) -> std::io::Result<()> {
    let mut writer = BufWriter::with_capacity(1 << 20, File::create_new(path)?);
    write(&mut writer)?;
    writer
        .into_inner()
        .map_err(std::io::IntoInnerError::into_error)?
        .sync_all()
}

/// Writes a text file that is either whole or not there.
pub(crate) fn write_text(path: &Path, text: &str) -> Result<()> {
    write_atomically(path, |writer| writer.write_all(text.as_bytes()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new/file.txt");
        write_text(&path, "old").unwrap();
        let failed = write_atomically(&path, |writer| {
            writer.write_all(b"half")?;
            Err(std::io::Error::other("disk full"))
        });
        assert!(matches!(
            failed,
            Err(Error::Io {
                action: "write",
                ..
            })
        ));
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(fs::read_dir(path.parent().unwrap()).unwrap().count(), 1);
    }
}
