//! Grey images.

use std::fmt::Display;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader, Limits};

use crate::error::{Error, LONGEST_FILE, LONGEST_SIDE, MOST_MEMORY, MOST_NOTES, Result};

/// Grey levels at the bit depth of the file, to save memory.
#[derive(Debug, Clone)]
enum Levels {
    Eight(Vec<u8>),
    Sixteen(Vec<u16>),
}

/// A grey image of 8 or 16 bits.
#[derive(Debug, Clone)]
pub struct GreyImage {
    pub(crate) rows: usize,
    pub(crate) columns: usize,
    levels: Levels,
}

impl GreyImage {
    /// Reads a PNG, JPEG or TIFF file; colours become grey.
    ///
    /// # Errors
    ///
    /// [`Error::Unreadable`] for a path that is not an image or not a regular file; [`Error::FileTooLong`], [`Error::TooLarge`]
    /// and [`Error::TooMuchMemory`] for an image that is too large, before its pixels are read.
    pub fn read(path: &Path) -> Result<Self> {
        let mut decoder = decoder(path)?;
        let wrong = |error: ImageError| unreadable(path, error);
        let (columns, rows) = decoder.dimensions();
        let allowed = 1..=LONGEST_SIDE as u32;
        if !allowed.contains(&columns) || !allowed.contains(&rows) {
            return Err(Error::TooLarge {
                path: path.to_owned(),
                columns,
                rows,
            });
        }
        check_memory(path, decoder.total_bytes())?;
        decoder.set_limits(limits(MOST_MEMORY)).map_err(wrong)?;
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

    /// Makes an 8-bit image from its levels, row by row.
    ///
    /// # Errors
    ///
    /// [`Error::WrongSize`] if the levels do not fill the image, or it has no pixels.
    pub fn eight_bits(rows: usize, columns: usize, levels: Vec<u8>) -> Result<Self> {
        Self::of(rows, columns, levels.len(), Levels::Eight(levels))
    }

    /// Makes a 16-bit image from its levels, row by row.
    ///
    /// # Errors
    ///
    /// As [`eight_bits`](Self::eight_bits).
    pub fn sixteen_bits(rows: usize, columns: usize, levels: Vec<u16>) -> Result<Self> {
        Self::of(rows, columns, levels.len(), Levels::Sixteen(levels))
    }

    fn of(rows: usize, columns: usize, count: usize, levels: Levels) -> Result<Self> {
        match count > 0 && rows.checked_mul(columns) == Some(count) {
            true => Ok(Self {
                rows,
                columns,
                levels,
            }),
            false => Err(Error::WrongSize {
                rows,
                columns,
                levels: count,
            }),
        }
    }

    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Returns the levels of a rectangle, row by row.
    ///
    /// # Panics
    ///
    /// If the rectangle does not lie in the image.
    #[must_use]
    pub fn window(&self, top: usize, left: usize, rows: usize, columns: usize) -> Vec<f32> {
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

    /// Makes an 8-bit image from levels of 0 to 255, which are rounded.
    ///
    /// # Panics
    ///
    /// If there are not `rows · columns` levels.
    pub fn from_levels(rows: usize, columns: usize, levels: &[f32]) -> Self {
        assert_eq!(levels.len(), rows * columns, "give one level per pixel");
        let levels = levels.iter().map(|x| x.round().clamp(0.0, 255.0) as u8);
        Self {
            rows,
            columns,
            levels: Levels::Eight(levels.collect()),
        }
    }

    /// The image rotated clockwise by 90°.
    pub fn turned(&self) -> Self {
        let [rows, columns] = [self.rows, self.columns];
        Self {
            rows: columns,
            columns: rows,
            levels: match &self.levels {
                Levels::Eight(levels) => Levels::Eight(turned(levels, rows, columns)),
                Levels::Sixteen(levels) => Levels::Sixteen(turned(levels, rows, columns)),
            },
        }
    }
}

/// Rotates levels clockwise by 90°.
fn turned<T: Copy>(levels: &[T], rows: usize, columns: usize) -> Vec<T> {
    let places = (0..columns).flat_map(|column| (0..rows).rev().map(move |row| (row, column)));
    places
        .map(|(row, column)| levels[row * columns + column])
        .collect()
}

/// Opens a file and reads its header: a colour profile above [`MOST_NOTES`] is ignored, longer text refused.
fn decoder(path: &Path) -> Result<impl ImageDecoder> {
    let io = |error: std::io::Error| unreadable(path, error);
    // Opening a pipe would block until something writes to it.
    let found = std::fs::metadata(path).map_err(io)?;
    if !found.is_file() {
        return Err(unreadable(path, "not a regular file"));
    }
    let bytes = found.len();
    if bytes > LONGEST_FILE {
        return Err(Error::FileTooLong {
            path: path.to_owned(),
            bytes,
        });
    }
    let file = File::open(path).map_err(io)?;
    let mut reader = ImageReader::new(BufReader::new(file))
        .with_guessed_format()
        .map_err(io)?;
    if reader.format() == Some(ImageFormat::Jpeg) {
        // The decoder reads the whole file, copies its metadata and joins the copies.
        check_memory(path, 3 * bytes)?;
    }
    reader.limits(limits(MOST_NOTES));
    reader.into_decoder().map_err(|error| match error {
        ImageError::Limits(_) => unreadable(
            path,
            format!("its metadata exceed {} MiB", MOST_NOTES >> 20),
        ),
        error => unreadable(path, error),
    })
}

fn unreadable(path: &Path, why: impl Display) -> Error {
    Error::Unreadable {
        path: path.to_owned(),
        why: why.to_string().replace('\n', " "),
    }
}

fn check_memory(path: &Path, bytes: u64) -> Result<()> {
    match bytes <= MOST_MEMORY {
        true => Ok(()),
        false => Err(Error::TooMuchMemory {
            path: path.to_owned(),
            bytes,
        }),
    }
}

fn limits(memory: u64) -> Limits {
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(memory);
    limits
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sixteen_bits_keep_their_levels() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.png");
        let image = image::ImageBuffer::<image::Luma<u16>, _>::from_fn(5, 3, |x, y| {
            image::Luma([(1000 * x + y) as u16])
        });
        image.save(&path).expect("a file");
        let grey = GreyImage::read(&path).expect("an image");
        assert_eq!((grey.rows, grey.columns), (3, 5));
        assert_eq!(
            grey.window(1, 2, 2, 3),
            [2001.0, 3001.0, 4001.0, 2002.0, 3002.0, 4002.0]
        );
        // Clockwise by 90°: the first column becomes the first row, its last pixel first.
        let turned = GreyImage::from_levels(2, 3, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]).turned();
        assert_eq!(turned.window(0, 0, 3, 2), [4.0, 1.0, 5.0, 2.0, 6.0, 3.0]);
        assert_eq!(grey.turned().window(4, 0, 1, 3), [4002.0, 4001.0, 4000.0]);
    }

    #[test]
    fn levels_must_fill_the_image() {
        assert!(GreyImage::eight_bits(2, 3, vec![7; 6]).is_ok());
        for (rows, columns, count) in [(2, 3, 5), (0, 3, 0), (usize::MAX, 2, 4)] {
            let refused = GreyImage::sixteen_bits(rows, columns, vec![7; count]);
            let sentence = refused.expect_err("too few").to_string();
            assert!(sentence.contains(&format!("{count} levels")), "{sentence}");
        }
    }

    #[test]
    fn what_is_no_image_is_refused_in_one_sentence() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.png");
        let refusal = |bytes: &[u8]| {
            std::fs::write(&path, bytes).expect("a file");
            GreyImage::read(&path).expect_err("no image").to_string()
        };
        let mut good = Vec::new();
        image::GrayImage::new(40, 40)
            .write_to(&mut std::io::Cursor::new(&mut good), ImageFormat::Png)
            .expect("a PNG");
        for bytes in [
            &b""[..],
            b"not an image",
            &good[..good.len() / 2],
            &good[..20],
        ] {
            let sentence = refusal(bytes);
            assert!(
                sentence.contains("a.png") && sentence.contains("PNG") && !sentence.contains('\n'),
                "{sentence}"
            );
        }
        // A header that claims 30,000 x 30,000 pixels, with a matching checksum.
        let mut claims = good.clone();
        claims[16..20].copy_from_slice(&30_000u32.to_be_bytes());
        claims[20..24].copy_from_slice(&30_000u32.to_be_bytes());
        let sum = crc(&claims[12..29]);
        claims[29..33].copy_from_slice(&sum.to_be_bytes());
        let sentence = refusal(&claims);
        assert!(
            sentence.contains("30000 x 30000") && sentence.contains("20000"),
            "{sentence}"
        );
        // A sparse file of more than two billion bytes.
        File::create(&path)
            .and_then(|file| file.set_len(LONGEST_FILE + 1))
            .expect("a file");
        let sentence = GreyImage::read(&path).expect_err("too long").to_string();
        assert!(sentence.contains("2000000001 bytes"), "{sentence}");
    }

    /// A chunk of a PNG file.
    fn chunk(kind: &[u8; 4], content: &[u8]) -> Vec<u8> {
        let named = [kind, content].concat();
        let length = (content.len() as u32).to_be_bytes();
        [&length, &named[..], &crc(&named).to_be_bytes()].concat()
    }

    /// An image of 40 × 40 pixels with an extra chunk after its header.
    fn with_chunk(chunk: &[u8]) -> Vec<u8> {
        let mut good = std::io::Cursor::new(Vec::new());
        image::GrayImage::new(40, 40)
            .write_to(&mut good, ImageFormat::Png)
            .expect("a PNG");
        let good = good.into_inner();
        // Signature and header take 33 bytes.
        [&good[..33], chunk, &good[33..]].concat()
    }

    /// Zeros compressed by zlib, 2,064 in 13 bytes: after the first, each code copies 258 bytes from one byte back.
    fn packed_zeros(blocks: usize) -> Vec<u8> {
        let mut bits: Vec<u8> = vec![1, 1, 0, 0, 0, 1, 1, 0, 0, 0, 0];
        let copy = [1, 1, 0, 0, 0, 1, 0, 1, 0, 0, 0, 0, 0];
        bits.extend((0..8 * blocks).flat_map(|_| copy));
        bits.extend([0; 7]);
        let byte = |bits: &[u8]| bits.iter().rev().fold(0, |byte, bit| 2 * byte + bit);
        let sum = (((1 + 2064 * blocks) % 65_521) << 16 | 1) as u32;
        let packed: Vec<u8> = bits.chunks(8).map(byte).collect();
        [&[0x78, 0x01], &packed[..], &sum.to_be_bytes()].concat()
    }

    /// An image with a profile of 206 MB, compressed to 1.3 MB, is read without the profile; one of 206 kB is kept.
    #[test]
    fn a_long_colour_profile_is_not_unpacked() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.png");
        for (blocks, kept) in [(100, true), (100_000, false)] {
            let profile = chunk(b"iCCP", &[b"a\0\0", &packed_zeros(blocks)[..]].concat());
            std::fs::write(&path, with_chunk(&profile)).expect("a file");
            let read = decoder(&path).expect("an image").icc_profile();
            let read = read
                .expect("a profile or none")
                .map(|profile| profile.len());
            assert_eq!(read, kept.then_some(1 + 2064 * blocks));
            assert_eq!(GreyImage::read(&path).expect("an image").rows, 40);
        }
    }

    /// A PNG with a gigabyte of text and a JPEG with a gigabyte of segments, both sparse files, are refused before they are read.
    #[test]
    fn long_text_is_refused_before_it_is_read() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.png");
        let refusal = |start: &[u8]| {
            std::fs::write(&path, start).expect("a file");
            let file = File::options().write(true).open(&path);
            file.and_then(|file| file.set_len(1_000_000_000))
                .expect("a file");
            GreyImage::read(&path).expect_err("too long").to_string()
        };
        let text = with_chunk(&[&900_000_000_u32.to_be_bytes()[..], b"tEXta\0"].concat());
        let sentence = refusal(&text[..33 + 10]);
        assert!(sentence.contains("metadata exceed 64 MiB"), "{sentence}");
        let sentence = refusal(&[0xFF, 0xD8, 0xFF, 0xE1, 0xFF, 0xFF]);
        assert!(sentence.contains("needs 3000000000 bytes"), "{sentence}");
    }

    /// Reading a pipe without a writer would block forever.
    #[cfg(unix)]
    #[test]
    fn pipes_and_devices_are_refused_at_once() {
        let folder = tempfile::tempdir().expect("a folder");
        let pipe = folder.path().join("a.png");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        assert!(made.expect("mkfifo").success());
        for path in [pipe, "/dev/zero".into(), folder.path().to_owned()] {
            let (sender, receiver) = std::sync::mpsc::channel();
            std::thread::spawn(move || sender.send(GreyImage::read(&path).map(|_| ())));
            let ended = receiver.recv_timeout(std::time::Duration::from_secs(20));
            let sentence = ended.expect("an end").expect_err("no file").to_string();
            assert!(sentence.contains("not a regular file"), "{sentence}");
        }
    }

    /// The cyclic redundancy check of PNG, bit by bit.
    fn crc(bytes: &[u8]) -> u32 {
        let step = |crc: u32, _| {
            if crc & 1 == 1 {
                (crc >> 1) ^ 0xEDB8_8320
            } else {
                crc >> 1
            }
        };
        !bytes.iter().fold(u32::MAX, |crc, &byte| {
            (0..8).fold(crc ^ u32::from(byte), step)
        })
    }
}
