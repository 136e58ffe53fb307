//! Byte sources that many threads can read at once, at any position.

use std::fmt::Debug;
use std::fs::File;
use std::io::{self, ErrorKind, Read, Seek, SeekFrom};
use std::sync::Arc;

/// Bytes of a file or of a part of it.
pub(crate) trait ReadAt: Debug + Send + Sync {
    /// Reads bytes from a position, at most as many as `buffer` holds; returns their number.
    fn read_at(&self, at: u64, buffer: &mut [u8]) -> io::Result<usize>;

    /// Number of bytes.
    fn size(&self) -> io::Result<u64>;

    /// Fills `buffer` from a position.
    fn read_exact_at(&self, mut at: u64, mut buffer: &mut [u8]) -> io::Result<()> {
        while !buffer.is_empty() {
            match self.read_at(at, buffer) {
                Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
                Ok(read) => {
                    buffer = &mut buffer[read..];
                    at += read as u64;
                }
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) => return Err(e),
            }
        }
        Ok(())
    }
}

impl ReadAt for File {
    #[cfg(unix)]
    fn read_at(&self, at: u64, buffer: &mut [u8]) -> io::Result<usize> {
        std::os::unix::fs::FileExt::read_at(self, buffer, at)
    }

    #[cfg(windows)]
    fn read_at(&self, at: u64, buffer: &mut [u8]) -> io::Result<usize> {
        std::os::windows::fs::FileExt::seek_read(self, buffer, at)
    }

    fn size(&self) -> io::Result<u64> {
        Ok(self.metadata()?.len())
    }
}

/// Part of a file, read like a file of its own.
#[derive(Debug)]
pub(crate) struct Section {
    pub(crate) file: File,
    pub(crate) start: u64,
    pub(crate) size: u64,
}

impl ReadAt for Section {
    fn read_at(&self, at: u64, buffer: &mut [u8]) -> io::Result<usize> {
        let left = self.size.saturating_sub(at).min(buffer.len() as u64) as usize;
        let from = self.start.checked_add(at).ok_or(ErrorKind::UnexpectedEof)?;
        self.file.read_at(from, &mut buffer[..left])
    }

    fn size(&self) -> io::Result<u64> {
        Ok(self.size)
    }
}

/// Sequential reader of a source, with its own position.
#[derive(Debug)]
pub(crate) struct Reader {
    source: Arc<dyn ReadAt>,
    at: u64,
}

impl Reader {
    pub(crate) fn new(source: Arc<dyn ReadAt>) -> Self {
        Self { source, at: 0 }
    }
}

impl Read for Reader {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.source.read_at(self.at, buffer)?;
        self.at += read as u64;
        Ok(read)
    }
}

impl Seek for Reader {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let at = match to {
            SeekFrom::Start(at) => Some(at),
            SeekFrom::Current(by) => self.at.checked_add_signed(by),
            SeekFrom::End(by) => self.source.size()?.checked_add_signed(by),
        };
        // Systems count file positions as signed numbers.
        let at = at.filter(|&at| i64::try_from(at).is_ok());
        self.at = at.ok_or(ErrorKind::InvalidInput)?;
        Ok(self.at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_section_ends_where_it_ends() {
        let mut file = tempfile::tempfile().expect("a file");
        io::Write::write_all(&mut file, b"0123456789").expect("bytes");
        let section = Section {
            file,
            start: 2,
            size: 5,
        };
        let mut reader = Reader::new(Arc::new(section));
        let mut text = String::new();
        reader.read_to_string(&mut text).expect("text");
        assert_eq!(text, "23456");
        assert_eq!(reader.seek(SeekFrom::End(-2)).expect("inside"), 3);
        text.clear();
        reader.read_to_string(&mut text).expect("text");
        assert_eq!(text, "56");
        assert!(reader.seek(SeekFrom::Start(u64::MAX)).is_err());
        assert!(reader.seek(SeekFrom::Current(-100)).is_err());
        let mut two = [0; 2];
        assert!(reader.source.read_exact_at(4, &mut two).is_err());
    }
}
