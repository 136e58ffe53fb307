//! Locking of folders, and removal of temporary files of killed processes.

use crate::error::{Result, failed};
use crate::write::{is_temporary, temporary};
use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};

/// Makes a folder and the folders above it, checks that files can be written there, and [`sweep`]s it.
///
/// # Errors
///
/// [`Error`](crate::Error) if the folder cannot be made or written to.
pub fn make_folder(folder: &Path) -> Result<()> {
    let fail = |e: std::io::Error| failed("write to the folder", folder, e);
    std::fs::create_dir_all(folder).map_err(fail)?;
    let (probe, _lock) = temporary(&folder.join("probe")).map_err(fail)?;
    std::fs::remove_file(&probe).map_err(fail)?;
    sweep(folder)
}

/// Exclusive lock of this process on a folder, released when dropped.
#[derive(Debug)]
pub struct FolderLock {
    _folder: Option<File>,
}

/// Makes a folder and locks it for this process.
///
/// On systems that cannot lock folders, nothing is locked.
///
/// # Errors
///
/// [`Error`](crate::Error) if another process holds the lock, or as [`make_folder`].
pub fn lock_folder(folder: &Path) -> Result<FolderLock> {
    make_folder(folder)?;
    let Ok(handle) = File::open(folder) else {
        return Ok(FolderLock { _folder: None });
    };
    match handle.try_lock() {
        Ok(()) => Ok(FolderLock {
            _folder: Some(handle),
        }),
        Err(TryLockError::WouldBlock) => {
            let message =
                "another process uses it; wait for that process, or choose another folder";
            Err(failed(
                "lock the folder",
                folder,
                std::io::Error::other(message),
            ))
        }
        Err(TryLockError::Error(_)) => Ok(FolderLock { _folder: None }),
    }
}

/// Paths of the entries of a folder, sorted by name.
///
/// # Errors
///
/// If the folder cannot be read.
pub fn entries(folder: &Path) -> Result<Vec<PathBuf>> {
    let fail = |e| failed("read", folder, e);
    let entries = std::fs::read_dir(folder).map_err(fail)?;
    let paths = entries.map(|entry| Ok(entry.map_err(fail)?.path()));
    let mut paths: Vec<PathBuf> = paths.collect::<Result<_>>()?;
    paths.sort();
    Ok(paths)
}

/// Removes temporary files of killed processes from a folder; keeps the files of running ones.
///
/// # Errors
///
/// [`Error`](crate::Error) if the folder cannot be read.
pub fn sweep(folder: &Path) -> Result<()> {
    for path in entries(folder)? {
        if is_temporary(&path) && path.is_file() && is_abandoned(&path) {
            let _ = std::fs::remove_file(&path);
        }
    }
    Ok(())
}

/// Whether no process is writing a file.
fn is_abandoned(path: &Path) -> bool {
    File::open(path).is_ok_and(|file| file.try_lock().is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Locked temporary files are being written and are kept; unlocked ones were left by killed processes and are removed.
    #[test]
    fn a_good_run_sweeps_what_dead_ones_left_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        for name in [
            ".fields.safetensors.99.tmp",
            ".image.png.1-7.tmp",
            "notes.tmp",
            ".profile",
        ] {
            std::fs::write(path(name), "here").unwrap();
        }
        let (alive, lock) = temporary(&path("labels.json")).unwrap();
        make_folder(folder.path()).unwrap();
        let left = |name: &str| path(name).exists();
        assert!(!left(".fields.safetensors.99.tmp") && !left(".image.png.1-7.tmp"));
        assert!(left("notes.tmp") && left(".profile") && alive.exists());
        drop(lock);
        sweep(folder.path()).unwrap();
        assert!(!alive.exists());
    }

    #[test]
    fn a_folder_belongs_to_one_at_a_time() {
        let folder = tempfile::tempdir().unwrap();
        let lock = lock_folder(folder.path()).unwrap();
        let refused = lock_folder(folder.path()).unwrap_err().to_string();
        assert!(refused.contains("another process"), "{refused}");
        drop(lock);
        lock_folder(folder.path()).unwrap();
    }
}
