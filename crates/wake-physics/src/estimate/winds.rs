//! Winds that make the sea as bright as an image, ordered by the likelihood of its texture.

use super::expected::ExpectedImage;
use super::noise::Noise;
use super::observed::Observed;
use crate::error::Result;
use crate::measure::{axis_between, mean_sigma0};
use crate::numeric::root;
use crate::raster::Field;
use crate::scene::Scene;
use rayon::prelude::*;

/// Number of directions, evenly around the circle.
const DIRECTIONS: usize = 12;

/// Range of the wind speed [m/s], and bisections of it.
const SPEEDS: [f64; 2] = [2.0, 16.0];
const BISECTIONS: usize = 12;

/// A wind, with the mean image and the noise of its open sea.
pub(super) struct Wind {
    /// Scene without ships.
    pub(super) open: Scene,
    pub(super) mean: Field,
    pub(super) noise: Noise,
    pub(super) log_likelihood: f64,
}

/// Log-likelihood below that of the likeliest wind from which a wind is not followed, and number of followed winds (chosen).
const HOPELESS: f64 = 50.0;
const FOLLOWED: usize = 3;

/// The likeliest winds of different axes: opposite winds draw almost the same wake.
pub(super) fn likely(winds: &[Wind]) -> Vec<&Wind> {
    let mut kept: Vec<&Wind> = Vec::new();
    for wind in winds {
        let hopeless = wind.log_likelihood < winds[0].log_likelihood - HOPELESS;
        let toward = wind.open.sea.wind_toward;
        let near = |w: &&Wind| axis_between(w.open.sea.wind_toward, toward).abs() < 45.0;
        if kept.len() < FOLLOWED && !hopeless && !kept.iter().any(near) {
            kept.push(wind);
        }
    }
    kept
}

/// Winds of all directions, each with the speed that gives the brightness of the image, the likeliest first.
///
/// - `bright`: mean intensity of the sea; `None` for an uncalibrated image, whose wind speed is that of the scene
pub(super) fn winds(observed: &Observed, scene: &Scene, bright: Option<f64>) -> Result<Vec<Wind>> {
    let one = |n: usize| -> Result<Wind> {
        let mut open = scene.clone();
        open.ships.clear();
        open.sea.wind_toward += 360.0 * n as f64 / DIRECTIONS as f64;
        if let Some(bright) = bright {
            open.sea.wind_speed = as_bright(&open, bright)?;
        }
        let mean = ExpectedImage::new(&open, &[])?.intensity(&open)?;
        let noise = Noise::new(&open)?;
        Ok(Wind {
            log_likelihood: observed.log_likelihood_of(&noise, &mean),
            open,
            mean,
            noise,
        })
    };
    let all = (0..DIRECTIONS).into_par_iter().map(one);
    let mut winds = all.collect::<Result<Vec<_>>>()?;
    winds.sort_by(|a, b| b.log_likelihood.total_cmp(&a.log_likelihood));
    Ok(winds)
}

/// Wind speed that gives the brightness, or the nearest end of the range.
fn as_bright(scene: &Scene, bright: f64) -> Result<f64> {
    scene.validate()?;
    let over = |speed: f64| {
        let mut scene = scene.clone();
        scene.sea.wind_speed = speed;
        mean_sigma0(&scene).map_or(f64::NAN, |sigma0| sigma0 - bright)
    };
    Ok(match over(SPEEDS[0]) > 0.0 {
        true => SPEEDS[0],
        false => root(over, SPEEDS, BISECTIONS),
    })
}
