//! Stage of the edges of a turbulent wake: an approximation against the integral along the history of the waves.

use super::oracle::{QUADRATURES, RUNS, row, sample};
use crate::bench::row::{Errors, Row, median_seconds, seconds};
use rayon::prelude::*;
use wake_physics::scattering::breaking;
use wake_physics::turbulent::current::{EdgeResponse, WakeCurrent, WakeEdge, edge_factor};
use wake_physics::{Field, Raster, Track};

/// Size of a pixel \[m\].
const PIXEL: f64 = 10.0;
/// Share of σ⁰ from breaking waves, as behind a wake at VV; wind speed [m/s]; ratio of response to relaxation time.
const SHARE: f64 = 0.2;
const WIND: f64 = 5.0;
const CHANGE_OF_BREAKING: f64 = 13.5;

/// Edges of a turbulent wake: breaking waves in equilibrium with the local current, against the integral over the
/// current that they met since the ship passed, at pixels near the track.
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

/// ∫ f from 0 to `end`, by Simpson's rule with 1,000 steps.
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
