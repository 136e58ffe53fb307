//! Files of a simulation, each written whole or not at all.

use crate::error::{Error, Result};
use crate::raster::Field;
use num_complex::Complex32;
use safetensors::tensor::{Dtype, TensorView};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Makes a folder and the folders above it, and checks that files can be written there.
///
/// # Errors
///
/// [`Error::File`] if it cannot be made or written to.
pub fn make_folder(folder: &Path) -> Result<()> {
    let fail = |e: std::io::Error| file_error("write to the folder", folder, &e);
    std::fs::create_dir_all(folder).map_err(fail)?;
    let probe = temporary(&folder.join("probe"));
    std::fs::write(&probe, []).map_err(fail)?;
    std::fs::remove_file(&probe).map_err(fail)
}

/// Writes bytes to a temporary neighbour and renames it: the file is whole, or as it was before.
///
/// # Errors
///
/// [`Error::File`]; the neighbour is removed.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    let neighbour = temporary(path);
    std::fs::write(&neighbour, bytes)
        .and_then(|()| std::fs::rename(&neighbour, path))
        .map_err(|e| {
            let _ = std::fs::remove_file(&neighbour);
            file_error("write", path, &e)
        })
}

fn temporary(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.{}.tmp", std::process::id()))
}

fn file_error(action: &'static str, path: &Path, error: &dyn std::fmt::Display) -> Error {
    Error::File {
        action,
        path: path.to_owned(),
        message: error.to_string(),
    }
}

/// Writes an 8-bit grey PNG.
///
/// # Shapes
///
/// `pixels`: `[rows, columns]`, row after row.
///
/// # Errors
///
/// [`Error::File`].
///
/// # Panics
///
/// If there are not rows × columns pixels.
pub fn write_png(path: &Path, pixels: &[u8], rows: usize, columns: usize) -> Result<()> {
    let mut bytes = Vec::new();
    let encoder = image::codecs::png::PngEncoder::new(&mut bytes);
    image::ImageEncoder::write_image(
        encoder,
        pixels,
        columns as u32,
        rows as u32,
        image::ExtendedColorType::L8,
    )
    .map_err(|e| file_error("encode", path, &e))?;
    write_atomically(path, &bytes)
}

/// Writes fields as `f32` tensors `[rows, columns]` of a safetensors file.
///
/// # Errors
///
/// [`Error::File`].
pub fn write_fields(
    path: &Path,
    fields: &[(&str, &Field)],
    slc: Option<(&[Complex32], [usize; 2])>,
) -> Result<()> {
    let complex: Vec<u8> = slc.map_or_else(Vec::new, |(values, _)| {
        let parts = values.iter().flat_map(|v| [v.re, v.im]);
        parts.flat_map(f32::to_le_bytes).collect()
    });
    let bytes: Vec<Vec<u8>> = fields
        .iter()
        .map(|(_, f)| f.values.iter().flat_map(|v| v.to_le_bytes()).collect())
        .collect();
    let views = fields.iter().zip(&bytes).map(|((name, field), data)| {
        let shape = vec![field.rows, field.columns];
        TensorView::new(Dtype::F32, shape, data).map(|view| (*name, view))
    });
    let slc = slc.map(|(_, [rows, columns])| {
        TensorView::new(Dtype::F32, vec![rows, columns, 2], &complex).map(|view| ("slc", view))
    });
    let views: Vec<_> = views
        .chain(slc)
        .collect::<std::result::Result<_, _>>()
        .map_err(|e| file_error("encode", path, &e))?;
    let file = safetensors::serialize(views, None).map_err(|e| file_error("encode", path, &e))?;
    write_atomically(path, &file)
}

/// Writes a value as indented JSON.
///
/// # Errors
///
/// [`Error::File`].
pub fn write_json(path: &Path, value: &impl Serialize) -> Result<()> {
    let mut text =
        serde_json::to_string_pretty(value).map_err(|e| file_error("encode", path, &e))?;
    text.push('\n');
    write_atomically(path, text.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::Raster;

    #[test]
    fn fields_are_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("fields.safetensors");
        let field = Field::from_fn(&Raster::image(2, 3, 1.0), |i, j| (i * 3 + j) as f32);
        let slc: Vec<Complex32> = (0..6u8).map(|n| Complex32::new(n.into(), -1.0)).collect();
        write_fields(&path, &[("elevation", &field)], Some((&slc, [2, 3]))).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let file = safetensors::SafeTensors::deserialize(&bytes).unwrap();
        let tensor = file.tensor("elevation").unwrap();
        assert_eq!(tensor.shape(), [2, 3]);
        let expected: Vec<u8> = (0..6u8).flat_map(|v| f32::from(v).to_le_bytes()).collect();
        assert_eq!(tensor.data(), expected);
        let tensor = file.tensor("slc").unwrap();
        assert_eq!(tensor.shape(), [2, 3, 2]);
        let pairs = (0..6u8).flat_map(|v| [f32::from(v), -1.0]);
        let expected: Vec<u8> = pairs.flat_map(f32::to_le_bytes).collect();
        assert_eq!(tensor.data(), expected);
    }

    #[test]
    fn pictures_are_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("image.png");
        write_png(&path, &[0, 50, 100, 150, 200, 250], 2, 3).unwrap();
        let picture = image::open(&path).unwrap().into_luma8();
        assert_eq!((picture.width(), picture.height()), (3, 2));
        assert_eq!(picture.get_pixel(1, 1).0, [200]);
    }

    #[test]
    fn failures_name_the_path_and_leave_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        std::fs::write(&file, "here").unwrap();
        for result in [
            make_folder(&file.join("below")),
            write_atomically(&file.join("below/x"), b"x"),
            write_png(&folder.path().join("no/bad.png"), &[0; 6], 2, 3),
        ] {
            let message = result.unwrap_err().to_string();
            assert!(message.starts_with("cannot "), "{message}");
        }
        assert_eq!(std::fs::read_to_string(&file).unwrap(), "here");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
