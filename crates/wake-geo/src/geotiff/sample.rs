//! Samples of a TIFF file as 32-bit floating-point numbers.

/// Type of the samples of a TIFF file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleType {
    /// Unsigned, 8 bits.
    U8,
    /// Unsigned, 16 bits.
    U16,
    /// Signed, 16 bits.
    I16,
    /// Floating point, 32 bits.
    F32,
}

impl SampleType {
    /// Size of a sample \[bytes\].
    pub fn bytes(self) -> usize {
        match self {
            Self::U8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::F32 => 4,
        }
    }

    /// Name in messages.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::U8 => "8-bit unsigned",
            Self::U16 => "16-bit unsigned",
            Self::I16 => "16-bit signed",
            Self::F32 => "32-bit floating-point",
        }
    }
}

/// Encoding of pixels in a file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Encoding {
    pub(crate) sample: SampleType,
    /// Samples per pixel; only the first is read.
    pub(crate) bands: usize,
    pub(crate) big_endian: bool,
}

impl Encoding {
    /// Size of a pixel \[bytes\].
    pub(crate) fn pixel_bytes(self) -> usize {
        self.sample.bytes() * self.bands
    }

    /// Decodes the first sample of as many pixels as `out` holds.
    pub(crate) fn decode(self, bytes: &[u8], out: &mut [f32]) {
        match (self.sample, self.big_endian) {
            (SampleType::U8, _) => self.each(bytes, out, |[b]| f32::from(b)),
            (SampleType::U16, false) => self.each(bytes, out, |b| f32::from(u16::from_le_bytes(b))),
            (SampleType::U16, true) => self.each(bytes, out, |b| f32::from(u16::from_be_bytes(b))),
            (SampleType::I16, false) => self.each(bytes, out, |b| f32::from(i16::from_le_bytes(b))),
            (SampleType::I16, true) => self.each(bytes, out, |b| f32::from(i16::from_be_bytes(b))),
            (SampleType::F32, false) => self.each(bytes, out, f32::from_le_bytes),
            (SampleType::F32, true) => self.each(bytes, out, f32::from_be_bytes),
        }
    }

    #[inline(always)]
    fn each<const N: usize>(self, bytes: &[u8], out: &mut [f32], value: impl Fn([u8; N]) -> f32) {
        let first = |pixel: &[u8]| {
            let mut sample = [0; N];
            sample.copy_from_slice(&pixel[..N]);
            value(sample)
        };
        if self.bands == 1 {
            // Chunks of constant size compile to vector instructions.
            for (pixel, out) in bytes.chunks_exact(N).zip(out) {
                *out = first(pixel);
            }
        } else {
            for (pixel, out) in bytes.chunks_exact(N * self.bands).zip(out) {
                *out = first(pixel);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_of_all_types_and_orders() {
        let read = |sample, bands, big_endian, bytes: &[u8]| {
            let mut out = [0.0; 2];
            let encoding = Encoding {
                sample,
                bands,
                big_endian,
            };
            encoding.decode(bytes, &mut out);
            out.map(f64::from)
        };
        let same = |a: [f64; 2], b: [f64; 2]| {
            assert!(
                a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9),
                "{a:?} {b:?}"
            );
        };
        same(read(SampleType::U8, 1, false, &[7, 255]), [7.0, 255.0]);
        same(
            read(SampleType::U8, 3, false, &[7, 1, 2, 9, 3, 4]),
            [7.0, 9.0],
        );
        same(
            read(SampleType::U16, 1, false, &[1, 2, 255, 255]),
            [513.0, 65535.0],
        );
        same(
            read(SampleType::U16, 1, true, &[1, 2, 255, 255]),
            [258.0, 65535.0],
        );
        same(
            read(SampleType::I16, 1, false, &[255, 255, 0, 128]),
            [-1.0, -32768.0],
        );
        let mut floats = 1.5f32.to_be_bytes().to_vec();
        floats.extend((-2.0f32).to_be_bytes());
        same(read(SampleType::F32, 1, true, &floats), [1.5, -2.0]);
    }
}
