//! Winds that make the sea as bright as an image, ordered by the likelihood of its texture.

use super::expected::ExpectedImage;
use super::noise::Noise;
use super::observed::Observed;
use crate::error::Result;
use crate::measure::{axis_between, mean_intensity};
use crate::numeric::root;
use crate::raster::Field;
use crate::scene::Scene;
use rayon::prelude::*;

/// Number of directions, evenly around the circle.
const DIRECTIONS: usize = 12;

/// Wind speeds [m/s] between which the brightness is bisected, and number of bisections; below some 3 m/s the brightness falls
/// with the wind.
const SPEEDS: [f64; 8] = [2.0, 2.5, 3.0, 4.0, 6.0, 9.0, 12.0, 16.0];
const BISECTIONS: usize = 9;

/// A wind, with the mean image and the noise of its open sea.
pub(super) struct Wind {
    /// Scene without ships.
    pub(super) open: Scene,
    pub(super) mean: Field,
    pub(super) noise: Noise,
    pub(super) log_likelihood: f64,
}

/// Drop in log-likelihood from the likeliest wind beyond which a wind is not followed (chosen).
const HOPELESS: f64 = 100.0;

/// The `most` likeliest winds whose axes are at least `apart` degrees apart, as opposite winds make almost the same wake.
pub(super) fn likely(winds: &[Wind], apart: f64, most: usize) -> Vec<&Wind> {
    let mut kept: Vec<&Wind> = Vec::new();
    for wind in winds {
        let hopeless = wind.log_likelihood < winds[0].log_likelihood - HOPELESS;
        let toward = wind.open.sea.wind_toward;
        let near = |w: &&Wind| axis_between(w.open.sea.wind_toward, toward).abs() < apart;
        if kept.len() < most && !hopeless && !kept.iter().any(near) {
            kept.push(wind);
        }
    }
    kept
}

/// Winds of all directions, each with the speed that gives the brightness of the image, in descending order of likelihood.
///
/// - `bright`: mean intensity of the sea and standard deviation of its logarithm; `None` for an uncalibrated image, which keeps
///   the wind speed of the scene
pub(super) fn winds(
    observed: &Observed,
    scene: &Scene,
    bright: Option<[f64; 2]>,
) -> Result<Vec<Wind>> {
    let one = |n: usize| -> Result<Wind> {
        let mut open = scene.clone();
        open.ships.clear();
        open.sea.wind_toward += 360.0 * n as f64 / DIRECTIONS as f64;
        if let Some([bright, _]) = bright {
            open.sea.wind_speed = as_bright(&open, bright)?;
        }
        let mean = ExpectedImage::new(&open, &[])?.intensity(&open)?;
        let noise = Noise::new(&open)?;
        // In some directions no wind is as bright as the image.
        let off = bright.map_or(0.0, |[_, deviation]| observed.gain(&mean).ln() / deviation);
        Ok(Wind {
            log_likelihood: observed.log_likelihood_of(&noise, &mean) - 0.5 * off * off,
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

/// Largest wind speed that gives the brightness, or else the tabulated speed that comes nearest.
fn as_bright(scene: &Scene, bright: f64) -> Result<f64> {
    scene.validate()?;
    let over = |speed: f64| {
        let mut scene = scene.clone();
        scene.sea.wind_speed = speed;
        mean_intensity(&scene) - bright
    };
    let off = SPEEDS.map(over);
    let crossed = (1..SPEEDS.len())
        .rev()
        .find(|&n| off[n - 1] <= 0.0 && off[n] > 0.0);
    if let Some(n) = crossed {
        return Ok(root(over, [SPEEDS[n - 1], SPEEDS[n]], BISECTIONS));
    }
    let nearest = (0..SPEEDS.len()).min_by(|&a, &b| off[a].abs().total_cmp(&off[b].abs()));
    Ok(nearest.map_or(SPEEDS[0], |n| SPEEDS[n]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Thermal noise half as bright as the sea: the wind toward the true direction keeps its speed.
    #[test]
    fn noise_is_not_wind() {
        let keys = [
            "grid.rows=64",
            "grid.columns=64",
            "sea.wind_speed=6",
            "model.tolerance=1e-2",
        ];
        let mut sea = Scene::default().with_assignments(&keys).unwrap();
        sea.ships.clear();
        let clear = ExpectedImage::new(&sea, &[])
            .unwrap()
            .intensity(&sea)
            .unwrap();
        sea.radar.nesz = Some(10.0 * (0.5 * clear.mean()).log10());
        let noisy = ExpectedImage::new(&sea, &[])
            .unwrap()
            .intensity(&sea)
            .unwrap();
        assert!((noisy.mean() / clear.mean() - 1.5).abs() < 1e-3);
        let bright = noisy.mean();
        let observed = Observed::new(noisy, &sea, |_, _| 1.0);
        let winds = winds(&observed, &sea, Some([bright, 0.03])).unwrap();
        let same = |wind: &&Wind| (wind.open.sea.wind_toward - sea.sea.wind_toward).abs() < 1.0;
        let found = winds.iter().find(same).unwrap().open.sea.wind_speed;
        // The mean cross-section has two digits: 0.1 dB, some 0.1 m/s. Noise taken for wind would be 1.8 dB.
        assert!((found - 6.0).abs() < 0.2, "{found}");
    }
}
