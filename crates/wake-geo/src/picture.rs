//! PNG and JPEG images, decoded as a whole.

use std::io::{BufReader, Seek};
use std::ops::Range;
use std::path::Path;

use image::{ImageReader, Limits};

use crate::error::{Error, Result};
use crate::limits::{IMAGE_SIDE, PICTURE_BYTES};

/// Grey levels of an image.
#[derive(Debug)]
pub(crate) struct Picture {
    pub(crate) lines: usize,
    pub(crate) pixels: usize,
    levels: Levels,
}

#[derive(Debug)]
enum Levels {
    U8(Vec<u8>),
    U16(Vec<u16>),
}

impl Picture {
    /// Decodes a PNG or JPEG file; colours are converted to grey.
    pub(crate) fn open(path: &Path, mut file: std::fs::File) -> Result<Self> {
        file.rewind().map_err(|e| Error::io(path, e))?;
        let unreadable = |e: &dyn std::fmt::Display| Error::unreadable(path, e);
        let mut reader = ImageReader::new(BufReader::new(file))
            .with_guessed_format()
            .map_err(|e| Error::io(path, e))?;
        let mut limits = Limits::default();
        limits.max_alloc = Some(PICTURE_BYTES);
        limits.max_image_width = Some(IMAGE_SIDE as u32);
        limits.max_image_height = Some(IMAGE_SIDE as u32);
        reader.limits(limits);
        let image = reader.decode().map_err(|e| unreadable(&e))?;
        let (lines, pixels) = (image.height() as usize, image.width() as usize);
        let levels = match image.color().bytes_per_pixel() / image.color().channel_count() {
            1 => Levels::U8(image.into_luma8().into_raw()),
            _ => Levels::U16(image.into_luma16().into_raw()),
        };
        Ok(Self {
            lines,
            pixels,
            levels,
        })
    }

    /// Reads the levels of a window inside the image; `out` has the size of the window.
    pub(crate) fn read(&self, lines: Range<usize>, pixels: Range<usize>, out: &mut [f32]) {
        for (line, out) in lines.zip(out.chunks_exact_mut(pixels.len())) {
            let row = line * self.pixels + pixels.start..line * self.pixels + pixels.end;
            match &self.levels {
                Levels::U8(levels) => copy(&levels[row], out),
                Levels::U16(levels) => copy(&levels[row], out),
            }
        }
    }
}

fn copy<T: Copy + Into<f32>>(levels: &[T], out: &mut [f32]) {
    for (level, out) in levels.iter().zip(out) {
        *out = (*level).into();
    }
}
