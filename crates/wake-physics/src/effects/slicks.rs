//! Slicks: bands of damped Bragg waves.

use super::effect::{Effect, NOT_ASKED_FOR, Site, Weight};
use crate::linear::Amplitudes;
use crate::models::Models;
use crate::raster::Field;
use crate::scene::{Scene, Term};
use crate::slicks::{STRONGEST_WIND, Slicks};
use crate::workspace::Workspace;

#[derive(Debug)]
pub(crate) struct SlickBands {
    slicks: Slicks,
    absent: Option<&'static str>,
}

impl SlickBands {
    pub(super) fn new(scene: &Scene, _: &Models) -> Self {
        let sea = &scene.sea;
        Self {
            slicks: Slicks {
                damping: sea.slick_damping,
                width: sea.slick_width,
                scale: sea.slick_scale,
            },
            absent: match sea.slick_damping > 0.0 {
                false => Some(NOT_ASKED_FOR),
                true if sea.wind_speed <= STRONGEST_WIND => None,
                true => Some("the wind breaks up slicks"),
            },
        }
    }
}

impl Effect for SlickBands {
    fn term(&self) -> Term {
        Term::Slicks
    }

    fn weigh(&self, _: &Models, amplitudes: &Amplitudes<'_>) -> Weight {
        Weight {
            absent: self.absent,
            estimate: self.slicks.damping * amplitudes.first.modulation.bragg_share,
        }
    }

    fn damp(&self, site: &Site<'_>, _: &mut Workspace, remaining: &mut Option<Field>) {
        let (wind, seed) = (site.scene.sea.wind_speed, site.scene.seed);
        let mut bands = self.slicks.strip(&site.whole, &site.rows(), wind, seed);
        if let Some(before) = remaining.take() {
            for (value, before) in bands.values.iter_mut().zip(&before.values) {
                *value *= before;
            }
        }
        *remaining = Some(bands);
    }
}
