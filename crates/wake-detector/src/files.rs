//! Image files in lists and folders, and the names of their results.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

/// Extensions of image files.
const ENDINGS: [&str; 5] = ["png", "jpg", "jpeg", "tif", "tiff"];
/// Suffix of pictures of wakes, after the name of the image.
const PICTURE: &str = ".wakes.png";

/// Name of an image in results, unique among [`image_files`]: its file name, with bytes that are not UTF-8 as `\xFF`.
#[must_use]
pub fn image_name(image: &Path) -> String {
    let name = image.file_name().unwrap_or_default().as_encoded_bytes();
    let mut told = String::new();
    for chunk in name.utf8_chunks() {
        told.push_str(chunk.valid());
        for byte in chunk.invalid() {
            told.push_str(&format!("\\x{byte:02X}"));
        }
    }
    told
}

/// File name of the picture of an image's wakes: the image's full name and `.wakes.png`, so `a.png` and `a.tif` do not collide.
#[must_use]
pub fn picture_name(image: &Path) -> OsString {
    let mut name = image.file_name().unwrap_or_default().to_owned();
    name.push(PICTURE);
    name
}

/// Lists the images of files and folders, in order, without opening them.
///
/// The images of a folder are its PNG, JPEG and TIFF files sorted by name, except pictures of wakes ([`picture_name`]).
///
/// # Errors
///
/// [`Error::NoImages`] for a folder without images, [`Error::SameName`] for two files with one [`image_name`], and [`Error::Io`].
pub fn image_files(paths: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for path in paths {
        match path.is_dir() {
            true => files.extend(of_folder(path)?),
            false => files.push(path.clone()),
        }
    }
    let mut names: Vec<String> = files.iter().map(|file| image_name(file)).collect();
    names.sort();
    match names.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => Err(Error::SameName {
            name: pair[0].clone(),
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
        let name = file.file_name().unwrap_or_default().as_encoded_bytes();
        if ENDINGS.contains(&ending.to_lowercase().as_str())
            && !name.ends_with(PICTURE.as_bytes())
            && !file.is_dir()
        {
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

    #[test]
    fn pictures_of_wakes_and_folders_are_no_images_of_a_folder() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::create_dir(path("b.png")).unwrap();
        std::fs::write(path("a.png"), "").unwrap();
        let picture = folder.path().join(picture_name(&path("a.png")));
        std::fs::write(&picture, "").unwrap();
        let found = image_files(&[folder.path().to_owned()]).unwrap();
        assert_eq!(found, [path("a.png")]);
        // A picture that is named explicitly is searched.
        assert_eq!(
            image_files(std::slice::from_ref(&picture)).unwrap(),
            [picture]
        );
        assert_ne!(picture_name(&path("a.png")), picture_name(&path("a.tif")));
    }

    #[cfg(unix)]
    #[test]
    fn names_that_are_no_utf8_are_told_apart() {
        use std::ffi::OsStr;
        use std::os::unix::ffi::OsStrExt;
        let file = |name: &[u8]| PathBuf::from(OsStr::from_bytes(name));
        let [one, other] = [b"a\xFF.png", b"a\xFE.png"].map(|name| file(name));
        assert_eq!(image_name(&one), r"a\xFF.png");
        assert_ne!(image_name(&one), image_name(&other));
        assert_ne!(picture_name(&one), picture_name(&other));
        assert!(image_files(&[one.clone(), other]).is_ok());
        let spelt = PathBuf::from(r"a\xFF.png");
        assert!(matches!(
            image_files(&[one, spelt]),
            Err(Error::SameName { .. })
        ));
    }
}
