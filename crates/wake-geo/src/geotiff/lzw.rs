//! LZW-compressed strips and tiles, and their predictors.
//!
//! The decoder of the crate `tiff` (0.11) reads a tile at the right border piece by piece, and reports an error if
//! the compressed bytes end before the last piece.

use weezl::BitOrder;
use weezl::decode::Decoder;

use super::sample::{Encoding, SampleType};

/// Decodes a chunk of `size` bytes and lines of `pixels` pixels; returns its bytes and their encoding.
///
/// # Errors
/// Bytes that are not LZW, or too few; an unknown predictor.
pub(super) fn decode(
    packed: &[u8],
    size: usize,
    pixels: usize,
    stored: Encoding,
    predictor: u16,
) -> Result<(Vec<u8>, Encoding), String> {
    let mut bytes = vec![0; size];
    let mut decoder = Decoder::with_tiff_size_switch(BitOrder::Msb, 8);
    let (mut read, mut written) = (0, 0);
    while written < size {
        let part = decoder.decode_bytes(&packed[read..], &mut bytes[written..]);
        let status = part.status.map_err(|e| e.to_string())?;
        read += part.consumed_in;
        written += part.consumed_out;
        let stuck = part.consumed_in == 0 && part.consumed_out == 0;
        let done = matches!(status, weezl::LzwStatus::Done);
        if (stuck || done) && written < size {
            return Err(format!("it has {written} of {size} bytes"));
        }
    }
    let line = pixels * stored.pixel_bytes();
    let encoding = match predictor {
        1 => stored,
        2 => {
            bytes
                .chunks_exact_mut(line)
                .for_each(|line| sum(line, stored));
            stored
        }
        3 if stored.sample == SampleType::F32 => {
            let mut planes = vec![0; line];
            for line in bytes.chunks_exact_mut(line) {
                planes.copy_from_slice(line);
                join(&mut planes, line, stored.bands);
            }
            Encoding {
                big_endian: true,
                ..stored
            }
        }
        other => {
            return Err(format!(
                "predictor {other} is not supported for {} samples",
                stored.sample.name()
            ));
        }
    };
    Ok((bytes, encoding))
}

/// Undoes the horizontal predictor: each sample is stored as the difference from the pixel before.
fn sum(line: &mut [u8], encoding: Encoding) {
    let (pixel, big) = (encoding.pixel_bytes(), encoding.big_endian);
    let add = |line: &mut [u8], at: usize, size: usize| {
        let number = |bytes: &[u8]| {
            let join = |sum: u32, byte: &u8| sum << 8 | u32::from(*byte);
            match big {
                true => bytes.iter().fold(0, join),
                false => bytes.iter().rev().fold(0, join),
            }
        };
        let value =
            number(&line[at..at + size]).wrapping_add(number(&line[at - pixel..at - pixel + size]));
        let (first, last) = (value.to_le_bytes(), value.to_be_bytes());
        match big {
            true => line[at..at + size].copy_from_slice(&last[4 - size..]),
            false => line[at..at + size].copy_from_slice(&first[..size]),
        }
    };
    let size = encoding.sample.bytes();
    for at in (pixel..line.len()).step_by(size) {
        add(line, at, size);
    }
}

/// Undoes the floating-point predictor (byte differences, highest bytes of all samples first); returns big-endian
/// samples.
fn join(planes: &mut [u8], line: &mut [u8], bands: usize) {
    for at in bands..planes.len() {
        planes[at] = planes[at].wrapping_add(planes[at - bands]);
    }
    let samples = planes.len() / 4;
    for (i, sample) in line.chunks_exact_mut(4).enumerate() {
        for (byte, plane) in sample.iter_mut().zip(0..) {
            *byte = planes[plane * samples + i];
        }
    }
}
