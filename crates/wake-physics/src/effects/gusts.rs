//! Gusts: a field of wind speed that σ⁰ follows.

use super::effect::{Effect, NOT_ASKED_FOR, Site, Weight};
use crate::gusts::{Gusts, wind_exponent};
use crate::linear::Amplitudes;
use crate::models::Models;
use crate::raster::Field;
use crate::scene::{Scene, Term};
use std::sync::OnceLock;

#[derive(Debug)]
pub(crate) struct GustField {
    gusts: Gusts,
    /// Exponent of the wind speed in σ⁰.
    exponent: f64,
    /// The field of the whole scene at every few pixels, drawn for the first strip.
    drawn: OnceLock<(Field, usize)>,
}

impl GustField {
    pub(super) fn new(scene: &Scene, _: &Models) -> Self {
        let sea = &scene.sea;
        Self {
            gusts: Gusts {
                strength: sea.gust_strength,
                scale: sea.gust_scale,
                wind_toward: sea.wind_toward.rem_euclid(360.0).to_radians(),
            },
            exponent: wind_exponent(scene.radar.frequency),
            drawn: OnceLock::new(),
        }
    }
}

impl Effect for GustField {
    fn term(&self) -> Term {
        Term::Gusts
    }

    fn weigh(&self, _: &Models, amplitudes: &Amplitudes<'_>) -> Weight {
        Weight {
            absent: (self.gusts.strength <= 0.0).then_some(NOT_ASKED_FOR),
            estimate: self.exponent * self.gusts.strength * amplitudes.with_contrast(),
        }
    }

    fn change_sigma0(&self, site: &Site<'_>, sigma0: &mut Field, _: Option<&Field>) {
        let draw = || self.gusts.coarse_field(&site.whole, site.scene.seed);
        let drawn = self.drawn.get_or_init(draw);
        self.gusts
            .modulate_strip(sigma0, site.first_row, drawn, self.exponent);
    }
}
