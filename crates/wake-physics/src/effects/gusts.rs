//! Gusts and eddies of the wind: fields of wind speed that σ⁰ follows.

use super::effect::{Effect, NOT_ASKED_FOR, Site, Weight};
use crate::gusts::{GustKind, Gusts, wind_exponent};
use crate::linear::Amplitudes;
use crate::models::Models;
use crate::raster::Field;
use crate::scene::{Scene, Term};
use std::sync::OnceLock;

#[derive(Debug)]
pub(crate) struct GustField {
    /// Gusts and eddies of non-zero strength, each with its coarse field and pixel step, drawn with the first strip.
    gusts: Vec<(Gusts, OnceLock<(Field, usize)>)>,
    /// Exponent of the wind speed in σ⁰.
    exponent: f64,
}

impl GustField {
    pub(super) fn new(scene: &Scene, _: &Models) -> Self {
        let sea = &scene.sea;
        let of = |kind, strength, scale| Gusts {
            kind,
            strength,
            scale,
            wind_toward: sea.wind_toward.rem_euclid(360.0).to_radians(),
        };
        let both = [
            of(GustKind::Gusts, sea.gust_strength, sea.gust_scale),
            of(GustKind::Mottle, sea.mottle_strength, sea.mottle_scale),
        ];
        let drawn = both.into_iter().filter(|gusts| gusts.strength > 0.0);
        Self {
            gusts: drawn.map(|gusts| (gusts, OnceLock::new())).collect(),
            exponent: wind_exponent(scene.radar.frequency),
        }
    }
}

impl GustField {
    /// Cost of the wind fields, in interpolated fields; the FFTs of a field drawn at every pixel take five times as long
    /// and as much memory.
    ///
    /// - `spacing` of the computed pixels \[m\]
    pub(crate) fn patterns(&self, spacing: f64) -> f64 {
        let of = |gusts: &Gusts| match gusts.kind {
            GustKind::Mottle => 1.0 + 5.0 / (gusts.step(spacing) as f64).powi(2),
            _ => 1.0,
        };
        self.gusts.iter().map(|(gusts, _)| of(gusts)).sum()
    }
}

impl Effect for GustField {
    fn term(&self) -> Term {
        Term::Gusts
    }

    fn weigh(&self, _: &Models, amplitudes: &Amplitudes<'_>) -> Weight {
        let strengths = self.gusts.iter().map(|(gusts, _)| gusts.strength);
        let strength = strengths.fold(0.0, f64::hypot);
        Weight {
            absent: self.gusts.is_empty().then_some(NOT_ASKED_FOR),
            estimate: self.exponent * strength * amplitudes.with_contrast(),
        }
    }

    fn change_sigma0(&self, site: &Site<'_>, sigma0: &mut Field, _: Option<&Field>) {
        for (gusts, drawn) in &self.gusts {
            let draw = || gusts.coarse_field(&site.whole, site.scene.seed);
            gusts.modulate_strip(
                sigma0,
                site.first_row,
                drawn.get_or_init(draw),
                self.exponent,
            );
        }
    }
}
