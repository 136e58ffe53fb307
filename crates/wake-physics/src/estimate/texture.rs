//! Covariance of sea and speckle with its derivatives by the wind.

use super::noise::Noise;
use super::parameter::Parameter;
use crate::error::Result;
use crate::raster::Field;
use crate::scene::Scene;
use rayon::prelude::*;

/// Covariance of the noise and its derivatives.
#[derive(Debug)]
pub(super) struct Texture {
    pub(super) noise: Noise,
    /// Derivative of the covariance by parameter, at a factor of 1.
    slopes: Vec<(Parameter, Noise, f64)>,
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
            if value.is_of_ship() {
                return None;
            }
            // The spectrum is on an image's lattice, so steps may be larger than those of the mean.
            let step = 2.0 * value.step(scene);
            let moved = Noise::new(&value.moved(scene, step));
            Some(moved.map(|moved| (parameter, moved, step)))
        };
        Ok(Self {
            noise: Noise::new(scene)?,
            slopes: parameters
                .par_iter()
                .filter_map(slope)
                .collect::<Result<Vec<_>>>()?,
        })
    }

    /// Derivatives of the covariance.
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
