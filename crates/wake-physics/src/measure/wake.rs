//! Heading and speed of a ship from the image of its wake.

use super::spectrum::{PowerSpectrum, window};
use super::{Measured, ShipPlace, arms, stationary};
use crate::kelvin::half_angle;
use crate::raster::{Field, Raster};
use crate::sar::geometry::direction;
use serde::Serialize;

/// Heading and speed of a ship, measured from its wake.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct WakeMeasurement {
    /// Heading of the ship [deg clockwise from azimuth].
    pub heading: Measured,
    /// Speed of the ship [m/s].
    pub speed: Measured,
}

/// Half-angle of the sector astern whose waves count, and of the sector ahead with which they are compared \[deg\].
const SECTOR: f64 = 45.0;
/// Width of the sector's soft edge \[deg\].
const SOFT: f64 = 10.0;
/// Distance from midship within which pixels are masked, and width of the transition beyond it \[m\].
const NEAR: f64 = 60.0;
/// Standard deviation of the smoothing of the sea's spectrum \[steps\].
const SMOOTHING: f64 = 3.0;
/// Smallest intensity relative to the mean, which keeps black pixels finite in decibels.
const DARKEST: f64 = 1e-4;

/// Measures heading and speed in an image of intensity before speckle.
///
/// The arms give the heading to within a few degrees, without ambiguity, since the wake opens astern. The waves that are
/// stationary beside the ship give the speed and a finer heading where the image carries them. Crests along azimuth are smeared
/// by the motion of the sea, so for a ship within some 30° of the flight direction the heading follows from the arms alone and no
/// speed is measurable.
///
/// # Shapes
///
/// - `intensity`: `[rows, columns]` of `raster`, linear
///
/// # Validity
///
/// Deep water, speeds of 4.6 to 13.9 m/s, one wake, its ship in the image. Not measurable are wakes in water so shallow that the
/// fastest of these ships would open its arms by 2° more than in deep water (below 36 m), images without variation, and images
/// without anything like a wake.
#[must_use]
pub fn measure_wake(intensity: &Field, raster: &Raster, ship: &ShipPlace) -> WakeMeasurement {
    let nothing = WakeMeasurement {
        heading: Measured::NOTHING,
        speed: Measured::NOTHING,
    };
    let fits = (intensity.rows, intensity.columns) == (raster.rows, raster.columns);
    let Some(decibel) = decibel(intensity).filter(|_| fits) else {
        return nothing;
    };
    let coarse = arms::heading(&decibel, raster, ship);
    if coarse.value.is_nan() {
        return nothing;
    }
    let spectrum = |towards: f64| {
        let window = sector(raster, ship.position, towards);
        PowerSpectrum::of(&decibel, &window, raster.spacing)
    };
    let (Some(wake), Some(sea)) = (spectrum(coarse.value + 180.0), spectrum(coarse.value)) else {
        return nothing;
    };
    let sea = sea.smoothed(SMOOTHING);
    let fine = stationary::velocity(&wake, &sea, raster.nyquist_wavenumber(), coarse.value);
    WakeMeasurement {
        heading: combined(coarse, fine.heading),
        speed: Measured {
            measurable: fine.speed.measurable && coarse.measurable,
            ..fine.speed
        },
    }
}

/// The finer heading where it is measurable, otherwise the heading from the arms.
fn combined(arms: Measured, fine: Measured) -> Measured {
    if fine.measurable && arms.measurable {
        Measured {
            confidence: arms.confidence,
            ..fine
        }
    } else {
        arms
    }
}

/// Intensity in decibels minus its mean; `None` for an image that is dark everywhere or has a value that is not finite.
pub(super) fn decibel(intensity: &Field) -> Option<Field> {
    let mean = intensity.mean();
    if !(mean.is_finite() && mean > 0.0) {
        return None;
    }
    let darkest = (DARKEST * mean) as f32;
    let mut field = intensity.clone();
    for v in &mut field.values {
        *v = 10.0 * v.max(darkest).log10();
    }
    let mean = field.mean() as f32;
    for v in &mut field.values {
        *v -= mean;
    }
    Some(field)
}

/// Window over a sector from midship in the direction `towards`.
fn sector(raster: &Raster, position: [f64; 2], towards: f64) -> Field {
    let [ax, ay] = direction(towards);
    window(raster, |[x, y]| {
        let (dx, dy) = (x - position[0], y - position[1]);
        let distance = dx.hypot(dy);
        let cos = (dx * ax + dy * ay) / distance.max(1e-9);
        let off = cos.clamp(-1.0, 1.0).acos().to_degrees();
        let edge = ((SECTOR - off) / SOFT).clamp(0.0, 1.0);
        edge * ((distance - NEAR) / NEAR).clamp(0.0, 1.0)
    })
}

/// Whether each pixel lies inside the Kelvin wedge, astern of midship, where the wake, unlike the sea, is not random.
///
/// - `heading`: [deg clockwise from azimuth]
/// - `speed`: [m/s]; with the depth it sets the opening of the wedge, see [`half_angle`]
/// - returns one value per pixel, row after row
#[must_use]
pub fn kelvin_wedge(raster: &Raster, ship: &ShipPlace, heading: f64, speed: f64) -> Vec<bool> {
    let [ax, ay] = direction(heading);
    let slope = half_angle(speed, ship.depth).tan();
    (0..raster.len())
        .map(|n| {
            let dx = raster.x(n % raster.columns) - ship.position[0];
            let dy = raster.y(n / raster.columns) - ship.position[1];
            let (forward, across) = (dx * ax + dy * ay, dx * ay - dy * ax);
            // The arms start at the bow.
            forward < 0.0 && across.abs() < slope * (0.5 * ship.length - forward)
        })
        .collect()
}
