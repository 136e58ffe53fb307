//! Wind and incidence from the brightness of the open sea, and fetch from its contrast.
//!
//! One brightness cannot determine three unknowns. Each is therefore found with the other two given, as stated by the prompt of a
//! generated image or the scene of a simulated image: is the image as bright as the sea under *this* wind at *this* incidence?

use super::{Measured, OpenSea};
use crate::effects::Effects;
use crate::models::Models;
use crate::raster::Raster;
use crate::scattering::SlopeCovariance;
use crate::scene::Scene;
use crate::simulate::LinearSea;

/// Wind speeds tried [m/s].
const WINDS: Lattice = Lattice(2.0, 0.5, 21);
/// Incidences tried \[deg\].
const INCIDENCES: Lattice = Lattice(10.0, 1.0, 36);
/// Angles between wind and look direction tried \[deg\].
const ANGLES: Lattice = Lattice(0.0, 5.0, 19);
/// Logarithms of the fetches tried \[m\]: 3 to 240 km.
const FETCHES: Lattice = Lattice(8.0, 0.4, 12);
/// Smallest change of brightness for which a value is measurable: with wind speed [dB per m/s], with incidence [dB per degree],
/// and between wind along and across the look direction \[dB\].
const THRESHOLDS: [f64; 3] = [0.5, 0.15, 1.5];
/// Smallest relative change of the variance of intensity per relative change of the fetch for which the fetch is measurable
/// \[1\].
const LEAST_GROWTH: f64 = 0.3;
/// Pixels along a side of the sea whose variance is computed.
const SIDE: usize = 128;
/// Distance outside the range of brightnesses within which the sea still counts as its end \[dB\].
const TOLERANCE: f64 = 0.25;
/// Smallest skew of the spectrum that distinguishes one diagonal from the other \[1\].
const LEAST_SKEW: f64 = 0.03;

/// First value, step, number of values.
struct Lattice(f64, f64, usize);

impl Lattice {
    fn values(&self) -> impl Iterator<Item = f64> {
        (0..self.2).map(|n| self.0 + self.1 * n as f64)
    }
}

/// Mean cross-section of the waves of a scene's sea, without breaking, noise and ships.
///
/// ```text
/// ⟨σ⁰⟩ = ∬ σ⁰(s) p(s) ds,    p the Gaussian density of all slopes from the longest wave to the radar's
/// ```
///
/// - returns ⟨σ⁰⟩ \[1\], to about two digits
///
/// # Errors
///
/// A value of the scene out of its range.
pub fn mean_sigma0(scene: &Scene) -> crate::Result<f64> {
    scene.validate()?;
    Ok(cross_section(&Models::new(scene)))
}

/// Mean intensity of a scene's sea, without its ship: waves, breaking and noise \[1\].
pub(crate) fn mean_intensity(scene: &Scene) -> f64 {
    let models = Models::new(scene);
    let [breaking, noise] = Effects::new(scene, &models).added();
    cross_section(&models) + breaking + noise
}

fn cross_section(models: &Models) -> f64 {
    let band = Raster::nyquist_wavenumber(&models.pixels.image);
    let moments = models.sea.moments(0.0, band, models.incidence);
    let resolved = SlopeCovariance {
        xx: moments.slope_xx,
        xy: moments.slope_xy,
        yy: moments.slope_yy,
    };
    let [bragg, specular] = models.backscatter(true, true).mean_over(&resolved);
    bragg + specular
}

/// Wind speed [m/s] that makes the sea of `scene` as bright as the image, for given direction, fetch and incidence.
///
/// - confidence: change of brightness [dB per m/s]; 0 if no wind of 2 to 12 m/s fits, or more than one
///
/// # Errors
///
/// A value of the scene out of its range.
pub fn wind_speed(sea: &OpenSea, scene: &Scene) -> crate::Result<Measured> {
    inverted(sea, scene, &WINDS, |scene, value| {
        scene.sea.wind_speed = value;
    })
    .map(|(value, slope)| Measured::with_threshold(value, slope, THRESHOLDS[0]))
}

/// Incidence \[deg\] at which the sea of `scene` is as bright as the image, for a given wind.
///
/// - confidence: change of brightness [dB per degree]; 0 if no incidence of 10 to 45° fits, or more than one
///
/// # Errors
///
/// A value of the scene out of its range.
pub fn incidence(sea: &OpenSea, scene: &Scene) -> crate::Result<Measured> {
    inverted(sea, scene, &INCIDENCES, |scene, value| {
        scene.radar.incidence = value;
    })
    .map(|(value, slope)| Measured::with_threshold(value, slope, THRESHOLDS[1]))
}

/// Fetch \[m\] whose waves give the sea of `scene` the contrast of the image, for given wind and incidence.
///
/// ```text
/// contrast² = ∬ P(k; fetch) dk,    P the quasi-linear spectrum of the intensity
/// ```
///
/// - `contrast`: standard deviation over mean of the intensity before speckle \[1\], see [`OpenSea::contrast`]
/// - confidence: relative change of the variance per relative change of the fetch; 0 if no fetch of 3 to 240 km fits, or more
///   than one
///
/// # Errors
///
/// As in [`LinearSea::new`].
pub fn fetch(contrast: f64, scene: &Scene) -> crate::Result<Measured> {
    let mut scene = scene.clone();
    (scene.grid.rows, scene.grid.columns) = (SIDE, SIDE);
    let at = |logarithm: f64| {
        scene.sea.fetch = logarithm.exp();
        Ok((logarithm, LinearSea::new(&scene)?.variance().ln()))
    };
    let curve: Vec<(f64, f64)> = FETCHES.values().map(at).collect::<crate::Result<_>>()?;
    Ok(match crossings(&curve, 2.0 * contrast.ln()).as_slice() {
        &[(logarithm, growth)] => Measured::with_threshold(logarithm.exp(), growth, LEAST_GROWTH),
        _ => Measured::NOTHING,
    })
}

/// Axis of the wind [deg clockwise from azimuth, 0 up to 180], for given wind speed, fetch and incidence.
///
/// Short waves and slopes are the same for a wind and its opposite, and brightness depends only on the angle to the look
/// direction. The skew of the spectrum selects one of the two diagonals. The measurement therefore has an inherent ambiguity of
/// 180°.
///
/// - confidence: difference of brightness between wind along and across the look direction \[dB\]; 0 if the sea is brighter or
///   darker than either, or if the diagonals cannot be distinguished
///
/// # Errors
///
/// A value of the scene out of its range.
pub fn wind_axis(sea: &OpenSea, scene: &Scene) -> crate::Result<Measured> {
    scene.validate()?;
    // Angle to the look direction: 0 is a wind toward 90°.
    let curve = curve(scene, &ANGLES, |scene, value| {
        scene.sea.wind_toward = 90.0 - value;
    });
    let decibel = 10.0 * sea.mean.log10();
    let (along, across) = (curve[0].1, curve[curve.len() - 1].1);
    let (low, high) = (along.min(across), along.max(across));
    if !(low - TOLERANCE..=high + TOLERANCE).contains(&decibel) {
        return Ok(Measured::NOTHING);
    }
    let found = crossings(&curve, decibel.clamp(low + 1e-9, high - 1e-9));
    let &[(angle, _)] = found.as_slice() else {
        return Ok(Measured::NOTHING);
    };
    let sided = (10.0..80.0).contains(&angle);
    if sided && sea.skew.abs() < LEAST_SKEW {
        return Ok(Measured::NOTHING);
    }
    let axis = (90.0 - angle * sea.skew.signum()).rem_euclid(180.0);
    Ok(Measured::with_threshold(axis, high - low, THRESHOLDS[2]))
}

/// The only value at which the scene is as bright as the sea, and the slope of the brightness there.
fn inverted(
    sea: &OpenSea,
    scene: &Scene,
    lattice: &Lattice,
    set: impl Fn(&mut Scene, f64),
) -> crate::Result<(f64, f64)> {
    scene.validate()?;
    let found = crossings(&curve(scene, lattice, set), 10.0 * sea.mean.log10());
    Ok(match found.as_slice() {
        &[only] => only,
        _ => (f64::NAN, 0.0),
    })
}

/// Brightness \[dB\] over a lattice of values.
fn curve(scene: &Scene, lattice: &Lattice, set: impl Fn(&mut Scene, f64)) -> Vec<(f64, f64)> {
    let mut scene = scene.clone();
    scene.ships.clear();
    lattice
        .values()
        .map(|value| {
            set(&mut scene, value);
            (value, 10.0 * mean_intensity(&scene).log10())
        })
        .collect()
}

/// Values at which a curve crosses a level, by linear interpolation, each with the absolute slope.
fn crossings(curve: &[(f64, f64)], level: f64) -> Vec<(f64, f64)> {
    curve
        .windows(2)
        .filter_map(|pair| {
            let [(x0, y0), (x1, y1)] = [pair[0], pair[1]];
            let crosses = (y0 <= level) != (y1 <= level);
            let slope = (y1 - y0) / (x1 - x0);
            (crosses && slope.is_finite()).then(|| (x0 + (level - y0) / slope, slope.abs()))
        })
        .collect()
}
