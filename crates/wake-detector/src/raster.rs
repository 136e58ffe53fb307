//! Images of any size that are read window by window.

use std::convert::Infallible;

use crate::image::GreyImage;

/// An image whose windows can be read by several threads at once.
pub trait Raster: Sync {
    /// Error of reading a window.
    type Error: Send;

    /// Number of rows.
    fn rows(&self) -> usize;

    /// Number of columns.
    fn columns(&self) -> usize;

    /// Reads a rectangle inside the image, row by row: amplitude, or grey levels of any scaling. Pixels that are not finite
    /// count as missing: land, or pixels without data.
    ///
    /// # Errors
    ///
    /// The errors of the underlying file.
    fn window(
        &self,
        top: usize,
        left: usize,
        rows: usize,
        columns: usize,
    ) -> Result<Vec<f32>, Self::Error>;
}

impl Raster for GreyImage {
    type Error = Infallible;

    fn rows(&self) -> usize {
        self.rows
    }

    fn columns(&self) -> usize {
        self.columns
    }

    fn window(
        &self,
        top: usize,
        left: usize,
        rows: usize,
        columns: usize,
    ) -> Result<Vec<f32>, Infallible> {
        Ok(Self::window(self, top, left, rows, columns))
    }
}
