//! Brightness, contrast and wave direction of the sea away from the wake.

use super::spectrum::{PowerSpectrum, window};
use super::wake::decibel;
use crate::raster::{Field, Raster};
use crate::sar::geometry::direction;
use serde::Serialize;

/// Brightness, contrast and wave direction of the open sea in an image.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct OpenSea {
    /// Mean intensity, in the unit of σ⁰ \[1\].
    pub mean: f64,
    /// Standard deviation over mean \[1\].
    pub contrast: f64,
    /// Power of the waves that run from lower left to upper right minus the power of the others, over their sum; positive for a
    /// wind along 45° or 225°.
    pub skew: f64,
}

/// Half-angle of the masked sector astern, which holds the wake and its displaced echoes \[deg\].
const LEFT_OUT: f64 = 70.0;
/// Width of the soft edge \[deg\].
const SOFT: f64 = 20.0;
/// Distance from midship within which pixels are masked, and width of the transition beyond it \[m\].
const NEAR: [f64; 2] = [100.0, 60.0];
/// Range wavenumbers of the skew, as fractions of the largest that a pixel carries: the sea's own waves, above the long waves
/// made by bunching.
const BAND: [f64; 2] = [0.38, 1.0];
/// Azimuth wavenumbers of the skew, as fractions of the same; 0 has no sign.
const AZIMUTH_BAND: [f64; 2] = [0.013, 0.64];

/// Measures the sea in an image of intensity before speckle.
///
/// - `ship`: midship (x, y) \[m\] and heading \[deg\] of the ship whose wake is masked; without a ship, all pixels count
/// - returns `None` for an image that is dark everywhere or has a value that is not finite
#[must_use]
pub fn open_sea(
    intensity: &Field,
    raster: &Raster,
    ship: Option<([f64; 2], f64)>,
) -> Option<OpenSea> {
    let window = window(raster, |place| ship.map_or(1.0, |ship| away(place, ship)));
    let decibel = decibel(intensity)?;
    let weights = || window.values.iter().map(|&w| f64::from(w));
    let total: f64 = weights().sum();
    let values = || intensity.values.iter().map(|&v| f64::from(v));
    let mean = weights().zip(values()).map(|(w, v)| w * v).sum::<f64>() / total;
    let square = weights()
        .zip(values())
        .map(|(w, v)| w * (v - mean).powi(2))
        .sum::<f64>();
    let spectrum = PowerSpectrum::of(&decibel, &window, raster.spacing)?;
    Some(OpenSea {
        mean,
        contrast: (square / total).sqrt() / mean,
        skew: skew(&spectrum, raster.nyquist_wavenumber()),
    })
}

/// Weight of a place: 1 away from the wake, 0 in it.
fn away([x, y]: [f64; 2], (position, heading): ([f64; 2], f64)) -> f64 {
    let astern = direction(heading + 180.0);
    let (dx, dy) = (x - position[0], y - position[1]);
    let distance = dx.hypot(dy);
    let cos = (dx * astern[0] + dy * astern[1]) / distance.max(1e-9);
    let off = cos.clamp(-1.0, 1.0).acos().to_degrees();
    ((off - LEFT_OUT) / SOFT).clamp(0.0, 1.0) * ((distance - NEAR[0]) / NEAR[1]).clamp(0.0, 1.0)
}

fn skew(spectrum: &PowerSpectrum, largest: f64) -> f64 {
    let (mut difference, mut sum) = (0.0, 0.0);
    for (n, &power) in spectrum.power.values.iter().enumerate() {
        let [kx, ky] = spectrum.wavenumber(n).map(|k| k / largest);
        let counts = (BAND[0]..BAND[1]).contains(&kx)
            && (AZIMUTH_BAND[0]..AZIMUTH_BAND[1]).contains(&ky.abs());
        if counts {
            difference += f64::from(power) * ky.signum();
            sum += f64::from(power);
        }
    }
    if sum > 0.0 { difference / sum } else { 0.0 }
}
