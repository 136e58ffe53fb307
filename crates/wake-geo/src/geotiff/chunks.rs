//! Strips and tiles of a TIFF file, of which only those under a window are read.

use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;

use tiff::decoder::{Decoder, Limits};
use tiff::tags::{
    ByteOrder, CompressionMethod, PhotometricInterpretation, PlanarConfiguration, SampleFormat, Tag,
};
use tiff::{TiffError, TiffResult};

use super::sample::{Encoding, SampleType};
use crate::error::{Error, Result, quoted};
use crate::limits::{CACHE_BYTES, CHUNK_BYTES, IMAGE_PIXELS, IMAGE_SIDE};
use crate::read_seek::ReadSeek;

/// Command that converts a TIFF file into one that this crate reads.
const CONVERT: &str =
    "gdal_translate -ot Float32 -co TILED=YES -co COMPRESS=DEFLATE -co PREDICTOR=1";

/// The first image of a TIFF file.
pub(crate) struct Chunks {
    file: String,
    decoder: Decoder<Box<dyn ReadSeek>>,
    pub(crate) lines: usize,
    pub(crate) pixels: usize,
    /// Of the bytes in the file, and of those the decoder gives.
    stored: Encoding,
    decoded: Encoding,
    compressed: bool,
    chunk_lines: usize,
    chunk_pixels: usize,
    chunks_across: usize,
    offsets: Vec<u64>,
    byte_counts: Vec<u64>,
    cache: Cache,
}

/// Decoded chunks, the latest used last.
#[derive(Default)]
struct Cache {
    chunks: Vec<(usize, Vec<u8>)>,
    bytes: usize,
}

impl Chunks {
    /// Reads the directory of a TIFF file; `file` names it in errors.
    ///
    /// # Errors
    /// What is no TIFF file, is truncated, is beyond the limits, or has samples or a compression that are not read.
    pub(crate) fn open(file: &str, mut reader: Box<dyn ReadSeek>) -> Result<Self> {
        let io = |e: std::io::Error| Error::damaged(file, format!("it cannot be read ({e})"));
        let length = reader.seek(SeekFrom::End(0)).map_err(io)?;
        reader.rewind().map_err(io)?;
        let mut limits = Limits::default();
        limits.decoding_buffer_size = CHUNK_BYTES;
        limits.intermediate_buffer_size = CHUNK_BYTES;
        let decoder = Decoder::new(reader).map_err(|e| failed(file, &e))?;
        let mut decoder = decoder.with_limits(limits);
        let tags = Tags::read(&mut decoder).map_err(|e| failed(file, &e))?;
        let (lines, pixels) = (tags.lines as usize, tags.pixels as usize);
        check_size(file, lines, pixels)?;
        let encoding = tags.encoding(file)?;
        let (chunk_pixels, chunk_lines) = decoder.chunk_dimensions();
        let (chunk_pixels, chunk_lines) =
            (chunk_pixels as usize, (chunk_lines as usize).min(lines));
        if chunk_pixels == 0 || chunk_lines == 0 {
            return Err(Error::damaged(file, "its strips or tiles have no pixels"));
        }
        let chunks = Self {
            file: file.to_owned(),
            lines,
            pixels,
            stored: encoding,
            decoded: Encoding {
                big_endian: cfg!(target_endian = "big"),
                ..encoding
            },
            compressed: tags.compression != CompressionMethod::None,
            chunk_lines,
            chunk_pixels,
            chunks_across: pixels.div_ceil(chunk_pixels),
            offsets: tags.offsets,
            byte_counts: tags.byte_counts,
            cache: Cache::default(),
            decoder,
        };
        chunks.check_places(length)?;
        Ok(chunks)
    }

    /// Type of the samples.
    pub(crate) fn sample(&self) -> SampleType {
        self.stored.sample
    }

    /// Value of a tag, if the file has it and it can be read.
    pub(crate) fn tag(&mut self, tag: u16) -> Option<tiff::decoder::ifd::Value> {
        let tag = Tag::from_u16_exhaustive(tag);
        self.decoder.find_tag(tag).ok().flatten()
    }

    /// Checks that all chunks are there and end before the end of the file.
    fn check_places(&self, length: u64) -> Result<()> {
        let expected = self.chunks_across * self.lines.div_ceil(self.chunk_lines);
        if self.offsets.len() < expected || self.byte_counts.len() < expected {
            return Err(Error::damaged(
                &self.file,
                format!(
                    "it lists {} of {expected} strips or tiles",
                    self.offsets.len().min(self.byte_counts.len())
                ),
            ));
        }
        let chunk =
            self.chunk_lines as u64 * self.chunk_pixels as u64 * self.stored.pixel_bytes() as u64;
        if self.compressed && chunk > CHUNK_BYTES as u64 {
            return Err(Error::TooLarge {
                file: self.file.clone(),
                what: "the size of a compressed strip or tile in bytes",
                value: chunk,
                limit: CHUNK_BYTES as u64,
                remedy: "write the file in tiles: `gdal_translate -co TILED=YES`",
            });
        }
        for index in 0..expected {
            let (start, bytes) = (self.offsets[index], self.byte_counts[index]);
            let bytes = match self.compressed || start == 0 {
                true => bytes,
                false => self.stored_bytes(index),
            };
            if start.checked_add(bytes).is_none_or(|end| end > length) {
                return Err(Error::damaged(
                    &self.file,
                    format!(
                        "it is truncated: strip or tile {index} has {bytes} bytes from byte {start}, but the file has {length}"
                    ),
                ));
            }
        }
        Ok(())
    }

    /// Bytes of an uncompressed chunk; the last strip may be shorter than the others.
    fn stored_bytes(&self, index: usize) -> u64 {
        let first = index / self.chunks_across * self.chunk_lines;
        let lines = match self.chunks_across == 1 && self.chunk_pixels == self.pixels {
            true => self.chunk_lines.min(self.lines - first),
            false => self.chunk_lines,
        };
        lines as u64 * self.chunk_pixels as u64 * self.stored.pixel_bytes() as u64
    }

    /// Reads a window, line by line, into `out`. The window must lie inside the image.
    pub(crate) fn read(
        &mut self,
        lines: Range<usize>,
        pixels: Range<usize>,
        out: &mut [f32],
    ) -> Result<()> {
        let width = pixels.len();
        let mut scratch = Vec::new();
        for row in lines.start / self.chunk_lines..=(lines.end - 1) / self.chunk_lines {
            for column in pixels.start / self.chunk_pixels..=(pixels.end - 1) / self.chunk_pixels {
                let (top, left) = (row * self.chunk_lines, column * self.chunk_pixels);
                let part = Part {
                    index: row * self.chunks_across + column,
                    lines: lines.start.max(top) - top..lines.end.min(top + self.chunk_lines) - top,
                    pixels: pixels.start.max(left) - left
                        ..pixels.end.min(left + self.chunk_pixels) - left,
                };
                let first =
                    (top + part.lines.start - lines.start) * width + left + part.pixels.start
                        - pixels.start;
                let out = &mut out[first..];
                match (self.compressed, self.offsets[part.index]) {
                    (false, 0) => part.fill(out, width),
                    (true, _) if self.byte_counts[part.index] == 0 => part.fill(out, width),
                    (false, _) => self.read_stored(&part, out, width, &mut scratch)?,
                    (true, _) => self.read_compressed(&part, out, width)?,
                }
            }
        }
        Ok(())
    }

    /// Reads only the bytes of the window; lines as wide as the chunk in one piece.
    fn read_stored(
        &mut self,
        part: &Part,
        out: &mut [f32],
        width: usize,
        scratch: &mut Vec<u8>,
    ) -> Result<()> {
        const PIECE: usize = 1 << 20;
        let bytes = self.stored.pixel_bytes();
        let line_bytes = part.pixels.len() * bytes;
        let together = match part.pixels.len() == self.chunk_pixels {
            true => (PIECE / line_bytes.max(1)).max(1),
            false => 1,
        };
        let start = self.offsets[part.index];
        for first in part.lines.clone().step_by(together) {
            let count = together.min(part.lines.end - first);
            let at = start + ((first * self.chunk_pixels + part.pixels.start) * bytes) as u64;
            scratch.resize(count * line_bytes, 0);
            let reader = self.decoder.inner();
            let read = reader
                .seek(SeekFrom::Start(at))
                .and_then(|_| reader.read_exact(scratch));
            read.map_err(|e| {
                Error::damaged(&self.file, format!("byte {at} cannot be read ({e})"))
            })?;
            for (i, line) in scratch.chunks_exact(line_bytes).enumerate() {
                let from = (first - part.lines.start + i) * width;
                self.stored
                    .decode(line, &mut out[from..from + part.pixels.len()]);
            }
        }
        Ok(())
    }

    fn read_compressed(&mut self, part: &Part, out: &mut [f32], width: usize) -> Result<()> {
        let at = self
            .cache
            .chunks
            .iter()
            .position(|(index, _)| *index == part.index);
        let chunk = match at {
            Some(at) => self.cache.chunks.remove(at),
            None => {
                let bytes = self
                    .decode(part.index)
                    .map_err(|e| failed(&self.file, &e))?;
                self.cache.bytes += bytes.len();
                (part.index, bytes)
            }
        };
        let (chunk_pixels, _) = self.decoder.chunk_data_dimensions(part.index as u32);
        let line_bytes = chunk_pixels as usize * self.decoded.pixel_bytes();
        for (i, line) in part.lines.clone().enumerate() {
            let from = line * line_bytes + part.pixels.start * self.decoded.pixel_bytes();
            let Some(bytes) = chunk
                .1
                .get(from..from + part.pixels.len() * self.decoded.pixel_bytes())
            else {
                return Err(Error::damaged(
                    &self.file,
                    format!("strip or tile {} is too short", part.index),
                ));
            };
            self.decoded
                .decode(bytes, &mut out[i * width..i * width + part.pixels.len()]);
        }
        self.cache.chunks.push(chunk);
        while self.cache.bytes > CACHE_BYTES && self.cache.chunks.len() > 1 {
            self.cache.bytes -= self.cache.chunks.remove(0).1.len();
        }
        Ok(())
    }

    fn decode(&mut self, index: usize) -> TiffResult<Vec<u8>> {
        let index = u32::try_from(index)?;
        let layout = self.decoder.image_chunk_buffer_layout(index)?;
        if layout.len > CHUNK_BYTES {
            return Err(TiffError::LimitsExceeded);
        }
        let mut bytes = vec![0; layout.len];
        self.decoder.read_chunk_bytes(index, &mut bytes)?;
        Ok(bytes)
    }
}

/// Part of a window in one chunk; lines and pixels count from the chunk's first.
struct Part {
    index: usize,
    lines: Range<usize>,
    pixels: Range<usize>,
}

impl Part {
    /// A chunk that the file leaves out holds zeros.
    fn fill(&self, out: &mut [f32], width: usize) {
        for line in 0..self.lines.len() {
            out[line * width..line * width + self.pixels.len()].fill(0.0);
        }
    }
}

/// What the directory of the first image says.
struct Tags {
    lines: u32,
    pixels: u32,
    compression: CompressionMethod,
    predictor: u16,
    bands: u16,
    planar: PlanarConfiguration,
    photometric: PhotometricInterpretation,
    bits: Vec<u16>,
    format: Vec<u16>,
    big_endian: bool,
    offsets: Vec<u64>,
    byte_counts: Vec<u64>,
}

impl Tags {
    fn read(decoder: &mut Decoder<Box<dyn ReadSeek>>) -> TiffResult<Self> {
        let (pixels, lines) = decoder.dimensions()?;
        let number = |decoder: &mut Decoder<Box<dyn ReadSeek>>, tag, default: u16| {
            decoder
                .find_tag_unsigned(tag)
                .map(|v: Option<u16>| v.unwrap_or(default))
        };
        let tiled = decoder.find_tag(Tag::TileOffsets)?.is_some();
        let (places, counts) = match tiled {
            true => (Tag::TileOffsets, Tag::TileByteCounts),
            false => (Tag::StripOffsets, Tag::StripByteCounts),
        };
        let compression = number(decoder, Tag::Compression, 1)?;
        let planar = number(decoder, Tag::PlanarConfiguration, 1)?;
        let photometric = number(decoder, Tag::PhotometricInterpretation, 1)?;
        Ok(Self {
            lines,
            pixels,
            compression: CompressionMethod::from_u16_exhaustive(compression),
            predictor: number(decoder, Tag::Predictor, 1)?,
            bands: number(decoder, Tag::SamplesPerPixel, 1)?,
            planar: PlanarConfiguration::from_u16(planar).unwrap_or(PlanarConfiguration::Chunky),
            photometric: PhotometricInterpretation::from_u16(photometric)
                .unwrap_or(PhotometricInterpretation::BlackIsZero),
            bits: decoder
                .find_tag_unsigned_vec(Tag::BitsPerSample)?
                .unwrap_or_default(),
            format: decoder
                .find_tag_unsigned_vec(Tag::SampleFormat)?
                .unwrap_or_default(),
            big_endian: decoder.byte_order() == ByteOrder::BigEndian,
            offsets: decoder.find_tag_unsigned_vec(places)?.unwrap_or_default(),
            byte_counts: decoder.find_tag_unsigned_vec(counts)?.unwrap_or_default(),
        })
    }

    fn encoding(&self, file: &str) -> Result<Encoding> {
        let unsupported = |what: String| Error::Unsupported {
            file: file.to_owned(),
            what: quoted(&what),
            remedy: CONVERT,
        };
        let known = matches!(
            self.compression,
            CompressionMethod::None
                | CompressionMethod::LZW
                | CompressionMethod::Deflate
                | CompressionMethod::OldDeflate
                | CompressionMethod::PackBits
        );
        if !known {
            return Err(unsupported(format!(
                "TIFF compression {:?}",
                self.compression
            )));
        }
        // Readers disagree whether these have a predictor.
        let plain = matches!(
            self.compression,
            CompressionMethod::None | CompressionMethod::PackBits
        );
        if plain && self.predictor != 1 {
            return Err(unsupported(format!(
                "a predictor with TIFF compression {:?}",
                self.compression
            )));
        }
        let shown = matches!(
            self.photometric,
            PhotometricInterpretation::BlackIsZero | PhotometricInterpretation::RGB
        );
        if !shown {
            return Err(unsupported(format!("TIFF color {:?}", self.photometric)));
        }
        let format = self.format.first().map_or(SampleFormat::Uint, |f| {
            SampleFormat::from_u16_exhaustive(*f)
        });
        let bits = self.bits.first().copied().unwrap_or(1);
        let sample = match (format, bits) {
            (SampleFormat::Uint, 8) => SampleType::U8,
            (SampleFormat::Uint, 16) => SampleType::U16,
            (SampleFormat::Int, 16) => SampleType::I16,
            (SampleFormat::IEEEFP, 32) => SampleType::F32,
            _ => {
                return Err(unsupported(format!(
                    "a TIFF sample of {bits} bits, {format:?}"
                )));
            }
        };
        let bands = match self.planar {
            PlanarConfiguration::Planar => 1,
            _ => usize::from(self.bands.max(1)),
        };
        Ok(Encoding {
            sample,
            bands,
            big_endian: self.big_endian,
        })
    }
}

fn check_size(file: &str, lines: usize, pixels: usize) -> Result<()> {
    let limits = [
        ("the number of lines", lines as u64, IMAGE_SIDE as u64),
        (
            "the number of pixels of a line",
            pixels as u64,
            IMAGE_SIDE as u64,
        ),
        (
            "the number of pixels",
            lines as u64 * pixels as u64,
            IMAGE_PIXELS,
        ),
    ];
    for (what, value, limit) in limits {
        if value > limit {
            return Err(Error::TooLarge {
                file: file.to_owned(),
                what,
                value,
                limit,
                remedy: "cut it into pieces",
            });
        }
    }
    Ok(())
}

fn failed(file: &str, error: &TiffError) -> Error {
    match error {
        TiffError::UnsupportedError(what) => Error::Unsupported {
            file: file.to_owned(),
            what: quoted(&format!("a feature of this TIFF ({what})")),
            remedy: CONVERT,
        },
        other => Error::damaged(file, quoted(&format!("no readable TIFF ({other})"))),
    }
}
