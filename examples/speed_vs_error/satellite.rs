//! The stages of an image as a satellite delivers it: impulse response, waves that pixels do not carry, swell, edges.

use crate::row::{Errors, Row, median_seconds, seconds};
use crate::stages::{
    Memo, QUADRATURES, QUANTITIES, RUNS, TRANSFER, backscatter_model, fields, row, sample, sum,
    wake,
};
use rayon::prelude::*;
use wake_physics::sar::ImpulseResponse;
use wake_physics::sar::impulse::{Axis, PointTarget, Reflectivity};
use wake_physics::scattering::{BackscatterTable, FacetFields, breaking};
use wake_physics::swell::Swell;
use wake_physics::turbulent::current::{EdgeResponse, WakeCurrent, WakeEdge, edge_factor};
use wake_physics::waves::Quantity;
use wake_physics::window::Window;
use wake_physics::{Field, Raster, Track, nufft};

/// Pixels of the image, two sources a pixel, and the resolution along both axes \[m\].
const PIXEL: f64 = 10.0;
const RESOLUTION: f64 = 20.0;
/// Sources that the direct sum over the response looks at, over all pixels.
const SCATTERERS: usize = 1 << 29;
/// How much farther from the image the direct sum looks than the fast method.
const FARTHER: usize = 4;

/// Mean square slope of waves that pixels do not carry, times the distance astern, and its largest \[m\], \[1\]: of the
/// size of a ship of 195 m on pixels of 2.5 m.
const ROUGHNESS: f64 = 2.0;
const ROUGHEST: f64 = 0.02;

/// Share of σ⁰ from breaking waves, as behind a wake at VV, the wind [m/s], and the response over the time of relaxation.
const SHARE: f64 = 0.2;
const WIND: f64 = 5.0;
const CHANGE_OF_BREAKING: f64 = 13.5;

/// Swell on the non-uniform FFT, its draw included, against the harmonic sum.
pub(crate) fn swell(raster: &Raster, tolerance: f64) -> Row {
    let swell = Swell {
        height: 2.0,
        wavelength: 200.0,
        toward: 1.0,
    };
    let draw = || {
        swell.waves(
            (7, 0.0),
            f64::INFINITY,
            std::f64::consts::PI / raster.spacing,
        )
    };
    let fast = || nufft::synthesize(&draw(), &TRANSFER, &QUANTITIES, raster, tolerance);
    sum("swell", raster, tolerance, &draw(), fast)
}

/// The mean image through the response by FFTs against the sum over scatterers with its closed form, which looks four times
/// as far beyond the image.
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
    let values = pixels.iter().map(|&[i, j]| f64::from(mean.at(i, j)));
    let errors = Errors::of(values, &exact, mean.mean());
    let scale = image.len() as f64 / pixels.len() as f64;
    let oracle = (oracle * scale, pixels.len());
    row("response", &image, None, fast_seconds, oracle, errors)
}

/// σ⁰ where waves of a ship roughen the sea that pixels do not carry: means over nodes of the table against quadrature over
/// all slopes, at pixels that have any.
pub(crate) fn unresolved(raster: &Raster, tolerance: f64, memo: &mut Memo) -> Row {
    let slopes = fields(raster, &[Quantity::SlopeX, Quantity::SlopeY]);
    let track = wake().track;
    // Divergent waves, which run away from the track.
    let of_pixel = |i: usize, j: usize| {
        let [ahead, port] = track.seen_from_ship([raster.x(j), raster.y(i)]);
        let variance = if port.abs() < -0.2 * ahead {
            (ROUGHNESS / -ahead).min(ROUGHEST)
        } else {
            0.0
        };
        let [x, y] = track.turned([0.3, 0.91f64.sqrt().copysign(port)]);
        [x * x, x * y, y * y].map(|product| (variance * product) as f32)
    };
    let variances = [0, 1, 2].map(|n| Field::from_fn(raster, |i, j| of_pixel(i, j)[n]));
    let facets = FacetFields {
        unresolved: Some(&variances),
        ..FacetFields::of_slopes(&slopes[0], &slopes[1])
    };
    let model = backscatter_model(raster.spacing);
    let mean: f64 = model.parts([0.0, 0.0]).iter().sum();
    let (fast_seconds, sigma0) = median_seconds(RUNS, || {
        BackscatterTable::covering(model.clone(), &facets, tolerance * mean).sigma0_field(&facets)
    });
    let rough = |&[i, j]: &[usize; 2]| variances[0].at(i, j) + variances[2].at(i, j) > 0.0;
    let all = sample(raster, 16 * QUADRATURES);
    let pixels: Vec<_> = all.into_iter().filter(rough).take(QUADRATURES).collect();
    let oracle = memo.at_size("unresolved", raster.rows, || {
        let (seconds, exact) = seconds(|| model.sigma0_pixels(&facets, &pixels));
        (seconds, exact.into_iter().map(f64::from).collect())
    });
    let values = pixels.iter().map(|&[i, j]| f64::from(sigma0.at(i, j)));
    let errors = Errors::of(values, &oracle.1, sigma0.mean());
    let scale = raster.len() as f64 / pixels.len() as f64;
    let oracle = (oracle.0 * scale, pixels.len());
    row(
        "unresolved",
        raster,
        Some(tolerance),
        fast_seconds,
        oracle,
        errors,
    )
}

/// The edges of a turbulent wake, whose breaking waves are taken to have answered to the current where they are, against the
/// integral over what they met since the ship passed, at pixels near the track.
pub(crate) fn edge(size: usize) -> Row {
    let raster = Raster::image(size, size, PIXEL);
    let k_e = std::f64::consts::TAU * 9.6e9 / 299_792_458.0;
    let breaking = breaking::response_time(k_e, WIND);
    let corner = 0.4 * size as f64 * PIXEL;
    let edge = WakeEdge {
        current: WakeCurrent::of_wind(10.0, 26.0, 0.0, WIND),
        wind: [0.0; 2],
        track: Track::new([corner, corner], 45.0, 0.0),
        length: 195.0,
        response: EdgeResponse::Given(SHARE * breaking),
    };
    let (fast_seconds, sigma0) = median_seconds(RUNS, || {
        let mut sigma0 = Field::constant(&raster, 1.0);
        edge.modulate(&mut sigma0, &raster);
        sigma0
    });
    let changed = |&[i, j]: &[usize; 2]| (sigma0.at(i, j) - 1.0).abs() > 0.0;
    let all = sample(&raster, 256 * QUADRATURES);
    let pixels: Vec<_> = all.into_iter().filter(changed).take(QUADRATURES).collect();
    let rate = CHANGE_OF_BREAKING / breaking;
    let (oracle, exact) = seconds(|| -> Vec<f64> {
        let of_pixel = |&[i, j]: &[usize; 2]| {
            let [forward, port] = edge.track.seen_from_ship([raster.x(j), raster.y(i)]);
            let age = (-forward - 0.5 * edge.length).max(0.0) / edge.current.speed;
            let met = |before: f64| {
                let distance = edge.current.speed * (age - before);
                edge.current.divergence(distance, port) * (-rate * before).exp()
            };
            let shown = wake_physics::kelvin::fade(forward, edge.length);
            edge_factor(rate * simpson(age, met), SHARE * breaking).powf(shown)
        };
        pixels.par_iter().map(of_pixel).collect()
    });
    let values = pixels.iter().map(|&[i, j]| f64::from(sigma0.at(i, j)));
    let errors = Errors::of(values, &exact, 1.0);
    let scale = raster.len() as f64 / pixels.len() as f64;
    let oracle = (oracle * scale, pixels.len());
    row("edge", &raster, None, fast_seconds, oracle, errors)
}

/// ∫ f from 0 to an end, by Simpson's rule on 1,000 steps.
fn simpson(end: f64, f: impl Fn(f64) -> f64) -> f64 {
    let count = 1000;
    let step = end / f64::from(count);
    let weight = |n: i32| match n {
        0 => 1.0,
        n if n == count => 1.0,
        n => 2.0 + 2.0 * f64::from(n % 2),
    };
    let sum: f64 = (0..=count)
        .map(|n| weight(n) * f(step * f64::from(n)))
        .sum();
    step / 3.0 * sum
}
