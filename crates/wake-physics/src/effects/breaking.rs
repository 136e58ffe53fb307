//! Return of breaking waves, damped together with the short waves.

use super::effect::{Effect, NOT_ASKED_FOR, Site, Weight};
use crate::linear::Amplitudes;
use crate::models::Models;
use crate::raster::Field;
use crate::scattering::breaking::backscatter;
use crate::scene::{Scene, Term};
use rayon::prelude::*;

#[derive(Debug)]
pub(crate) struct BreakingWaves {
    /// σ⁰ of breaking waves; 0 unless the scene asks for them.
    pub(crate) sigma0: f64,
}

impl BreakingWaves {
    pub(super) fn new(scene: &Scene, models: &Models) -> Self {
        let sigma0 = match scene.sea.breaking {
            true => backscatter(models.incidence, scene.sea.wind_speed),
            false => 0.0,
        };
        Self { sigma0 }
    }
}

impl Effect for BreakingWaves {
    fn term(&self) -> Term {
        Term::Breaking
    }

    fn weigh(&self, _: &Models, amplitudes: &Amplitudes<'_>) -> Weight {
        Weight {
            absent: (self.sigma0 <= 0.0).then_some(NOT_ASKED_FOR),
            estimate: amplitudes.first.over_mean(self.sigma0),
        }
    }

    fn change_sigma0(&self, _: &Site<'_>, sigma0: &mut Field, remaining: Option<&Field>) {
        let breaking = self.sigma0 as f32;
        let pixels = sigma0.values.par_iter_mut().with_min_len(1 << 14);
        match remaining {
            None => pixels.for_each(|s| *s += breaking),
            Some(left) => pixels
                .zip(&left.values)
                .for_each(|(s, left)| *s += breaking * left),
        }
    }
}
