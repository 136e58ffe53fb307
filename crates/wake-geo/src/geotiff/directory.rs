//! Directory of a TIFF image: size, samples and compression.

use tiff::decoder::{Decoder, Limits};
use tiff::tags::{
    ByteOrder, CompressionMethod, PhotometricInterpretation, PlanarConfiguration, SampleFormat, Tag,
};
use tiff::{TiffError, TiffResult};

use super::sample::{Encoding, SampleType};
use crate::error::{Error, Result};
use crate::limits::{CHUNK_BYTES, IMAGE_PIXELS, IMAGE_SIDE};
use crate::read_at::Reader;
use whole_files::sentence;

/// Most samples per pixel.
const MOST_BANDS: u16 = 64;

/// Command that converts a TIFF file into one that this crate reads.
const CONVERT: &str =
    "gdal_translate -ot Float32 -co TILED=YES -co COMPRESS=DEFLATE -co PREDICTOR=1";

pub(super) type TiffDecoder = Decoder<std::io::BufReader<Reader>>;

/// Decoder of a file, at its first image.
pub(super) fn decoder(file: &str, reader: Reader) -> Result<TiffDecoder> {
    let mut limits = Limits::default();
    limits.decoding_buffer_size = CHUNK_BYTES;
    limits.intermediate_buffer_size = CHUNK_BYTES;
    let decoder = Decoder::new(std::io::BufReader::new(reader)).map_err(|e| failed(file, &e))?;
    Ok(decoder.with_limits(limits))
}

/// Directory of the first image.
pub(super) struct Tags {
    pub(super) lines: u32,
    pub(super) pixels: u32,
    pub(super) compression: CompressionMethod,
    pub(super) predictor: u16,
    bands: u16,
    planar: PlanarConfiguration,
    photometric: PhotometricInterpretation,
    bits: Vec<u16>,
    format: Vec<u16>,
    big_endian: bool,
    pub(super) offsets: Vec<u64>,
    pub(super) byte_counts: Vec<u64>,
}

impl Tags {
    pub(super) fn read(decoder: &mut TiffDecoder) -> TiffResult<Self> {
        let (pixels, lines) = decoder.dimensions()?;
        let number = |decoder: &mut TiffDecoder, tag, default: u16| {
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

    pub(super) fn encoding(&self, file: &str) -> Result<Encoding> {
        let unsupported = |what: String| Error::Unsupported {
            file: file.to_owned(),
            what: sentence(&what),
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
                "TIFF compression {}",
                name(self.compression)
            )));
        }
        // Readers disagree on whether these compressions can have a predictor.
        let plain = matches!(
            self.compression,
            CompressionMethod::None | CompressionMethod::PackBits
        );
        if plain && self.predictor != 1 {
            return Err(unsupported(format!(
                "a predictor with TIFF compression {}",
                name(self.compression)
            )));
        }
        let shown = matches!(
            self.photometric,
            PhotometricInterpretation::BlackIsZero | PhotometricInterpretation::RGB
        );
        if !shown {
            return Err(unsupported(format!(
                "the TIFF photometric interpretation {:?}",
                self.photometric
            )));
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
                let kind = match format {
                    SampleFormat::Uint => "unsigned".to_owned(),
                    SampleFormat::Int => "signed".to_owned(),
                    SampleFormat::IEEEFP => "floating-point".to_owned(),
                    other => format!("format {}", other.to_u16()),
                };
                return Err(unsupported(format!(
                    "the TIFF sample type ({bits} bits, {kind})"
                )));
            }
        };
        if self.bands > MOST_BANDS {
            return Err(unsupported(format!(
                "a TIFF of {} bands (limit {MOST_BANDS})",
                self.bands
            )));
        }
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

/// Name of a compression; its number if it has none.
fn name(compression: CompressionMethod) -> String {
    match compression {
        CompressionMethod::Unknown(number) => number.to_string(),
        known => format!("{known:?}"),
    }
}

pub(super) fn check_size(file: &str, lines: usize, pixels: usize) -> Result<()> {
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

pub(super) fn failed(file: &str, error: &TiffError) -> Error {
    match error {
        TiffError::UnsupportedError(what) => Error::Unsupported {
            file: file.to_owned(),
            what: sentence(&format!("a feature of this TIFF ({what})")),
            remedy: CONVERT,
        },
        TiffError::LimitsExceeded => Error::Unsupported {
            file: file.to_owned(),
            what: format!("a strip or tile of more than {CHUNK_BYTES} bytes"),
            remedy: CONVERT,
        },
        other => Error::damaged(
            file,
            sentence(&format!("it is not a readable TIFF file ({other})")),
        ),
    }
}
