//! Reading of regular files, of text up to a size limit, and fingerprints of files.

use crate::error::{Result, failed};
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;

/// Largest size of a text file \[bytes\].
const LONGEST_TEXT: u64 = 16 << 20;

/// Reads a text file of at most 16 MiB, such as a configuration or the labels of a folder.
///
/// # Errors
///
/// [`Error`](crate::Error) if the file is longer, not a regular file, not UTF-8, or cannot be read.
pub fn read_text(path: &Path) -> Result<String> {
    let io = |source| failed("read", path, source);
    let mut text = String::new();
    let mut file = open_regular(path).map_err(io)?.take(LONGEST_TEXT + 1);
    file.read_to_string(&mut text).map_err(io)?;
    if text.len() as u64 > LONGEST_TEXT {
        let message = "the file is longer than 16 MiB";
        return Err(io(io::Error::other(message)));
    }
    Ok(text)
}

/// Reads the bytes of a regular file, with the path in the error.
///
/// # Errors
///
/// [`Error`](crate::Error) if the path is not a regular file or cannot be read.
pub fn read_bytes(path: &Path) -> Result<Vec<u8>> {
    read_regular(path).map_err(|source| failed("read", path, source))
}

/// Opens a regular file; pipes are refused, because opening them would block.
///
/// # Errors
///
/// If the path is not a regular file or cannot be opened.
pub fn open_regular(path: &Path) -> io::Result<File> {
    match fs::metadata(path)?.is_file() {
        true => File::open(path),
        false => Err(io::Error::other("not a regular file")),
    }
}

/// Reads the bytes of a regular file.
///
/// # Errors
///
/// If the path is not a regular file or cannot be read.
pub fn read_regular(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open_regular(path)?.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Fingerprint of a file's content: 64-bit FNV-1a.
///
/// # Errors
///
/// [`Error`](crate::Error) if the path is not a regular file or cannot be read.
///
/// # References
///
/// Fowler, Noll & Vo, "The FNV Non-Cryptographic Hash Algorithm".
pub fn fingerprint(path: &Path) -> Result<String> {
    let io = |source| failed("read", path, source);
    let mut file = open_regular(path).map_err(io)?;
    let mut piece = vec![0; 1 << 20];
    let mut hash: u64 = 0xcbf2_9ce4_8422_2325;
    loop {
        let length = file.read(&mut piece).map_err(io)?;
        if length == 0 {
            return Ok(format!("{hash:016x}"));
        }
        for &byte in &piece[..length] {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_files_and_devices_are_refused() {
        let path = Path::new("/dev/zero");
        if path.exists() {
            for refused in [read_text(path).map(drop), fingerprint(path).map(drop)] {
                let refused = refused.unwrap_err().to_string();
                assert!(refused.contains("not a regular file"), "{refused}");
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
