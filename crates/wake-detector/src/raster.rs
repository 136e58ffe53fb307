//! Images that are read window by window, however large they are.

use std::convert::Infallible;

use crate::image::GreyImage;

/// An image of which windows can be read, by several threads at once.
pub trait Raster: Sync {
    /// Why a window cannot be read.
    type Error: Send;

    /// Number of rows.
    fn rows(&self) -> usize;

    /// Number of columns.
    fn columns(&self) -> usize;

    /// A rectangle inside the image as numbers, row by row: amplitude, or grey of any scaling. What is no number is missing:
    /// land, or pixels without data.
    ///
    /// # Errors
    ///
    /// Those of the file behind it.
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
