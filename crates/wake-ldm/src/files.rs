//! Text files that are read to a limit, files that are either whole or not there, and short names of their content.

use std::fs::{self, File};
use std::io::{BufWriter, Read, Write};
use std::path::Path;

use crate::error::{Error, Result};
use wake_physics::output;

/// No text file that is read as a whole is longer than this \[bytes\].
const LONGEST_TEXT: u64 = 16 << 20;

/// Reads a text file of at most 16 MiB, such as a configuration or the labels of a folder.
///
/// # Errors
///
/// [`Error::Io`] if it is longer, no regular file, no UTF-8, or cannot be read.
pub fn read_text(path: &Path) -> Result<String> {
    let io = |source| unreadable(path, source);
    check_regular(path)?;
    let mut text = String::new();
    let mut file = File::open(path).map_err(io)?.take(LONGEST_TEXT + 1);
    file.read_to_string(&mut text).map_err(io)?;
    if text.len() as u64 > LONGEST_TEXT {
        let message = "longer than 16 MiB";
        return Err(io(std::io::Error::other(message)));
    }
    Ok(text)
}

/// The bytes of a file.
///
/// # Errors
///
/// [`Error::Io`] if it is no regular file or cannot be read.
pub(crate) fn read_bytes(path: &Path) -> Result<Vec<u8>> {
    check_regular(path)?;
    fs::read(path).map_err(|source| unreadable(path, source))
}

/// Refuses what is no regular file: opening a pipe would wait for somebody to write into it.
fn check_regular(path: &Path) -> Result<()> {
    let io = |source| unreadable(path, source);
    match fs::metadata(path).map_err(io)?.is_file() {
        true => Ok(()),
        false => Err(io(std::io::Error::other("no regular file"))),
    }
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
    let synced = |writer: &mut BufWriter<File>| {
        write(writer)?;
        writer.flush()?;
        writer.get_ref().sync_all()
    };
    output::write_with(path, synced).map_err(failed)
}

/// Writes a text file that is either whole or not there.
pub(crate) fn write_text(path: &Path, text: &str) -> Result<()> {
    write_atomically(path, |writer| writer.write_all(text.as_bytes()))
}

/// A short name of the content of a file: FNV-1a of 64 bits.
///
/// # Errors
///
/// [`Error::Io`] if it cannot be read.
///
/// # References
///
/// Fowler, Noll & Vo, "The FNV Non-Cryptographic Hash Algorithm".
pub fn fingerprint(path: &Path) -> Result<String> {
    let bytes = read_bytes(path)?;
    let mix = |hash: u64, &byte: &u8| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    let hash = bytes.iter().fold(0xcbf2_9ce4_8422_2325, mix);
    Ok(format!("{hash:016x}"))
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

    #[test]
    fn long_files_and_devices_are_refused() {
        let path = Path::new("/dev/zero");
        if path.exists() {
            for refused in [read_text(path).map(drop), fingerprint(path).map(drop)] {
                let refused = refused.unwrap_err().to_string();
                assert!(refused.contains("no regular file"), "{refused}");
            }
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("config.json");
        let file = File::create(&path).unwrap();
        file.set_len(LONGEST_TEXT + 1).unwrap();
        let refused = read_text(&path).unwrap_err().to_string();
        assert!(refused.contains("longer than 16 MiB"), "{refused}");
    }

    /// The values that the algorithm's authors publish for "" and "foobar".
    #[test]
    fn fingerprints_are_those_of_the_algorithm() {
        let file = tempfile::NamedTempFile::new().unwrap();
        assert_eq!(fingerprint(file.path()).unwrap(), "cbf29ce484222325");
        fs::write(file.path(), "foobar").unwrap();
        assert_eq!(fingerprint(file.path()).unwrap(), "85944171f73967e8");
    }
}
