//! Stage of the impulse response of a satellite image.

use super::oracle::{QUADRATURES, RUNS, at_pixels, sample};
use super::surface::fields;
use crate::bench::row::{Row, median_seconds, seconds};
use rayon::prelude::*;
use wake_physics::sar::ImpulseResponse;
use wake_physics::sar::impulse::{Axis, PointTarget, Reflectivity};
use wake_physics::waves::Quantity;
use wake_physics::window::Window;
use wake_physics::{Field, Raster};

/// Pixel spacing of the image, with two sources per pixel, and resolution along both axes \[m\].
const PIXEL: f64 = 10.0;
const RESOLUTION: f64 = 20.0;
/// Number of sources in the direct sum, over all pixels.
const SCATTERERS: usize = 1 << 29;
/// Margin of the direct sum around the image, relative to the fast method's.
const FARTHER: usize = 4;

/// Mean image through the impulse response by FFTs, against the sum over scatterers with the closed-form response,
/// which includes scatterers four times as far beyond the image.
pub(crate) fn response(size: usize) -> Row {
    let axis = Axis {
        resolution: RESOLUTION,
        window: Window::Hamming(0.75),
    };
    let response = ImpulseResponse {
        range: axis,
        azimuth: axis,
    };
    let image = Raster::image(size, size, PIXEL);
    let spacing = 0.5 * PIXEL;
    let fine = Raster::image(2 * size, 2 * size, spacing);
    let [rows, columns] = response.guard(spacing);
    let near = fine.with_margin(rows, columns);
    let far = fine.with_margin(FARTHER * rows, FARTHER * columns);
    let slope = fields(&far, &[Quantity::SlopeX]).swap_remove(0);
    let all = Field::from_fn(&far, |i, j| 0.03 * (5.0 * slope.at(i, j)).exp());
    let more = FARTHER - 1;
    let seen = Field::from_fn(&near, |i, j| all.at(i + more * rows, j + more * columns));
    let ship = PointTarget {
        position: [3.1, -42.7],
        cross_section: 1e3,
    };
    let sources = Reflectivity {
        raster: &near,
        intensity: &seen,
        points: &[ship],
    };
    let (fast_seconds, mean) = median_seconds(RUNS, || response.mean(&sources, &image));
    let pixels = sample(&image, (SCATTERERS / far.len()).min(QUADRATURES));
    // |h|²Δ/∫|h|² of one axis.
    let weight = |distance: f64| {
        let gain = 10f64.powf(-0.1 * axis.window.loss()) * axis.bandwidth() * spacing;
        gain * axis.window.response(distance * axis.bandwidth()).powi(2)
    };
    let power = ship.cross_section / (spacing * spacing);
    let (oracle, exact) = seconds(|| -> Vec<f64> {
        let of_pixel = |&[i, j]: &[usize; 2]| {
            let [x, y] = [image.x(j), image.y(i)];
            let along: Vec<f64> = (0..far.columns).map(|c| weight(x - far.x(c))).collect();
            let of_row = |(r, row): (usize, &[f32])| {
                let values = row.iter().zip(&along).map(|(&v, w)| f64::from(v) * w);
                weight(y - far.y(r)) * values.sum::<f64>()
            };
            let rows = all.values.chunks(far.columns).enumerate();
            let point = weight(x - ship.position[0]) * weight(y - ship.position[1]);
            power * point + rows.map(of_row).sum::<f64>()
        };
        pixels.par_iter().map(of_pixel).collect()
    });
    let (fast, place) = ((fast_seconds, &mean), (&image, None));
    at_pixels("response", place, fast, (oracle, &exact), &pixels)
}
