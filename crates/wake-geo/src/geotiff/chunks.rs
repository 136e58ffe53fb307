//! Strips and tiles of a TIFF file, of which only those under a window are read.

use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

use tiff::tags::{CompressionMethod, Tag};
use tiff::{TiffError, TiffResult};

use super::directory::{Tags, TiffDecoder, check_size, decoder, failed};
use super::lzw;
use super::sample::{Encoding, SampleType};
use crate::error::{Error, Result};
use crate::limits::{CACHE_BYTES, CHUNK_BYTES};
use crate::read_at::{ReadAt, Reader};

/// Advice for files whose strips or tiles are too large.
const TILED: &str = "write the file in tiles: `gdal_translate -co TILED=YES`";

/// The first image of a TIFF file.
pub(crate) struct Chunks {
    file: String,
    source: Arc<dyn ReadAt>,
    pub(crate) lines: usize,
    pub(crate) pixels: usize,
    stored: Encoding,
    compressed: bool,
    /// Predictor of LZW chunks, which this crate decodes itself; `None` for other compressions.
    lzw: Option<u16>,
    chunk_lines: usize,
    chunk_pixels: usize,
    chunks_across: usize,
    offsets: Vec<u64>,
    byte_counts: Vec<u64>,
    decoded: Mutex<Decoded>,
}

/// Decoded chunks, most recently used last, and the decoder for the others.
struct Decoded {
    decoder: TiffDecoder,
    chunks: Vec<(usize, Chunk)>,
    bytes: usize,
}

#[derive(Clone)]
struct Chunk {
    bytes: Arc<Vec<u8>>,
    encoding: Encoding,
    pixels: usize,
}

impl Chunks {
    /// Reads the directory of a TIFF file; `file` names it in errors.
    ///
    /// # Errors
    /// A file that is not TIFF, is truncated or beyond the limits, or has unsupported samples or compression.
    pub(crate) fn open(file: &str, source: Arc<dyn ReadAt>) -> Result<Self> {
        let length = source.size();
        let length =
            length.map_err(|e| Error::damaged(file, format!("it cannot be read ({e})")))?;
        let mut decoder = decoder(file, Reader::new(source.clone()))?;
        let tags = Tags::read(&mut decoder).map_err(|e| failed(file, &e))?;
        let (lines, pixels) = (tags.lines as usize, tags.pixels as usize);
        check_size(file, lines, pixels)?;
        let stored = tags.encoding(file)?;
        let (chunk_pixels, chunk_lines) = decoder.chunk_dimensions();
        let (chunk_pixels, chunk_lines) =
            (chunk_pixels as usize, (chunk_lines as usize).min(lines));
        if chunk_pixels == 0 || chunk_lines == 0 {
            return Err(Error::damaged(file, "its strips or tiles have no pixels"));
        }
        let chunks = Self {
            file: file.to_owned(),
            source,
            lines,
            pixels,
            stored,
            compressed: tags.compression != CompressionMethod::None,
            lzw: (tags.compression == CompressionMethod::LZW).then_some(tags.predictor),
            chunk_lines,
            chunk_pixels,
            chunks_across: pixels.div_ceil(chunk_pixels),
            offsets: tags.offsets,
            byte_counts: tags.byte_counts,
            decoded: Mutex::new(Decoded {
                decoder,
                chunks: Vec::new(),
                bytes: 0,
            }),
        };
        chunks.check_places(length)?;
        Ok(chunks)
    }

    /// Type of the samples.
    pub(crate) fn sample(&self) -> SampleType {
        self.stored.sample
    }

    /// Value of a tag, if the file has it and it can be read.
    pub(crate) fn tag(&self, tag: u16) -> Option<tiff::decoder::ifd::Value> {
        let mut decoded = self.decoded.lock().unwrap_or_else(PoisonError::into_inner);
        let tag = Tag::from_u16_exhaustive(tag);
        decoded.decoder.find_tag(tag).ok().flatten()
    }

    /// Checks that all chunks are listed and end within the file.
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
        let chunk = self.bytes_of(self.chunk_lines);
        if self.compressed && chunk > CHUNK_BYTES as u64 {
            return Err(Error::TooLarge {
                file: self.file.clone(),
                what: "the size of a compressed strip or tile in bytes",
                value: chunk,
                limit: CHUNK_BYTES as u64,
                remedy: TILED,
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

    /// Size of an uncompressed chunk \[bytes\]; the last strip may be shorter than the others.
    fn stored_bytes(&self, index: usize) -> u64 {
        let first = index / self.chunks_across * self.chunk_lines;
        let lines = match self.chunks_across == 1 && self.chunk_pixels == self.pixels {
            true => self.chunk_lines.min(self.lines - first),
            false => self.chunk_lines,
        };
        self.bytes_of(lines)
    }

    /// Uncompressed size of lines of a chunk \[bytes\].
    fn bytes_of(&self, lines: usize) -> u64 {
        let line = (self.chunk_pixels as u64).saturating_mul(self.stored.pixel_bytes() as u64);
        line.saturating_mul(lines as u64)
    }

    /// Reads a window, line by line, into `out`. The window must lie inside the image.
    pub(crate) fn read(
        &self,
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

    /// Reads only the bytes inside the window; lines as wide as the chunk are read together.
    fn read_stored(
        &self,
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
            let read = self.source.read_exact_at(at, scratch);
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

    fn read_compressed(&self, part: &Part, out: &mut [f32], width: usize) -> Result<()> {
        let chunk = self.chunk(part.index)?;
        let pixel_bytes = chunk.encoding.pixel_bytes();
        let length = part.pixels.len() * pixel_bytes;
        for (i, line) in part.lines.clone().enumerate() {
            let from = (line * chunk.pixels + part.pixels.start) * pixel_bytes;
            let Some(bytes) = chunk.bytes.get(from..from + length) else {
                return Err(Error::damaged(
                    &self.file,
                    format!("strip or tile {} is too short", part.index),
                ));
            };
            let row = &mut out[i * width..i * width + part.pixels.len()];
            chunk.encoding.decode(bytes, row);
        }
        Ok(())
    }

    /// A decoded chunk, from the cache if possible.
    fn chunk(&self, index: usize) -> Result<Chunk> {
        let mut decoded = self.decoded.lock().unwrap_or_else(PoisonError::into_inner);
        let at = decoded.chunks.iter().position(|(known, _)| *known == index);
        let chunk = match (at, self.lzw) {
            (Some(at), _) => decoded.chunks.remove(at).1,
            (None, Some(predictor)) => {
                let chunk = self.decode_lzw(index, predictor)?;
                decoded.bytes += chunk.bytes.len();
                chunk
            }
            (None, None) => {
                let chunk = decoded.decode(index as u32, self.stored);
                let chunk = chunk.map_err(|e| failed(&self.file, &e))?;
                decoded.bytes += chunk.bytes.len();
                chunk
            }
        };
        decoded.chunks.push((index, chunk.clone()));
        while decoded.bytes > CACHE_BYTES && decoded.chunks.len() > 1 {
            decoded.bytes -= decoded.chunks.remove(0).1.bytes.len();
        }
        Ok(chunk)
    }

    fn decode_lzw(&self, index: usize, predictor: u16) -> Result<Chunk> {
        let damaged = |why: String| {
            Error::damaged(
                &self.file,
                format!("strip or tile {index} is not valid LZW: {why}"),
            )
        };
        let packed = self.byte_counts[index];
        if packed > CHUNK_BYTES as u64 {
            return Err(Error::TooLarge {
                file: self.file.clone(),
                what: "the size of an LZW strip or tile in bytes",
                value: packed,
                limit: CHUNK_BYTES as u64,
                remedy: TILED,
            });
        }
        let mut bytes = vec![0; packed as usize];
        let read = self.source.read_exact_at(self.offsets[index], &mut bytes);
        read.map_err(|e| damaged(e.to_string()))?;
        // Within the limit, which is checked for whole chunks when the file is opened.
        let size = self.stored_bytes(index) as usize;
        let decoded = lzw::decode(&bytes, size, self.chunk_pixels, self.stored, predictor);
        let (bytes, encoding) = decoded.map_err(damaged)?;
        Ok(Chunk {
            bytes: Arc::new(bytes),
            encoding,
            pixels: self.chunk_pixels,
        })
    }
}

impl Decoded {
    fn decode(&mut self, index: u32, stored: Encoding) -> TiffResult<Chunk> {
        let layout = self.decoder.image_chunk_buffer_layout(index)?;
        if layout.len > CHUNK_BYTES {
            return Err(TiffError::LimitsExceeded);
        }
        let mut bytes = vec![0; layout.len];
        self.decoder.read_chunk_bytes(index, &mut bytes)?;
        let (pixels, lines) = self.decoder.chunk_data_dimensions(index);
        let samples = (pixels as usize * lines as usize * stored.sample.bytes()).max(1);
        Ok(Chunk {
            // The decoder drops bands that are not colours.
            encoding: Encoding {
                bands: (layout.len / samples).max(1),
                big_endian: cfg!(target_endian = "big"),
                ..stored
            },
            bytes: Arc::new(bytes),
            pixels: pixels as usize,
        })
    }
}

/// Part of a window in one chunk; lines and pixels count from the first of the chunk.
struct Part {
    index: usize,
    lines: Range<usize>,
    pixels: Range<usize>,
}

impl Part {
    /// Fills the part with zeros, the content of a chunk that the file omits.
    fn fill(&self, out: &mut [f32], width: usize) {
        for line in 0..self.lines.len() {
            out[line * width..line * width + self.pixels.len()].fill(0.0);
        }
    }
}
