//! Writes GeoTIFF files strip by strip.

use std::io::{BufWriter, Seek, Write};
use std::ops::Range;
use std::path::Path;

use flate2::write::ZlibEncoder;
use tempfile::NamedTempFile;
use tiff::TiffResult;
use tiff::encoder::{DirectoryEncoder, TiffEncoder, TiffKind, TiffKindBig, TiffKindStandard};
use tiff::tags::Tag;

use super::keys;
use super::sample::SampleType;
use crate::error::{Error, Result};
use crate::geolocation::{Affine, GridPoint};
use crate::limits::{GRID_POINTS, IMAGE_PIXELS, IMAGE_SIDE};
use crate::projection::is_geographic;
use whole_files::sentence;

/// Sample type of a file to be written.
pub trait TiffSample: Copy + Default {
    /// Type of the sample.
    const TYPE: SampleType;
    /// Appends its bytes, little endian.
    fn append(self, bytes: &mut Vec<u8>);
}

macro_rules! sample {
    ($type:ty, $name:ident) => {
        impl TiffSample for $type {
            const TYPE: SampleType = SampleType::$name;

            fn append(self, bytes: &mut Vec<u8>) {
                bytes.extend(self.to_le_bytes());
            }
        }
    };
}

sample!(u8, U8);
sample!(u16, U16);
sample!(i16, I16);
sample!(f32, F32);

/// Compression of a file to be written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Compression {
    /// None.
    #[default]
    None,
    /// Deflate.
    Deflate,
}

/// Geolocation of a file to be written.
#[derive(Clone, Debug, PartialEq)]
pub enum Placement {
    /// None.
    None,
    /// Affine map from pixel centres to coordinates of an EPSG code.
    Affine {
        /// The map.
        affine: Affine,
        /// The EPSG code.
        epsg: u16,
    },
    /// Control points at pixel centres, in latitude and longitude on WGS84 (`RasterPixelIsPoint`).
    ControlPoints(Vec<GridPoint>),
}

/// Size and form of a file to be written.
#[derive(Clone, Debug, PartialEq)]
pub struct GeoTiffLayout {
    /// Number of lines.
    pub lines: usize,
    /// Number of pixels of a line.
    pub pixels: usize,
    /// Compression.
    pub compression: Compression,
    /// Geolocation.
    pub placement: Placement,
    /// Value that marks missing pixels.
    pub no_data: Option<f64>,
}

/// Size of a strip \[bytes\], rounded to whole lines.
const STRIP_BYTES: usize = 1 << 18;
/// Files with more bytes of pixels are `BigTIFF`: TIFF offsets have 32 bits, and directories need some space.
const BIG_TIFF: u64 = (1 << 32) - (1 << 27);

/// Writes a GeoTIFF in strips. `fill` writes the samples of the given lines, in order, into a buffer of zeros.
///
/// The file gets its name once it is complete. Files above 4 GB become `BigTIFF`.
///
/// # Errors
/// A size of 0 or beyond the limits, more than 200,000 control points, a file that cannot be written, or any error of
/// `fill`.
pub fn write_geotiff<T: TiffSample>(
    path: &Path,
    layout: &GeoTiffLayout,
    mut fill: impl FnMut(Range<usize>, &mut [T]) -> Result<()>,
) -> Result<()> {
    check(path, layout)?;
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new("."));
    let io = |e| Error::io(path, e);
    let mut file = NamedTempFile::new_in(folder).map_err(io)?;
    let bytes = layout.lines as u64 * layout.pixels as u64 * T::TYPE.bytes() as u64;
    let writer = BufWriter::with_capacity(1 << 20, file.as_file_mut());
    match bytes > BIG_TIFF {
        true => {
            write::<T, TiffKindBig, _>(path, TiffEncoder::new_big(writer), layout, &mut fill)?;
        }
        false => {
            write::<T, TiffKindStandard, _>(path, TiffEncoder::new(writer), layout, &mut fill)?;
        }
    }
    set_permissions(&file).map_err(io)?;
    file.persist(path).map_err(|e| io(e.error))?;
    Ok(())
}

/// Makes a file readable by others; temporary files are readable only by their owner.
fn set_permissions(file: &NamedTempFile) -> std::io::Result<()> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let readable = std::fs::Permissions::from_mode(0o644);
        file.as_file().set_permissions(readable)?;
    }
    let _ = file;
    Ok(())
}

fn check(path: &Path, layout: &GeoTiffLayout) -> Result<()> {
    let points = match &layout.placement {
        Placement::ControlPoints(points) => points.len(),
        _ => 0,
    };
    let why = if layout.lines == 0 || layout.pixels == 0 {
        "it has no pixels; give at least one line and one pixel".to_owned()
    } else if layout.lines.max(layout.pixels) > IMAGE_SIDE
        || layout.lines as u64 * layout.pixels as u64 > IMAGE_PIXELS
    {
        format!(
            "{} lines of {} pixels exceed the limit of {IMAGE_SIDE} per side and {IMAGE_PIXELS} in total; write a smaller image",
            layout.lines, layout.pixels
        )
    } else if points > GRID_POINTS {
        format!("{points} control points are above the limit {GRID_POINTS}; give fewer")
    } else {
        return Ok(());
    };
    Err(Error::Unwritable {
        path: path.to_owned(),
        why,
    })
}

fn write<T: TiffSample, K: TiffKind, W: Write + Seek>(
    path: &Path,
    encoder: TiffResult<TiffEncoder<W, K>>,
    layout: &GeoTiffLayout,
    fill: &mut impl FnMut(Range<usize>, &mut [T]) -> Result<()>,
) -> Result<()> {
    let failed = |e: tiff::TiffError| Error::Unwritable {
        path: path.to_owned(),
        why: sentence(&e.to_string()),
    };
    let mut encoder = encoder.map_err(failed)?;
    let mut directory = encoder.image_directory().map_err(failed)?;
    let line_bytes = layout.pixels * T::TYPE.bytes();
    let strip_lines = (STRIP_BYTES / line_bytes).clamp(1, layout.lines);
    let mut samples = Vec::new();
    let mut bytes = Vec::new();
    let (mut offsets, mut counts) = (Vec::new(), Vec::new());
    for first in (0..layout.lines).step_by(strip_lines) {
        let lines = first..(first + strip_lines).min(layout.lines);
        samples.clear();
        samples.resize(lines.len() * layout.pixels, T::default());
        fill(lines, &mut samples)?;
        bytes.clear();
        samples.iter().for_each(|sample| sample.append(&mut bytes));
        if layout.compression == Compression::Deflate {
            let mut deflate = ZlibEncoder::new(Vec::new(), flate2::Compression::default());
            let done = deflate.write_all(&bytes).and_then(|()| deflate.finish());
            bytes = done.map_err(|e| Error::io(path, e))?;
        }
        offsets.push(directory.write_data(bytes.as_slice()).map_err(failed)?);
        counts.push(bytes.len() as u64);
    }
    write_tags::<T, K, W>(&mut directory, layout, strip_lines).map_err(failed)?;
    write_places(&mut directory, &layout.placement).map_err(failed)?;
    write_offsets(&mut directory, &offsets, &counts).map_err(failed)?;
    directory.finish().map_err(failed)
}

fn write_tags<T: TiffSample, K: TiffKind, W: Write + Seek>(
    directory: &mut DirectoryEncoder<'_, W, K>,
    layout: &GeoTiffLayout,
    strip_lines: usize,
) -> TiffResult<()> {
    let format: u16 = match T::TYPE {
        SampleType::U8 | SampleType::U16 => 1,
        SampleType::I16 => 2,
        SampleType::F32 => 3,
    };
    let compression: u16 = match layout.compression {
        Compression::None => 1,
        Compression::Deflate => 8,
    };
    directory.write_tag(Tag::ImageWidth, u32::try_from(layout.pixels)?)?;
    directory.write_tag(Tag::ImageLength, u32::try_from(layout.lines)?)?;
    directory.write_tag(Tag::BitsPerSample, 8 * u16::try_from(T::TYPE.bytes())?)?;
    directory.write_tag(Tag::Compression, compression)?;
    directory.write_tag(Tag::PhotometricInterpretation, 1u16)?;
    directory.write_tag(Tag::SamplesPerPixel, 1u16)?;
    directory.write_tag(Tag::RowsPerStrip, u32::try_from(strip_lines)?)?;
    directory.write_tag(Tag::PlanarConfiguration, 1u16)?;
    directory.write_tag(Tag::SampleFormat, format)?;
    if let Some(value) = layout.no_data {
        directory.write_tag(
            Tag::from_u16_exhaustive(keys::NO_DATA),
            value.to_string().as_str(),
        )?;
    }
    Ok(())
}

fn write_places<K: TiffKind, W: Write + Seek>(
    directory: &mut DirectoryEncoder<'_, W, K>,
    placement: &Placement,
) -> TiffResult<()> {
    let (model, key, epsg) = match placement {
        Placement::None => return Ok(()),
        Placement::ControlPoints(_) => (keys::MODEL_GEOGRAPHIC, keys::GEOGRAPHIC, 4326),
        Placement::Affine { epsg, .. } if is_geographic(u32::from(*epsg)) => {
            (keys::MODEL_GEOGRAPHIC, keys::GEOGRAPHIC, *epsg)
        }
        Placement::Affine { epsg, .. } => (keys::MODEL_PROJECTED, keys::PROJECTED, *epsg),
    };
    let raster = match placement {
        Placement::ControlPoints(_) => keys::PIXEL_IS_POINT,
        _ => keys::PIXEL_IS_AREA,
    };
    match placement {
        Placement::ControlPoints(points) => {
            let numbers = points.iter().flat_map(|point| {
                let (place, height) = (point.place, point.place.height.unwrap_or(0.0));
                [
                    point.pixel,
                    point.line,
                    0.0,
                    place.longitude,
                    place.latitude,
                    height,
                ]
            });
            let numbers: Vec<f64> = numbers.collect();
            directory.write_tag(
                Tag::from_u16_exhaustive(keys::TIEPOINTS),
                numbers.as_slice(),
            )?;
        }
        Placement::Affine { affine, .. } => {
            let Affine { x, y } = affine.shifted(-0.5, -0.5);
            // Maps without rotation are written in the form that every reader supports.
            let upright = x[2].abs() + y[1].abs() <= 0.0 && x[1] > 0.0 && y[2] < 0.0;
            if upright {
                let scale: &[f64] = &[x[1], -y[2], 0.0];
                directory.write_tag(Tag::from_u16_exhaustive(keys::PIXEL_SCALE), scale)?;
                let tie: &[f64] = &[0.0, 0.0, 0.0, x[0], y[0], 0.0];
                directory.write_tag(Tag::from_u16_exhaustive(keys::TIEPOINTS), tie)?;
            } else {
                let matrix: &[f64] = &[
                    x[1], x[2], 0.0, x[0], y[1], y[2], 0.0, y[0], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
                    0.0, 1.0,
                ];
                directory.write_tag(Tag::from_u16_exhaustive(keys::TRANSFORMATION), matrix)?;
            }
        }
        Placement::None => {}
    }
    let table: &[u16] = &[
        1,
        1,
        0,
        3,
        keys::MODEL_TYPE,
        0,
        1,
        model,
        keys::RASTER_TYPE,
        0,
        1,
        raster,
        key,
        0,
        1,
        epsg,
    ];
    directory.write_tag(Tag::from_u16_exhaustive(keys::KEY_DIRECTORY), table)
}

fn write_offsets<K: TiffKind, W: Write + Seek>(
    directory: &mut DirectoryEncoder<'_, W, K>,
    offsets: &[u64],
    counts: &[u64],
) -> TiffResult<()> {
    let short: Result<Vec<u32>, _> = offsets
        .iter()
        .map(|&offset| u32::try_from(offset))
        .collect();
    let lengths: Result<Vec<u32>, _> = counts.iter().map(|&count| u32::try_from(count)).collect();
    match short {
        Ok(short) => directory.write_tag(Tag::StripOffsets, short.as_slice())?,
        Err(_) => directory.write_tag(Tag::StripOffsets, offsets)?,
    }
    directory.write_tag(Tag::StripByteCounts, lengths?.as_slice())
}
