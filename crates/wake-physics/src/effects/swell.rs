//! Swell: plane waves added to the sea.

use super::effect::{Effect, NOT_ASKED_FOR, Site, Weight};
use crate::linear::Amplitudes;
use crate::models::Models;
use crate::scene::{Scene, Term};
use crate::swell::Swell;
use crate::waves::PlaneWaves;

#[derive(Debug)]
pub(crate) struct SwellWaves {
    swell: Option<Swell>,
}

impl SwellWaves {
    pub(super) fn new(_: &Scene, models: &Models) -> Self {
        Self {
            swell: models.swell,
        }
    }
}

impl Effect for SwellWaves {
    fn term(&self) -> Term {
        Term::Swell
    }

    fn weigh(&self, _: &Models, amplitudes: &Amplitudes<'_>) -> Weight {
        Weight {
            absent: match self.swell {
                None => Some(NOT_ASKED_FOR),
                Some(_) if amplitudes.swell.is_empty() => Some("pixels resolve no swell"),
                Some(_) => None,
            },
            estimate: amplitudes.waves(&amplitudes.swell),
        }
    }

    fn waves(&self, site: &Site<'_>) -> Option<PlaneWaves> {
        let (seed, time) = (site.scene.seed, site.scene.sea.time);
        let band = site.raster.nyquist_wavenumber();
        let waves = |swell: Swell| swell.waves(seed, time, site.models.transfer.depth, band);
        self.swell.map(waves)
    }
}
