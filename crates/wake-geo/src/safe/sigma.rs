//! Conversion of digital numbers to σ⁰, row by row.

use std::ops::Range;

use super::calibration::Calibration;
use super::lut::Rows;
use super::noise::Noise;

/// Numbers of pixels without data and below the noise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Counts {
    pub(crate) no_data: usize,
    pub(crate) below_noise: usize,
}

/// σ⁰ of one pixel: (DN² − noise) / A², 0 below the noise.
pub(crate) fn sigma_nought(number: f64, noise: f64, calibration: f64) -> f64 {
    ((number * number - noise) / (calibration * calibration)).max(0.0)
}

/// Converts rows of digital numbers to σ⁰ in place, for the lines of a window in order.
pub(crate) struct Calibrator<'a> {
    pixels: Range<usize>,
    calibration: Rows<'a>,
    noise: Option<(&'a Noise, Rows<'a>)>,
    row: Vec<f32>,
}

impl<'a> Calibrator<'a> {
    pub(crate) fn new(
        calibration: &'a Calibration,
        noise: Option<&'a Noise>,
        pixels: Range<usize>,
    ) -> Self {
        Self {
            calibration: calibration.sigma_nought.rows(pixels.clone()),
            noise: noise.map(|noise| (noise, noise.range.rows(pixels.clone()))),
            row: vec![0.0; pixels.len()],
            pixels,
        }
    }

    /// Converts one row. A digital number of 0 is no data and becomes NaN.
    pub(crate) fn apply(&mut self, line: usize, row: &mut [f32]) -> Counts {
        if let Some((noise, rows)) = &mut self.noise {
            let (a, b, t) = rows.at(line);
            for ((out, a), b) in self.row.iter_mut().zip(a).zip(b) {
                *out = a + t * (b - a);
            }
            noise.scale_row(line, self.pixels.clone(), &mut self.row);
        }
        let (a, b, t) = self.calibration.at(line);
        let (mut no_data, mut below_noise) = (0u32, 0u32);
        for (((value, noise), a), b) in row.iter_mut().zip(&self.row).zip(a).zip(b) {
            let calibration = a + t * (b - a);
            let power = *value * *value - noise;
            let sigma = power.max(0.0) / (calibration * calibration);
            let empty = *value <= 0.0;
            no_data += u32::from(empty);
            below_noise += u32::from(power < 0.0 && !empty);
            *value = if empty { f32::NAN } else { sigma };
        }
        Counts {
            no_data: no_data as usize,
            below_noise: below_noise as usize,
        }
    }
}
