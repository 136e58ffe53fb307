//! The echo of the ship that leaves a wake: displaced along azimuth by its radial velocity.

use serde::Serialize;
use wake_detector::Wake;
use wake_geo::{Product, Values};

/// A ship's echo.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Echo {
    /// Line of its middle.
    pub line: f64,
    /// Pixel of its middle.
    pub pixel: f64,
    /// Latitude of the place where it is imaged \[degrees\].
    pub latitude: f64,
    /// Longitude of the place where it is imaged \[degrees\].
    pub longitude: f64,
    /// How far it lies from the wake along azimuth, in the direction of flight \[m\]; `None` for a wake along azimuth.
    pub displacement: Option<f64>,
    /// Velocity toward the radar that the displacement means \[m/s\].
    pub radial_velocity: Option<f64>,
}

/// Fastest ship that is looked for \[m/s\].
const FASTEST: f64 = 18.0;
/// Pixels to both sides of the tip in which the echo is looked for.
const ASIDE: i64 = 24;
/// An echo is brighter than the sea by this factor.
const BRIGHT: f32 = 8.0;
/// Pixels around the brightest one that belong to it.
const REACH: i64 = 12;
/// Axes closer to azimuth than this say nothing about displacements: sine of the angle.
const ALONG_AZIMUTH: f64 = 0.25;

/// The echo that belongs to a wake, if there is one.
pub(crate) fn echo(product: &Product, wake: &Wake) -> Option<Echo> {
    if product.values() != Values::SigmaNought {
        return None;
    }
    let (lines, pixels) = product.size();
    let [tip_pixel, tip_line] = wake.tip.map(f64::from);
    let clamped = |value: f64, size: usize| value.round().clamp(0.0, size as f64 - 1.0);
    let (at_line, at_pixel) = (clamped(tip_line, lines), clamped(tip_pixel, pixels));
    let ratio = product.range_to_velocity(at_line, at_pixel).ok()??;
    let axes = product.axes(at_line, at_pixel).ok()?;
    let place = product.place(at_line, at_pixel).ok()?;
    let fastest = FASTEST * place.incidence?.to_radians().sin();
    let along = (ratio * fastest / axes.line_spacing).ceil() as i64;
    let range = |middle: f64, reach: i64, size: usize| {
        let middle = middle as i64;
        (middle - reach).max(0) as usize..(middle + reach + 1).clamp(0, size as i64) as usize
    };
    let (rows, columns) = (range(at_line, along, lines), range(at_pixel, ASIDE, pixels));
    let window = product.read_window(rows.clone(), columns.clone()).ok()?;
    let mut sorted: Vec<f32> = window
        .values
        .iter()
        .copied()
        .filter(|v| v.is_finite())
        .collect();
    if sorted.is_empty() {
        return None;
    }
    let middle = sorted.len() / 2;
    let sea = *sorted.select_nth_unstable_by(middle, f32::total_cmp).1;
    let width = columns.len();
    // Of several bright places the one that is brightest for its distance from the tip.
    let score = |n: usize| {
        let value = window.values[n];
        let [row, column] = [n / width, n % width].map(|x| x as f64);
        let aside = (column + columns.start as f64 - tip_pixel) / ASIDE as f64;
        let away = (row + rows.start as f64 - tip_line) / along as f64;
        f64::from(value) / (1.0 + aside * aside + away * away)
    };
    let bright = (0..window.values.len()).filter(|&n| window.values[n] > BRIGHT * sea);
    let peak = bright.max_by(|&a, &b| score(a).total_cmp(&score(b)))?;
    // The middle of what is bright around it.
    let (row, column) = ((peak / width) as i64, (peak % width) as i64);
    let (mut total, mut line, mut pixel) = (0.0, 0.0, 0.0);
    for r in (row - REACH).max(0)..(row + REACH + 1).min(rows.len() as i64) {
        for c in (column - REACH).max(0)..(column + REACH + 1).min(width as i64) {
            let value = window.line(r as usize)[c as usize];
            if value > 0.5 * BRIGHT * sea {
                let weight = f64::from(value - sea);
                total += weight;
                line += weight * (r as usize + rows.start) as f64;
                pixel += weight * (c as usize + columns.start) as f64;
            }
        }
    }
    let (line, pixel) = (line / total, pixel / total);
    let there = product.place(line, pixel).ok()?;
    let [right, down] = wake.direction().map(f64::from);
    // Where the axis of the wake crosses the echo's range.
    let displacement = (right.abs() > ALONG_AZIMUTH).then(|| {
        let on_axis = tip_line + (pixel - tip_pixel) * down / right;
        (line - on_axis) * axes.line_spacing
    });
    Some(Echo {
        line,
        pixel,
        latitude: there.latitude,
        longitude: there.longitude,
        displacement,
        radial_velocity: displacement.map(|metres| metres / ratio),
    })
}
