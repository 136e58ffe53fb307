//! Radiometric calibration of a product: digital numbers to σ⁰.

use super::lut::{Extent, Lut};
use crate::error::Result;
use crate::xml::Document;

/// Largest calibration value that is accepted; products of 16 bits have at most 2³².
const LARGEST: f64 = 1e12;

/// Table of the σ⁰ calibration: σ⁰ = (DN² − noise) / A².
#[derive(Clone, Debug)]
pub(crate) struct Calibration {
    /// A at each position.
    pub(crate) sigma_nought: Lut,
}

impl Calibration {
    /// Reads the calibration file of an image with the given lines and pixels.
    pub(crate) fn read(document: &Document, lines: usize, pixels: usize) -> Result<Self> {
        let list = document.root().get("calibrationVectorList")?;
        let extent = Extent {
            lines,
            pixels,
            smallest: 1e-6,
            largest: LARGEST,
        };
        let sigma_nought = Lut::read(list, "calibrationVector", "sigmaNought", extent)?;
        Ok(Self { sigma_nought })
    }
}
