//! Output files of a simulation, written atomically.

use crate::error::{Error, Result};
use crate::raster::Field;
#[cfg(feature = "png")]
use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
use num_complex::Complex32;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
#[cfg(feature = "png")]
use whole_files::write_atomically;
use whole_files::write_with;

/// Numbers converted to bytes at once.
const PIECE: usize = 1 << 16;

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
/// [`Error::File`] if the file cannot be written.
///
/// # Panics
///
/// If the number of pixels is not rows × columns.
#[cfg(feature = "png")]
pub fn write_png(path: &Path, pixels: &[u8], rows: usize, columns: usize) -> Result<()> {
    Ok(write_atomically(
        path,
        &encode_png(path, pixels, rows, columns)?,
    )?)
}

/// Encodes an 8-bit grey PNG as [`write_png`] does.
///
/// - `path`: used in the error message
///
/// # Errors
///
/// [`Error::File`] if the encoding fails.
///
/// # Panics
///
/// If the number of pixels is not rows × columns.
#[cfg(feature = "png")]
pub fn encode_png(path: &Path, pixels: &[u8], rows: usize, columns: usize) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes)
        .write_image(pixels, columns as u32, rows as u32, ExtendedColorType::L8)
        .map_err(|e| file_error("encode", path, &e))?;
    Ok(bytes)
}

/// Writes fields as `f32` tensors `[rows, columns]` of a safetensors file, and a complex image as `[rows, columns, 2]`, row
/// by row, without copying whole fields.
///
/// # Errors
///
/// [`Error::File`] if the file cannot be written.
pub fn write_fields(
    path: &Path,
    fields: &[(&str, &Field)],
    slc: Option<(&[Complex32], [usize; 2])>,
) -> Result<()> {
    let mut tensors: Vec<Tensor<'_>> = fields
        .iter()
        .map(|&(name, f)| Tensor::of(name, f))
        .collect();
    tensors.extend(slc.map(|(values, [rows, columns])| Tensor {
        name: "slc",
        shape: vec![rows, columns, 2],
        values: Values::Complex(values),
    }));
    tensors.sort_by_key(|tensor| tensor.name);
    let mut header = BTreeMap::new();
    let mut start = 0;
    for tensor in &tensors {
        let end = start + 4 * tensor.shape.iter().product::<usize>();
        let place = Place {
            dtype: "F32",
            shape: &tensor.shape,
            data_offsets: [start, end],
        };
        header.insert(tensor.name, place);
        start = end;
    }
    let mut header = serde_json::to_vec(&header).map_err(|e| file_error("encode", path, &e))?;
    // The data begin at a multiple of eight bytes.
    header.resize(header.len().next_multiple_of(8), b' ');
    let write = |file: &mut BufWriter<File>| {
        file.write_all(&(header.len() as u64).to_le_bytes())?;
        file.write_all(&header)?;
        tensors.iter().try_for_each(|tensor| tensor.write(file))
    };
    write_with(path, write).map_err(|e| file_error("write", path, &e))
}

/// Header entry of a tensor in a safetensors file.
#[derive(Serialize)]
struct Place<'a> {
    dtype: &'static str,
    shape: &'a [usize],
    data_offsets: [usize; 2],
}

/// One tensor of a safetensors file.
struct Tensor<'a> {
    name: &'a str,
    shape: Vec<usize>,
    values: Values<'a>,
}

/// Values of a tensor.
enum Values<'a> {
    Real(&'a [f32]),
    Complex(&'a [Complex32]),
}

impl<'a> Tensor<'a> {
    fn of(name: &'a str, field: &'a Field) -> Self {
        Self {
            name,
            shape: vec![field.rows, field.columns],
            values: Values::Real(&field.values),
        }
    }

    fn write(&self, file: &mut impl Write) -> std::io::Result<()> {
        let mut bytes = Vec::with_capacity(4 * PIECE);
        let mut piece = |values: &mut dyn Iterator<Item = f32>| {
            bytes.clear();
            bytes.extend(values.flat_map(f32::to_le_bytes));
            file.write_all(&bytes)
        };
        match self.values {
            Values::Real(values) => values
                .chunks(PIECE)
                .try_for_each(|values| piece(&mut values.iter().copied())),
            Values::Complex(values) => values
                .chunks(PIECE / 2)
                .try_for_each(|values| piece(&mut values.iter().flat_map(|v| [v.re, v.im]))),
        }
    }
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
        // Byte for byte as written by the library itself.
        let views: Vec<_> = file.iter().collect();
        assert_eq!(safetensors::serialize(views, None).unwrap(), bytes);
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

    #[cfg(feature = "png")]
    #[test]
    fn pictures_are_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("image.png");
        write_png(&path, &[0, 50, 100, 150, 200, 250], 2, 3).unwrap();
        let picture = image::open(&path).unwrap().into_luma8();
        assert_eq!((picture.width(), picture.height()), (3, 2));
        assert_eq!(picture.get_pixel(1, 1).0, [200]);
    }
}
