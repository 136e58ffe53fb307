//! Input of the detector from a product: amplitudes, without land.

use wake_detector::Raster;
use wake_geo::{LandMask, Product, Values};

/// Step of the land mask's look-up \[lines and pixels\].
const STEP: usize = 8;

/// The sea of a product.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SeaOf<'a> {
    pub(crate) product: &'a Product,
    pub(crate) land: Option<&'a LandMask>,
}

impl SeaOf<'_> {
    /// Whether a pixel of the product is land; places outside are clamped to the last line and pixel.
    fn is_land(&self, line: usize, pixel: usize) -> bool {
        let Some(land) = self.land else { return false };
        let (lines, pixels) = self.product.size();
        let (line, pixel) = (line.min(lines - 1), pixel.min(pixels - 1));
        let place = self.product.place(line as f64, pixel as f64);
        place.is_ok_and(|place| land.is_land(place.latitude, place.longitude))
    }
}

impl Raster for SeaOf<'_> {
    type Error = wake_geo::Error;

    fn rows(&self) -> usize {
        self.product.size().0
    }

    fn columns(&self) -> usize {
        self.product.size().1
    }

    fn window(
        &self,
        top: usize,
        left: usize,
        rows: usize,
        columns: usize,
    ) -> Result<Vec<f32>, wake_geo::Error> {
        let window = self
            .product
            .read_window(top..top + rows, left..left + columns)?;
        let mut values = window.values;
        if self.product.values() == Values::SigmaNought {
            values.iter_mut().for_each(|value| *value = value.sqrt());
        }
        if self.land.is_none() {
            return Ok(values);
        }
        for row in (0..rows).step_by(STEP) {
            for column in (0..columns).step_by(STEP) {
                if !self.is_land(top + row + STEP / 2, left + column + STEP / 2) {
                    continue;
                }
                for line in values.chunks_mut(columns).skip(row).take(STEP) {
                    line[column..(column + STEP).min(columns)].fill(f32::NAN);
                }
            }
        }
        Ok(values)
    }
}
