//! TIFF files, with or without places, read in windows and written in strips.

mod chunks;
mod directory;
mod keys;
mod lzw;
mod sample;
mod writer;

use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

pub use sample::SampleType;
pub use writer::{Compression, GeoTiffLayout, Placement, TiffSample, write_geotiff};

use chunks::Chunks;

use crate::error::{Error, Result};
use crate::geolocation::Geolocation;
use crate::read_at::ReadAt;
use whole_files::sentence;

/// First image of a TIFF file, read in windows. Of several bands, the first is read.
///
/// Samples are u8, u16, i16 or f32 in strips or tiles, without compression or with deflate, LZW or `PackBits`, with or
/// without a predictor, in TIFF or `BigTIFF` of either byte order. Places come from an affine map or from control points
/// on a rectangular grid, with an EPSG code of [`Projection`](crate::Projection).
pub struct GeoTiff {
    lines: usize,
    pixels: usize,
    sample: SampleType,
    no_data: Option<f32>,
    geolocation: Geolocation,
    chunks: Chunks,
}

impl std::fmt::Debug for GeoTiff {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("GeoTiff")
            .field("lines", &self.lines)
            .field("pixels", &self.pixels)
            .field("sample", &self.sample)
            .finish_non_exhaustive()
    }
}

impl GeoTiff {
    /// Opens a TIFF file and reads its directory, but no pixels.
    ///
    /// # Errors
    /// A file that cannot be read, is not TIFF, is truncated or beyond the limits, or uses an unsupported feature.
    pub fn open(path: &Path) -> Result<Self> {
        let file = whole_files::open_regular(path).map_err(|e| Error::io(path, e))?;
        Self::from_source(&sentence(&path.to_string_lossy()), Arc::new(file))
    }

    pub(crate) fn from_source(name: &str, source: Arc<dyn ReadAt>) -> Result<Self> {
        let chunks = Chunks::open(name, source)?;
        Ok(Self {
            lines: chunks.lines,
            pixels: chunks.pixels,
            sample: chunks.sample(),
            no_data: keys::no_data(&chunks),
            geolocation: keys::geolocation(name, &chunks),
            chunks,
        })
    }

    /// Number of lines.
    pub fn lines(&self) -> usize {
        self.lines
    }

    /// Number of pixels of a line.
    pub fn pixels(&self) -> usize {
        self.pixels
    }

    /// Type of the samples.
    pub fn sample_type(&self) -> SampleType {
        self.sample
    }

    /// Value that marks missing pixels, if the file names one.
    pub fn no_data(&self) -> Option<f32> {
        self.no_data
    }

    pub(crate) fn geolocation(&self) -> &Geolocation {
        &self.geolocation
    }

    /// Reads the samples of a window inside the image, line by line; `out` has the size of the window.
    pub(crate) fn read(
        &self,
        lines: Range<usize>,
        pixels: Range<usize>,
        out: &mut [f32],
    ) -> Result<()> {
        self.chunks.read(lines, pixels, out)
    }
}
