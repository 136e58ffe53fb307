//! Covariance of sea and speckle, with its derivatives by the wind.

use super::noise::Noise;
use super::parameter::Parameter;
use super::value::Value;
use crate::error::Result;
use crate::measure::angle_between;
use crate::raster::Field;
use crate::scene::Scene;
use rayon::prelude::*;
use std::sync::{Arc, Mutex, PoisonError};

/// Covariance of the noise and its derivatives.
#[derive(Debug, Clone)]
pub(super) struct Texture {
    pub(super) noise: Noise,
    /// Parameter, noise one step away, and step.
    slopes: Vec<(Parameter, Noise, f64)>,
    /// Wind speed \[m/s\] and direction \[deg\] of the sea.
    wind: [f64; 2],
}

impl Texture {
    /// # Errors
    ///
    /// As [`Noise::new`].
    pub(super) fn new(scene: &Scene, parameters: &[Parameter]) -> Result<Self> {
        let slope = |&parameter: &Parameter| -> Option<Result<_>> {
            let Parameter::Value(value) = parameter else {
                return None;
            };
            if !is_of_wind(&parameter) {
                return None;
            }
            // The spectrum is on an image's lattice, so steps may be larger than those of the mean.
            let step = 2.0 * value.step(scene);
            let moved = Noise::new(&value.moved(scene, step));
            Some(moved.map(|moved| (parameter, moved, step)))
        };
        Ok(Self {
            wind: wind_of(scene),
            noise: Noise::new(scene)?,
            slopes: parameters
                .par_iter()
                .filter_map(slope)
                .collect::<Result<Vec<_>>>()?,
        })
    }

    /// True if it has derivatives by all wind parameters among those given.
    fn has_slopes(&self, parameters: &[Parameter]) -> bool {
        let known = |parameter: &Parameter| self.slopes.iter().any(|s| s.0 == *parameter);
        parameters.iter().filter(|p| is_of_wind(p)).all(known)
    }

    /// Distance to the wind of a scene: relative change of the speed, and change of the direction \[deg\].
    fn to(&self, scene: &Scene) -> [f64; 2] {
        let [speed, toward] = wind_of(scene);
        let turned = angle_between(toward, self.wind[1]);
        [speed / self.wind[0] - 1.0, turned]
    }

    /// The texture with the wind of a scene, to first order.
    fn moved(&self, scene: &Scene) -> Self {
        let [faster, turned] = self.to(scene);
        let mut moved = self.clone();
        for (parameter, there, step) in &self.slopes {
            let by = match parameter {
                Parameter::Value(Value::WindSpeed) => faster * self.wind[0],
                _ => turned,
            };
            let part = (by / step) as f32;
            moved.noise.add_change(part, &self.noise, there);
            for (_, noise, _) in &mut moved.slopes {
                noise.add_change(part, &self.noise, there);
            }
        }
        moved.wind = wind_of(scene);
        moved
    }

    /// Derivative of the covariance by each parameter, `None` where it is not a parameter of the noise.
    pub(super) fn slopes(&self, parameters: &[Parameter], factor: f64) -> Vec<Option<Field>> {
        let of = |parameter: &Parameter| {
            if *parameter == Parameter::Texture {
                return Some(self.noise.by_factor(factor));
            }
            let found = self.slopes.iter().find(|s| s.0 == *parameter)?;
            let (_, moved, width) = found;
            let mut slope = moved.covariance(factor);
            let here = self.noise.covariance(factor);
            for (a, b) in slope.values.iter_mut().zip(&here.values) {
                *a = (*a - b) / *width as f32;
            }
            Some(slope)
        };
        parameters.iter().map(of).collect()
    }
}

fn wind_of(scene: &Scene) -> [f64; 2] {
    [scene.sea.wind_speed, scene.sea.wind_toward]
}

fn is_of_wind(parameter: &Parameter) -> bool {
    matches!(parameter, Parameter::Value(value) if !value.is_of_ship())
}

/// Relative change of the wind speed and change of its direction \[deg\] within which a texture is extrapolated (chosen): the
/// error of its power is then about 0.2 %, at most 0.3 %.
const NEAR: [f64; 2] = [0.02, 2.0];

/// Cache of the textures of all seas so far.
#[derive(Debug, Default)]
pub(super) struct Textures(Mutex<Vec<Arc<Texture>>>);

impl Textures {
    /// Texture of a scene's sea, extrapolated from a nearby sea if there is one.
    ///
    /// - `farther`: largest distance of the wind for extrapolation, in units of [`NEAR`]
    pub(super) fn of(
        &self,
        scene: &Scene,
        parameters: &[Parameter],
        farther: f64,
    ) -> Result<Arc<Texture>> {
        let distance = |texture: &Texture| {
            let to = texture.to(scene);
            (to[0] / NEAR[0]).abs().max((to[1] / NEAR[1]).abs())
        };
        let known = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let near = known()
            .iter()
            .filter(|texture| texture.has_slopes(parameters))
            .min_by(|a, b| distance(a).total_cmp(&distance(b)))
            .cloned();
        if let Some(near) = near {
            let extrapolated = !near.slopes.is_empty();
            match distance(&near) {
                0.0 => return Ok(near),
                far if far < farther && extrapolated => return Ok(Arc::new(near.moved(scene))),
                _ => {}
            }
        }
        let new = Arc::new(Texture::new(scene, parameters)?);
        known().push(Arc::clone(&new));
        Ok(new)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At half the distance, the error of the extrapolation is about a quarter.
    #[test]
    fn textures_of_winds_nearby_are_extrapolated() {
        let keys = ["grid.rows=96", "grid.columns=96", "sea.wind_speed=5"];
        let scene = Scene::default().with_assignments(&keys).unwrap();
        let parameters = Parameter::OF_WAKE;
        let textures = Textures::default();
        let first = textures.of(&scene, &parameters, 1.0).unwrap();
        let off = |part: f64| {
            let mut other = scene.clone();
            other.sea.wind_speed *= 1.0 + 0.99 * part * NEAR[0];
            other.sea.wind_toward += 0.99 * part * NEAR[1];
            let found = textures.of(&other, &parameters, 1.0).unwrap();
            let exact = Noise::new(&other).unwrap().sea();
            let difference = |from: &Noise| from.sea().difference(&exact).0;
            assert!(difference(&found.noise) < 0.2 * difference(&first.noise));
            difference(&found.noise) / f64::from(exact.values[0])
        };
        let [far, near] = [1.0, 0.5].map(off);
        assert!(far < 3e-3 && near < 0.35 * far, "{far:e} {near:e}");
        assert_eq!(textures.0.lock().unwrap().len(), 1);
        // Beyond that distance the texture is computed.
        let mut other = scene;
        other.sea.wind_speed *= 1.0 + 1.1 * NEAR[0];
        textures.of(&other, &parameters, 1.0).unwrap();
        assert_eq!(textures.0.lock().unwrap().len(), 2);
    }
}
