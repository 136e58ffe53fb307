//! Export of fields: `NumPy` arrays, TIFF with the pixel size, and images and arrays of other crates.
//!
//! With the feature `png`:
//!
#![cfg_attr(feature = "png", doc = "```")]
#![cfg_attr(not(feature = "png"), doc = "```ignore")]
//! use wake_physics::{Field, Raster};
//!
//! let field = Field::from_fn(&Raster::image(2, 3, 1.0), |row, column| (10 * row + column) as f32);
//! let image = image::ImageBuffer::from(field.clone());
//! assert_eq!(image.get_pixel(2, 1).0, [12.0]); // (column, row)
//! assert_eq!(Field::from(image), field);
//! ```

use crate::error::Result;
use crate::raster::Field;
#[cfg(feature = "png")]
use image::{ImageBuffer, Luma};
use std::path::Path;
use whole_files::write_atomically;

/// Alignment of the data after the header of a `NumPy` file \[bytes\].
const NPY_ALIGNMENT: usize = 64;

/// Writes a field as a `NumPy` array of `float32`, `[rows, columns]`, in format 1.0 (read by `numpy.load`).
///
/// # Errors
///
/// [`Error::File`](crate::Error::File) if the file cannot be written.
pub fn write_npy(path: &Path, field: &Field) -> Result<()> {
    Ok(write_atomically(path, &npy(field))?)
}

fn npy(field: &Field) -> Vec<u8> {
    let (rows, columns) = (field.rows, field.columns);
    let header =
        format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({rows}, {columns}), }}");
    // Magic string, version and length take ten bytes, the final line feed one.
    let length = (10 + header.len() + 1).next_multiple_of(NPY_ALIGNMENT) - 10;
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((length as u16).to_le_bytes());
    bytes.extend(format!("{header:<width$}\n", width = length - 1).into_bytes());
    bytes.extend(field.values.iter().flat_map(|value| value.to_le_bytes()));
    bytes
}

/// Writes a field as a TIFF of 32-bit floats with the tags of GeoTIFF 1.1: pixel size and position of the first pixel, in
/// metres of x and y, in a plane without a location on Earth.
///
/// # Errors
///
/// [`Error::File`](crate::Error::File) if the file cannot be written or the field has no pixels.
///
/// # Panics
///
/// If field and raster differ in size.
#[cfg(feature = "tiff")]
pub fn write_tiff(path: &Path, raster: &crate::Raster, field: &Field) -> Result<()> {
    assert!(
        (field.rows, field.columns) == (raster.rows, raster.columns),
        "the field has {} x {} pixels, but the raster has {} x {}",
        field.rows,
        field.columns,
        raster.rows,
        raster.columns
    );
    let bytes = tiff_of(raster, field).map_err(|e| crate::Error::File {
        action: "encode",
        path: path.to_owned(),
        message: e.to_string(),
    })?;
    Ok(write_atomically(path, &bytes)?)
}

#[cfg(feature = "tiff")]
fn tiff_of(raster: &crate::Raster, field: &Field) -> tiff::TiffResult<Vec<u8>> {
    use tiff::encoder::{TiffEncoder, colortype::Gray32Float};
    use tiff::tags::Tag;
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut file = TiffEncoder::new(&mut bytes)?;
    let mut image = file.new_image::<Gray32Float>(field.columns as u32, field.rows as u32)?;
    let tags = image.encoder();
    tags.write_tag(
        Tag::ModelPixelScaleTag,
        &[raster.spacing, raster.spacing, 0.0][..],
    )?;
    let tie = [0.0, 0.0, 0.0, raster.x(0), raster.y(0), 0.0];
    tags.write_tag(Tag::ModelTiepointTag, &tie[..])?;
    // Version 1, revision 1.1, four keys: model type 32767 (user-defined), raster type 2 (a pixel is a point, so the tie
    // point is its centre), a citation of 24 characters, and linear unit 9001 (metre).
    let keys: [u16; 20] = [
        1, 1, 1, 4, 1024, 0, 1, 32767, 1025, 0, 1, 2, 1026, 34737, 24, 0, 3076, 0, 1, 9001,
    ];
    tags.write_tag(Tag::GeoKeyDirectoryTag, &keys[..])?;
    tags.write_tag(Tag::GeoAsciiParamsTag, "x ground range y azimuth|")?;
    image.write_data(&field.values)?;
    Ok(bytes.into_inner())
}

/// # Panics
///
/// If the number of values is not rows × columns.
#[cfg(feature = "png")]
impl From<Field> for ImageBuffer<Luma<f32>, Vec<f32>> {
    fn from(field: Field) -> Self {
        Self::from_raw(field.columns as u32, field.rows as u32, field.values)
            .expect("a field has rows × columns values")
    }
}

#[cfg(feature = "png")]
impl From<ImageBuffer<Luma<f32>, Vec<f32>>> for Field {
    fn from(image: ImageBuffer<Luma<f32>, Vec<f32>>) -> Self {
        Self {
            rows: image.height() as usize,
            columns: image.width() as usize,
            values: image.into_raw(),
        }
    }
}

/// Array of shape `[rows, columns]`.
///
/// # Panics
///
/// If the number of values is not rows × columns.
#[cfg(feature = "ndarray")]
impl From<Field> for ndarray::Array2<f32> {
    fn from(field: Field) -> Self {
        Self::from_shape_vec((field.rows, field.columns), field.values)
            .expect("a field has rows × columns values")
    }
}

/// Field from an array `[rows, columns]` of any memory layout.
#[cfg(feature = "ndarray")]
impl From<ndarray::ArrayView2<'_, f32>> for Field {
    fn from(array: ndarray::ArrayView2<'_, f32>) -> Self {
        let (rows, columns) = array.dim();
        Self {
            rows,
            columns,
            values: array.iter().copied().collect(),
        }
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "values that must be the same bits")]
mod tests {
    use super::*;
    use crate::raster::Raster;

    fn field() -> Field {
        Field::from_fn(&Raster::image(3, 5, 2.5), |i, j| {
            10.0 * i as f32 + j as f32 - 0.5
        })
    }

    /// Compares with the format's specification: magic string, version, header length, header, then the rows.
    #[test]
    fn a_numpy_file_is_as_the_format_says() {
        let bytes = npy(&field());
        assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00");
        let length = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        assert_eq!((10 + length) % 64, 0);
        let header = std::str::from_utf8(&bytes[10..10 + length]).unwrap();
        assert!(header.starts_with("{'descr': '<f4', 'fortran_order': False, 'shape': (3, 5), }"));
        assert!(header.ends_with(" \n"), "{header:?}");
        let data = &bytes[10 + length..];
        assert_eq!(data.len(), 4 * 15);
        assert_eq!(data[4 * 7..4 * 8], 11.5f32.to_le_bytes());
    }

    #[cfg(feature = "png")]
    #[test]
    fn images_have_columns_and_rows_where_fields_have_them() {
        let image = ImageBuffer::from(field());
        assert_eq!(image.dimensions(), (5, 3));
        assert_eq!(image.get_pixel(4, 1).0, [field().at(1, 4)]);
        assert_eq!(Field::from(image), field());
    }

    #[cfg(feature = "ndarray")]
    #[test]
    fn arrays_are_read_in_their_own_order() {
        let array = ndarray::Array2::from(field());
        assert_eq!((array.dim(), array[[2, 1]]), ((3, 5), field().at(2, 1)));
        assert_eq!(Field::from(array.view()), field());
        // A transposed view has the same elements at transposed positions.
        let turned = Field::from(array.t());
        assert_eq!((turned.rows, turned.columns), (5, 3));
        assert_eq!(turned.at(1, 2), field().at(2, 1));
    }

    /// Values are read back by the decoder of the same crate; tags are looked up by their numbers in the standard.
    #[cfg(feature = "tiff")]
    #[test]
    fn a_tiff_has_values_and_the_size_of_a_pixel() {
        use tiff::tags::Tag;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("field.tif");
        let raster = Raster::image(3, 5, 2.5);
        write_tiff(&path, &raster, &field()).unwrap();
        let file = std::io::BufReader::new(std::fs::File::open(&path).unwrap());
        let mut decoder = tiff::decoder::Decoder::new(file).unwrap();
        assert_eq!(decoder.dimensions().unwrap(), (5, 3));
        let numbers = |decoder: &mut tiff::decoder::Decoder<_>, tag: u16| {
            decoder.get_tag_f64_vec(Tag::Unknown(tag)).unwrap()
        };
        assert_eq!(numbers(&mut decoder, 33550), [2.5, 2.5, 0.0]);
        // The first pixel is two columns left of the origin and one row above it.
        let tie = numbers(&mut decoder, 33922);
        assert_eq!(tie, [0.0, 0.0, 0.0, -5.0, 2.5, 0.0]);
        let tiff::decoder::DecodingResult::F32(values) = decoder.read_image().unwrap() else {
            panic!("no floats");
        };
        assert_eq!(values, field().values);
    }
}
