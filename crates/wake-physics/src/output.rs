//! Files of a simulation, each written whole or not at all, and folders that belong to one process.
//!
//! A file is written under another name, `.NAME.PROCESS-NUMBER.tmp`, and locked while it is; then it takes its own name.
//! What a killed process left is not locked: the next run that makes or takes the folder removes it.

use crate::error::{Error, Result};
use crate::raster::Field;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use num_complex::Complex32;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fs::{File, TryLockError};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Numbers that are turned into bytes at once.
const PIECE: usize = 1 << 16;

/// Tells apart the files that one process writes at the same time.
static COUNTER: AtomicU64 = AtomicU64::new(0);

/// Makes a folder and the folders above it, checks that files can be written there, and [`sweep`]s it.
///
/// # Errors
///
/// [`Error::File`] if it cannot be made or written to.
pub fn make_folder(folder: &Path) -> Result<()> {
    let fail = |e: std::io::Error| file_error("write to the folder", folder, &e);
    std::fs::create_dir_all(folder).map_err(fail)?;
    let (probe, _lock) = temporary(&folder.join("probe")).map_err(fail)?;
    std::fs::remove_file(&probe).map_err(fail)?;
    sweep(folder)
}

/// A folder that only one process works in, until this is dropped.
#[derive(Debug)]
pub struct FolderLock {
    _folder: Option<File>,
}

/// Makes a folder, and takes it for this process alone.
///
/// Where the system cannot lock a folder nothing is locked.
///
/// # Errors
///
/// [`Error::File`] if another process has it, or as [`make_folder`].
pub fn lock_folder(folder: &Path) -> Result<FolderLock> {
    make_folder(folder)?;
    let Ok(handle) = File::open(folder) else {
        return Ok(FolderLock { _folder: None });
    };
    match handle.try_lock() {
        Ok(()) => Ok(FolderLock {
            _folder: Some(handle),
        }),
        Err(TryLockError::WouldBlock) => {
            let message = "another process works there; wait for it, or choose another folder";
            Err(file_error("take the folder", folder, &message))
        }
        Err(TryLockError::Error(_)) => Ok(FolderLock { _folder: None }),
    }
}

/// Removes what killed processes left half-written in a folder, and nothing that a living one writes.
///
/// # Errors
///
/// [`Error::File`] if the folder cannot be read.
pub fn sweep(folder: &Path) -> Result<()> {
    let entries = std::fs::read_dir(folder).map_err(|e| file_error("read", folder, &e))?;
    for entry in entries {
        let path = entry.map_err(|e| file_error("read", folder, &e))?.path();
        // Without write access to what another left, it stays.
        if is_temporary(&path) && path.is_file() && is_abandoned(&path) {
            let _ = std::fs::remove_file(&path);
        }
    }
    Ok(())
}

/// Whether a name is one of a file that is being written.
pub fn is_temporary(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    name.starts_with('.') && name.ends_with(".tmp")
}

/// Whether nobody writes a file any more.
fn is_abandoned(path: &Path) -> bool {
    File::open(path).is_ok_and(|file| file.try_lock().is_ok())
}

/// Writes bytes to a temporary neighbour and renames it: the file is whole, or as it was before.
///
/// # Errors
///
/// [`Error::File`]; the neighbour is removed.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    write_with(path, |file| file.write_all(bytes)).map_err(|e| file_error("write", path, &e))
}

/// Writes a file piece by piece, whole or not at all: it takes its name when all of it is on disk.
///
/// # Errors
///
/// Those of the system and of `write`; what was written is removed.
pub fn write_with(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> std::io::Result<()>,
) -> std::io::Result<()> {
    let (neighbour, file) = temporary(path)?;
    let mut writer = BufWriter::with_capacity(1 << 20, file);
    let written = write(&mut writer)
        .and_then(|()| {
            writer
                .into_inner()
                .map_err(std::io::IntoInnerError::into_error)
        })
        .and_then(|file| {
            std::fs::rename(&neighbour, path)?;
            // Locked up to here.
            drop(file);
            Ok(())
        });
    if written.is_err() {
        // The write failed already; what is left of it is the lesser trouble.
        let _ = std::fs::remove_file(&neighbour);
    }
    written
}

/// A new file beside `path`, locked; the lock ends with the file.
fn temporary(path: &Path) -> std::io::Result<(PathBuf, File)> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    loop {
        let number = COUNTER.fetch_add(1, Ordering::Relaxed);
        let neighbour = path.with_file_name(format!(".{name}.{}-{number}.tmp", std::process::id()));
        let file = match File::create_new(&neighbour) {
            // Left by a process that had this number.
            Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => continue,
            other => other?,
        };
        // Where the system has no locks, nothing is swept either.
        let _ = file.lock();
        // Between its making and its lock another process may have swept it.
        if neighbour.exists() {
            return Ok((neighbour, file));
        }
    }
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
    write_atomically(path, &encode_png(path, pixels, rows, columns)?)
}

/// The bytes of an 8-bit grey PNG, as [`write_png`] writes them.
///
/// - `path`: named in the error
///
/// # Errors
///
/// [`Error::File`].
///
/// # Panics
///
/// If there are not rows × columns pixels.
pub fn encode_png(path: &Path, pixels: &[u8], rows: usize, columns: usize) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes)
        .write_image(pixels, columns as u32, rows as u32, ExtendedColorType::L8)
        .map_err(|e| file_error("encode", path, &e))?;
    Ok(bytes)
}

/// Writes a PNG of red, green and blue, 8 bits each: `[rows, columns, 3]`; one without colours as a grey one, which is smaller
/// and sooner packed.
///
/// Mostly grey speckle: without filters the three equal bytes of a pixel compress to little more than one.
pub(crate) fn write_rgb_png(path: &Path, pixels: &[u8], rows: usize, columns: usize) -> Result<()> {
    let colours = pixels.as_chunks::<3>().0;
    if colours.iter().all(|[r, g, b]| r == g && g == b) {
        let grey: Vec<u8> = colours.iter().map(|[level, ..]| *level).collect();
        return write_png(path, &grey, rows, columns);
    }
    let mut bytes = Vec::new();
    PngEncoder::new_with_quality(&mut bytes, CompressionType::Best, FilterType::NoFilter)
        .write_image(pixels, columns as u32, rows as u32, ExtendedColorType::Rgb8)
        .map_err(|e| file_error("encode", path, &e))?;
    write_atomically(path, &bytes)
}

/// Writes fields as `f32` tensors `[rows, columns]` of a safetensors file, and a complex image as `[rows, columns, 2]`, row by
/// row: large fields are not copied as a whole.
///
/// # Errors
///
/// [`Error::File`].
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
    // The data begin at a multiple of eight.
    header.resize(header.len().next_multiple_of(8), b' ');
    let write = |file: &mut BufWriter<File>| {
        file.write_all(&(header.len() as u64).to_le_bytes())?;
        file.write_all(&header)?;
        tensors.iter().try_for_each(|tensor| tensor.write(file))
    };
    write_with(path, write).map_err(|e| file_error("write", path, &e))
}

/// What the header of a safetensors file says of a tensor.
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

/// Its numbers.
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
        // As the library writes it itself, byte for byte.
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

    #[test]
    fn pictures_are_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("image.png");
        write_png(&path, &[0, 50, 100, 150, 200, 250], 2, 3).unwrap();
        let picture = image::open(&path).unwrap().into_luma8();
        assert_eq!((picture.width(), picture.height()), (3, 2));
        assert_eq!(picture.get_pixel(1, 1).0, [200]);
    }

    /// A picture without colours is stored in one byte a pixel, one with a colour in three; both read back as they were.
    #[test]
    fn pictures_keep_their_colours() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture.png");
        let grey = [0, 0, 0, 90, 90, 90, 255, 255, 255, 7, 7, 7];
        let mut coloured = grey;
        coloured[4] = 91;
        for (pixels, kind) in [
            (grey, image::ColorType::L8),
            (coloured, image::ColorType::Rgb8),
        ] {
            write_rgb_png(&path, &pixels, 2, 2).unwrap();
            let picture = image::open(&path).unwrap();
            assert_eq!(picture.color(), kind);
            assert_eq!(picture.into_rgb8().into_raw(), pixels);
        }
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

    /// What is locked is being written; the rest of that name is what a kill left.
    #[test]
    fn a_good_run_sweeps_what_dead_ones_left_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        for name in [
            ".fields.safetensors.99.tmp",
            ".image.png.1-7.tmp",
            "notes.tmp",
            ".profile",
        ] {
            std::fs::write(path(name), "here").unwrap();
        }
        let (alive, lock) = temporary(&path("labels.json")).unwrap();
        make_folder(folder.path()).unwrap();
        let left = |name: &str| path(name).exists();
        assert!(!left(".fields.safetensors.99.tmp") && !left(".image.png.1-7.tmp"));
        assert!(left("notes.tmp") && left(".profile") && alive.exists());
        drop(lock);
        sweep(folder.path()).unwrap();
        assert!(!alive.exists());
    }

    #[test]
    fn a_folder_belongs_to_one_at_a_time() {
        let folder = tempfile::tempdir().unwrap();
        let lock = lock_folder(folder.path()).unwrap();
        let refused = lock_folder(folder.path()).unwrap_err().to_string();
        assert!(refused.contains("another process"), "{refused}");
        drop(lock);
        lock_folder(folder.path()).unwrap();
    }
}
