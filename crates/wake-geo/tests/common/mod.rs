//! Fixtures of the tests.

#![allow(dead_code, reason = "each test file uses a part")]

pub(crate) mod synthetic;

use std::fs;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use tempfile::TempDir;

/// Before and after the change of the noise format.
pub(crate) const PRODUCTS: [&str; 2] = [
    "S1A_IW_GRDH_1SDV_20150222T170750_20150222T170815_004739_005DD8_3768",
    "S1A_IW_GRDH_1SDV_20210119T031653_20210119T031718_036201_043ED0_8255",
];

pub(crate) fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures")
}

/// Path of a product as it lies here, packed.
pub(crate) fn packed(product: &str) -> PathBuf {
    fixtures().join(product).with_extension("zip")
}

/// Names and contents of the files of a product.
pub(crate) fn files(product: &str) -> Vec<(String, Vec<u8>)> {
    let file = fs::File::open(packed(product)).expect("a fixture");
    let mut archive = zip::ZipArchive::new(file).expect("an archive");
    let count = archive.len();
    let read = |index| {
        let mut entry = archive.by_index(index).expect("an entry");
        let mut bytes = Vec::new();
        entry.read_to_end(&mut bytes).expect("its bytes");
        let name = entry.name().expect("a name").into_owned();
        let (_, name) = name.split_once('/').expect("a folder");
        (name.to_owned(), bytes)
    };
    (0..count).map(read).collect()
}

/// A `.SAFE` folder of these files, below a temporary folder.
pub(crate) fn folder_of(product: &str, files: &[(String, Vec<u8>)]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let safe = folder.path().join(format!("{product}.SAFE"));
    for (name, bytes) in files {
        write(&safe.join(name), bytes);
    }
    (folder, safe)
}

pub(crate) fn write(path: &Path, bytes: &[u8]) {
    fs::create_dir_all(path.parent().expect("a parent")).expect("a folder");
    fs::write(path, bytes).expect("a file");
}

/// A `.zip` of files below one folder.
pub(crate) fn zip_of(
    path: &Path,
    folder: &str,
    files: &[(String, Vec<u8>)],
    method: zip::CompressionMethod,
) {
    let mut archive = zip::ZipWriter::new(fs::File::create(path).expect("a file"));
    let options = zip::write::SimpleFileOptions::default().compression_method(method);
    for (name, bytes) in files {
        archive
            .start_file(format!("{folder}/{name}"), options)
            .expect("an entry");
        archive.write_all(bytes).expect("its bytes");
    }
    archive.finish().expect("an archive");
}
