//! Grey images from files.

use std::fmt;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use image::{DynamicImage, ImageDecoder, ImageError, ImageReader, Limits};

/// Neither side of an image is longer \[pixels\].
const LONGEST_SIDE: usize = 20_000;
/// No file is longer \[bytes\].
pub(crate) const LONGEST_FILE: u64 = 2_000_000_000;
/// An image takes no more memory while it is read \[bytes\]: 20,000 × 20,000 pixels of 16 bits, and as much again.
const MOST_MEMORY: u64 = 1_800_000_000;

/// Why an image cannot be searched.
#[derive(Debug)]
pub(crate) enum Refused {
    Unreadable {
        path: PathBuf,
        why: String,
    },
    FileTooLong {
        path: PathBuf,
        bytes: u64,
    },
    TooLarge {
        path: PathBuf,
        columns: u32,
        rows: u32,
    },
    TooMuchMemory {
        path: PathBuf,
        bytes: u64,
    },
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unreadable { path, why } => write!(
                f,
                "{} is no image that can be read ({why}); give a PNG, JPEG or TIFF file of 8 or 16 bits",
                path.display()
            ),
            Self::FileTooLong { path, bytes } => write!(
                f,
                "{} has {bytes} bytes, above {LONGEST_FILE}; cut it into pieces",
                path.display()
            ),
            Self::TooLarge {
                path,
                columns,
                rows,
            } => write!(
                f,
                "{} has {columns} x {rows} pixels, outside 1 to {LONGEST_SIDE} a side; cut it into pieces",
                path.display()
            ),
            Self::TooMuchMemory { path, bytes } => write!(
                f,
                "{} takes {bytes} bytes, above {MOST_MEMORY}; convert it to grey of 8 or 16 bits",
                path.display()
            ),
        }
    }
}

impl std::error::Error for Refused {}

/// Levels as the file has them: a large image takes no more memory than it must.
#[derive(Debug, Clone)]
pub(crate) enum Levels {
    Eight(Vec<u8>),
    Sixteen(Vec<u16>),
}

/// A grey image of 8 or 16 bits.
#[derive(Debug, Clone)]
pub(crate) struct Grey {
    pub(crate) rows: usize,
    pub(crate) columns: usize,
    pub(crate) levels: Levels,
}

impl Grey {
    /// Reads a PNG, JPEG or TIFF file; colours become grey.
    ///
    /// # Errors
    ///
    /// [`Refused`] for what is no image, or too large; that is found out before the pixels are read.
    pub(crate) fn read(path: &Path) -> Result<Self, Refused> {
        let unreadable = |why: String| Refused::Unreadable {
            path: path.to_owned(),
            why: why.replace('\n', " "),
        };
        let file = File::open(path).map_err(|error| unreadable(error.to_string()))?;
        let bytes = file
            .metadata()
            .map_err(|error| unreadable(error.to_string()))?
            .len();
        if bytes > LONGEST_FILE {
            return Err(Refused::FileTooLong {
                path: path.to_owned(),
                bytes,
            });
        }
        let wrong = |error: ImageError| unreadable(error.to_string());
        let mut reader = ImageReader::new(BufReader::new(file))
            .with_guessed_format()
            .map_err(|error| unreadable(error.to_string()))?;
        let mut limits = Limits::no_limits();
        limits.max_alloc = Some(MOST_MEMORY);
        reader.limits(limits);
        let decoder = reader.into_decoder().map_err(wrong)?;
        let (columns, rows) = decoder.dimensions();
        let allowed = 1..=LONGEST_SIDE as u32;
        if !allowed.contains(&columns) || !allowed.contains(&rows) {
            return Err(Refused::TooLarge {
                path: path.to_owned(),
                columns,
                rows,
            });
        }
        let bytes = decoder.total_bytes();
        if bytes > MOST_MEMORY {
            return Err(Refused::TooMuchMemory {
                path: path.to_owned(),
                bytes,
            });
        }
        let image = DynamicImage::from_decoder(decoder).map_err(wrong)?;
        let levels = match image {
            DynamicImage::ImageLuma16(image) => Levels::Sixteen(image.into_raw()),
            image if image.color().bytes_per_pixel() > image.color().channel_count() => {
                Levels::Sixteen(image.into_luma16().into_raw())
            }
            image => Levels::Eight(image.into_luma8().into_raw()),
        };
        Ok(Self {
            rows: rows as usize,
            columns: columns as usize,
            levels,
        })
    }

    /// A rectangle as numbers, row by row.
    pub(crate) fn window(&self, top: usize, left: usize, rows: usize, columns: usize) -> Vec<f32> {
        let mut window = Vec::with_capacity(rows * columns);
        for row in top..top + rows {
            let place = row * self.columns + left..row * self.columns + left + columns;
            match &self.levels {
                Levels::Eight(levels) => window.extend(levels[place].iter().map(|&x| f32::from(x))),
                Levels::Sixteen(levels) => {
                    window.extend(levels[place].iter().map(|&x| f32::from(x)));
                }
            }
        }
        window
    }
}
