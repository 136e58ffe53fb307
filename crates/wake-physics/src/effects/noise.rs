//! Thermal noise of the radar.

use super::effect::{Effect, NOT_ASKED_FOR, Weight};
use crate::linear::Amplitudes;
use crate::models::Models;
use crate::raster::Field;
use crate::scene::{Scene, Term};
use rayon::prelude::*;

#[derive(Debug)]
pub(crate) struct Noise {
    /// Noise-equivalent σ⁰, 0 without noise.
    pub(crate) sigma0: f64,
}

impl Noise {
    pub(super) fn new(scene: &Scene, _: &Models) -> Self {
        let nesz = scene.radar.nesz;
        Self {
            sigma0: nesz.map_or(0.0, |db| 10f64.powf(0.1 * db)),
        }
    }
}

impl Effect for Noise {
    fn term(&self) -> Term {
        Term::Noise
    }

    fn weigh(&self, _: &Models, amplitudes: &Amplitudes<'_>) -> Weight {
        Weight {
            absent: (self.sigma0 <= 0.0).then_some(NOT_ASKED_FOR),
            estimate: amplitudes.first.over_mean(self.sigma0),
        }
    }

    fn add_to_image(&self, intensity: &mut Field) {
        let noise = self.sigma0 as f32;
        let pixels = intensity.values.par_iter_mut().with_min_len(1 << 14);
        pixels.for_each(|value| *value += noise);
    }
}
