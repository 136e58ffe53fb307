//! Heading from the wake's arms, by a Radon transform along half-lines that start at the bow.

use super::smooth::smooth;
use super::stationary::FASTEST;
use super::{Measured, ShipPlace};
use crate::kelvin::{KELVIN_ANGLE, half_angle};
use crate::raster::{Field, Raster};
use crate::sar::geometry::direction;

/// Number of half-lines of the transform, one per degree.
const RAYS: i64 = 360;
/// Half-width of the wedge: the Kelvin angle of 19.5° and the widening by velocity bunching \[deg\].
const HALF_WEDGE: i64 = 23;
/// Largest opening of the arms beyond the Kelvin angle that the wedge covers \[deg\].
const LARGEST_EXCESS: f64 = 2.0;
/// Width of the sea on each side of the wedge that is compared with it \[deg\].
const BESIDE: i64 = 25;
/// Width of an arm \[deg\].
const ARM: i64 = 7;
/// Gap between inside and outside \[deg\].
const GAP: i64 = 2;
/// Part of a half-line that counts, in units of half the image's smaller side.
const REACH: [f64; 2] = [0.31, 1.17];
/// Cap on the brightness of an arm, between sea (0) and brightest (1), so that one bright arm does not outweigh two.
const CAP: f64 = 0.7;
/// Standard deviations of the smoothing of the energy \[m\], and of the slow change that is removed \[m\].
const SMOOTHING: [f64; 2] = [12.0, 200.0];
/// Contrast between wedge and sea from which a wake is measurable, in standard deviations of the sea.
const THRESHOLD: f64 = 3.0;

/// Heading of the ship, opposite to the sector in which its wake opens.
///
/// ```text
/// R(φ) = ⟨ln ⟨(I_dB − ⟨I_dB⟩)²⟩⟩ along the half-line φ from the bow
/// ```
///
/// The wake is the sector of two Kelvin angles whose edges rise most above the sea beside them. Nothing is measurable where the
/// fastest ship would open a wider sector: of a wide wake the radar often shows only one arm, and one arm of unknown opening
/// gives no heading.
pub(super) fn heading(decibel: &Field, raster: &Raster, ship: &ShipPlace) -> Measured {
    if half_angle(FASTEST, ship.depth) > KELVIN_ANGLE + LARGEST_EXCESS.to_radians() {
        return Measured::NOTHING;
    }
    let energy = log_energy(decibel, raster.spacing);
    let mut apex = ship.position;
    let mut found = None;
    // The arms start at the bow, half a ship ahead of midship on a heading that is first found from midship.
    for _ in 0..3 {
        let Some(astern) = wedge(&rays(&energy, raster, apex)) else {
            return Measured::NOTHING;
        };
        let heading = (astern.0 as f64 + 180.0).rem_euclid(360.0);
        let ahead = direction(heading);
        apex = [0, 1].map(|a| ship.position[a] + 0.5 * ship.length * ahead[a]);
        found = Some((heading, astern.1));
    }
    found.map_or(Measured::NOTHING, |(heading, contrast)| {
        Measured::with_threshold(heading, contrast, THRESHOLD)
    })
}

/// Logarithm of the local energy of fast changes.
fn log_energy(decibel: &Field, spacing: f64) -> Field {
    let slow = smooth(decibel, SMOOTHING[1] / spacing);
    let mut square = decibel.clone();
    for (v, s) in square.values.iter_mut().zip(&slow.values) {
        *v = (*v - s).powi(2);
    }
    let mut energy = smooth(&square, SMOOTHING[0] / spacing);
    for v in &mut energy.values {
        *v = v.max(1e-6).ln();
    }
    energy
}

/// Means along the half-lines from a point, one per degree clockwise from +y; `None` where one misses the image.
fn rays(field: &Field, raster: &Raster, from: [f64; 2]) -> Option<Vec<f64>> {
    let half = 0.5 * raster.rows.min(raster.columns) as f64 * raster.spacing;
    let steps = |reach: f64| (reach * half / raster.spacing) as usize;
    (0..RAYS)
        .map(|ray| {
            let along = direction(ray as f64);
            let (mut sum, mut count) = (0.0, 0);
            for n in steps(REACH[0])..steps(REACH[1]) {
                let r = n as f64 * raster.spacing;
                let place = [0, 1].map(|a| from[a] + r * along[a]);
                let [column, row] = raster.pixel(place[0], place[1]).map(f64::round);
                let inside = (0.0..raster.columns as f64).contains(&column)
                    && (0.0..raster.rows as f64).contains(&row);
                if inside {
                    sum += f64::from(field.at(row as usize, column as usize));
                    count += 1;
                }
            }
            (count > 0).then(|| sum / f64::from(count))
        })
        .collect()
}

/// The middle of the sector that looks most like a wake \[deg\], and its contrast to the sea.
fn wedge(profile: &Option<Vec<f64>>) -> Option<(i64, f64)> {
    let profile = profile.as_ref()?;
    let mut sorted = profile.clone();
    sorted.sort_by(f64::total_cmp);
    let quantile = |q: f64| sorted[(q * (sorted.len() - 1) as f64) as usize];
    let (sea, brightest) = (quantile(0.4), quantile(0.97));
    if brightest - sea < 1e-6 {
        return None;
    }
    let scaled: Vec<f64> = profile
        .iter()
        .map(|v| ((v - sea) / (brightest - sea)).clamp(-0.3, CAP))
        .collect();
    let mean = |values: &[f64], middle: i64, from: i64, to: i64| {
        let at = |d: i64| values[(middle + d).rem_euclid(RAYS) as usize];
        (from..=to).map(at).sum::<f64>() / (to - from + 1) as f64
    };
    let score = |c: i64| {
        let (inner, outer) = (HALF_WEDGE - GAP, HALF_WEDGE + GAP);
        let sides = mean(&scaled, c, -HALF_WEDGE - BESIDE, -outer)
            + mean(&scaled, c, outer, HALF_WEDGE + BESIDE);
        let arms = mean(&scaled, c, -inner, -inner + ARM) + mean(&scaled, c, inner - ARM, inner);
        arms - sides + 0.5 * mean(&scaled, c, -inner, inner)
    };
    let best = (0..RAYS).max_by(|&a, &b| score(a).total_cmp(&score(b)))?;
    Some((best, contrast(profile, best)))
}

/// Mean of the wedge above the mean of all beyond twice its half-width, in standard deviations of the latter.
fn contrast(profile: &[f64], middle: i64) -> f64 {
    let values = |from: i64, to: i64| {
        (from..=to).map(move |d| profile[(middle + d).rem_euclid(RAYS) as usize])
    };
    let mean = |values: &mut dyn Iterator<Item = f64>| {
        let (sum, count) = values.fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
        sum / count
    };
    let sea = || values(2 * HALF_WEDGE, RAYS - 2 * HALF_WEDGE);
    let level = mean(&mut sea());
    let std = mean(&mut sea().map(|v| (v - level).powi(2))).sqrt();
    let wake = mean(&mut values(-HALF_WEDGE, HALF_WEDGE));
    ((wake - level) / std.max(1e-6)).max(0.0)
}
