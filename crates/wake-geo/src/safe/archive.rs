//! Files of a product: a `.SAFE` folder, or a `.zip` of one.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use zip::{CompressionMethod, ZipArchive};

use crate::error::{Error, Result};
use crate::limits::{ARCHIVE_FILES, XML_BYTES};
use crate::read_at::{ReadAt, Section};
use whole_files::sentence;

/// Files of a product, identified by their paths below the `.SAFE` folder, with `/` between folders.
#[derive(Debug)]
pub(crate) struct Archive {
    path: PathBuf,
    names: Vec<String>,
    kind: Kind,
}

#[derive(Debug)]
enum Kind {
    Folder,
    /// Path before each name in the archive: `NAME.SAFE/`, or nothing.
    Zip {
        prefix: String,
    },
}

const FOLDERS: [&str; 3] = ["annotation", "annotation/calibration", "measurement"];

impl Archive {
    /// Lists the files of a folder or a `.zip`.
    pub(crate) fn open(path: &Path) -> Result<Self> {
        match path.is_dir() {
            true => Self::open_folder(path),
            false => Self::open_zip(path),
        }
    }

    fn open_folder(path: &Path) -> Result<Self> {
        let mut names = Vec::new();
        for folder in FOLDERS {
            let entries = match fs::read_dir(path.join(folder)) {
                Ok(entries) => entries,
                Err(e) if e.kind() == io::ErrorKind::NotFound => continue,
                Err(e) => return Err(Error::io(&path.join(folder), e)),
            };
            for entry in entries {
                let name = entry.map_err(|e| Error::io(path, e))?.file_name();
                names.extend(name.to_str().map(|name| format!("{folder}/{name}")));
                check_count(path, names.len())?;
            }
        }
        if path.join("manifest.safe").is_file() {
            names.push("manifest.safe".to_owned());
        }
        names.sort();
        Ok(Self {
            path: path.to_owned(),
            names,
            kind: Kind::Folder,
        })
    }

    fn open_zip(path: &Path) -> Result<Self> {
        let archive = zip_at(path)?;
        check_count(path, archive.len())?;
        let all: Vec<String> = archive
            .file_names()
            .filter_map(|name| name.ok().map(|name| name.into_owned()))
            .collect();
        let in_annotation = all.iter().find_map(|name| {
            let (before, _) = name.split_once("annotation/")?;
            (before.is_empty() || before.ends_with('/')).then(|| before.to_owned())
        });
        let prefix = in_annotation.unwrap_or_default();
        let mut names: Vec<String> = all
            .iter()
            .filter_map(|name| name.strip_prefix(&prefix))
            .map(str::to_owned)
            .collect();
        names.sort();
        Ok(Self {
            path: path.to_owned(),
            names,
            kind: Kind::Zip { prefix },
        })
    }

    /// Path of the product.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Names of the files in a folder, such as `annotation`, without its subfolders.
    pub(crate) fn names_in<'a>(&'a self, folder: &'a str) -> impl Iterator<Item = &'a str> {
        self.names.iter().filter_map(move |name| {
            let name = name.strip_prefix(folder)?.strip_prefix('/')?;
            (!name.contains('/') && !name.is_empty()).then_some(name)
        })
    }

    /// Name of the `.SAFE` folder; empty for a `.zip` without one.
    pub(crate) fn folder_name(&self) -> &str {
        match &self.kind {
            Kind::Folder => self.path.file_name().and_then(|n| n.to_str()).unwrap_or(""),
            Kind::Zip { prefix } => prefix.trim_end_matches('/'),
        }
    }

    pub(crate) fn has(&self, name: &str) -> bool {
        self.names
            .binary_search_by(|n| n.as_str().cmp(name))
            .is_ok()
    }

    /// Text of an XML file, within the size limit.
    pub(crate) fn text(&self, name: &str) -> Result<String> {
        if !self.has(name) {
            return Err(Error::Missing {
                path: self.path.clone(),
                name: name.to_owned(),
            });
        }
        let mut bytes = Vec::new();
        match &self.kind {
            Kind::Folder => {
                let path = self.path.join(name);
                let file = whole_files::open_regular(&path).map_err(|e| Error::io(&path, e))?;
                let mut file = file.take(XML_BYTES + 1);
                file.read_to_end(&mut bytes)
                    .map_err(|e| Error::io(&path, e))?;
            }
            Kind::Zip { prefix } => {
                let mut archive = zip_at(&self.path)?;
                let entry = archive.by_name(&format!("{prefix}{name}"));
                let entry = entry.map_err(|e| damaged_entry(name, &e))?;
                // The declared size may be wrong, so the bytes are counted while reading.
                let mut entry = entry.take(XML_BYTES + 1);
                entry
                    .read_to_end(&mut bytes)
                    .map_err(|e| damaged_entry(name, &e))?;
            }
        }
        check_size(name, bytes.len() as u64, XML_BYTES)?;
        String::from_utf8(bytes).map_err(|e| {
            Error::damaged(
                name,
                format!("byte {} is not UTF-8", e.utf8_error().valid_up_to()),
            )
        })
    }

    /// Opens a file of pixels of at most `most` bytes. A compressed file in a `.zip` is unpacked into a temporary
    /// file, which the system removes once it is closed.
    pub(crate) fn pixels(&self, name: &str, most: u64) -> Result<Arc<dyn ReadAt>> {
        let Kind::Zip { prefix } = &self.kind else {
            let path = self.path.join(name);
            let file = whole_files::open_regular(&path).map_err(|e| Error::io(&path, e))?;
            return Ok(Arc::new(file));
        };
        let mut archive = zip_at(&self.path)?;
        let entry = archive.by_name(&format!("{prefix}{name}"));
        let entry = entry.map_err(|e| damaged_entry(name, &e))?;
        let size = entry.size();
        check_size(name, size, most)?;
        let start = entry.data_start();
        if let (CompressionMethod::Stored, false, Some(start)) =
            (entry.compression(), entry.encrypted(), start)
        {
            drop(entry);
            let file =
                whole_files::open_regular(&self.path).map_err(|e| Error::io(&self.path, e))?;
            return Ok(Arc::new(Section { file, start, size }));
        }
        let folder = std::env::temp_dir();
        let mut file = tempfile::tempfile().map_err(|e| Error::io(&folder, e))?;
        let mut entry = entry.take(size.saturating_add(1));
        let written = io::copy(&mut entry, &mut file).map_err(|e| damaged_entry(name, &e))?;
        if written != size {
            return Err(Error::damaged(
                name,
                format!("it does not unpack to its declared {size} bytes"),
            ));
        }
        Ok(Arc::new(file))
    }
}

fn zip_at(path: &Path) -> Result<ZipArchive<File>> {
    let file = whole_files::open_regular(path).map_err(|e| Error::io(path, e))?;
    ZipArchive::new(file)
        .map_err(|e| Error::unreadable(path, format!("it is not a readable zip archive: {e}")))
}

fn check_count(path: &Path, count: usize) -> Result<()> {
    match count <= ARCHIVE_FILES {
        true => Ok(()),
        false => Err(Error::TooLarge {
            file: sentence(&path.to_string_lossy()),
            what: "the number of files",
            value: count as u64,
            limit: ARCHIVE_FILES as u64,
            remedy: "give one product only",
        }),
    }
}

fn check_size(name: &str, value: u64, limit: u64) -> Result<()> {
    match value <= limit {
        true => Ok(()),
        false => Err(Error::TooLarge {
            file: name.to_owned(),
            what: "the size in bytes (counted up to the limit)",
            value,
            limit,
            remedy: "no Sentinel-1 product needs more: download the product again",
        }),
    }
}

fn damaged_entry(name: &str, error: &dyn std::fmt::Display) -> Error {
    Error::damaged(name, sentence(&format!("it cannot be unpacked ({error})")))
}
