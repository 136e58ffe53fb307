//! The images of files and folders.

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

/// Endings of files that are read.
const ENDINGS: [&str; 5] = ["png", "jpg", "jpeg", "tif", "tiff"];

/// The images that a list of files and folders names, in order; those of a folder by name. Files are not opened.
///
/// # Errors
///
/// [`Error::NoImages`] for a folder without any, [`Error::SameName`] for two files of one name, and [`Error::Io`].
pub fn image_files(paths: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for path in paths {
        match path.is_dir() {
            true => files.extend(of_folder(path)?),
            false => files.push(path.clone()),
        }
    }
    let mut names: Vec<_> = files.iter().map(|file| file.file_name()).collect();
    names.sort();
    match names.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => Err(Error::SameName {
            name: pair[0].unwrap_or_default().to_string_lossy().into_owned(),
        }),
        None => Ok(files),
    }
}

fn of_folder(folder: &Path) -> Result<Vec<PathBuf>> {
    let unreadable = |source| Error::Io {
        path: folder.to_owned(),
        source,
    };
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(unreadable)? {
        let file = entry.map_err(unreadable)?.path();
        let ending = file.extension().unwrap_or_default().to_string_lossy();
        if ENDINGS.contains(&ending.to_lowercase().as_str()) {
            found.push(file);
        }
    }
    if found.is_empty() {
        return Err(Error::NoImages {
            folder: folder.to_owned(),
        });
    }
    found.sort();
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_are_read_by_name_and_names_are_told_apart() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let other = path("other");
        std::fs::create_dir(&other).unwrap();
        let alone = image_files(std::slice::from_ref(&other)).unwrap_err();
        assert!(matches!(alone, Error::NoImages { .. }), "{alone}");
        for name in ["b.TIF", "a.png", "notes.txt", "other/c.png"] {
            std::fs::write(path(name), "").unwrap();
        }
        let given = [other.clone(), folder.path().to_owned()];
        let expected = [path("other/c.png"), path("a.png"), path("b.TIF")];
        assert_eq!(image_files(&given).unwrap(), expected);
        let twice = [path("other/c.png"), other];
        let refused = image_files(&twice).unwrap_err();
        assert!(matches!(refused, Error::SameName { name } if name == "c.png"));
    }
}
