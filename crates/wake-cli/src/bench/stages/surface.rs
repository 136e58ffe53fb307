//! Sea and wake on which the stages are measured.

use wake_physics::hull::Hull;
use wake_physics::kelvin::KelvinWake;
use wake_physics::surface::Surface;
use wake_physics::waves::{Quantity, Transfer};
use wake_physics::wind_sea::{DirectionalSpectrum, WindSea};
use wake_physics::{Field, Raster, Scene, Track, reference};

/// Incidence of the default scene [rad].
pub(crate) const INCIDENCE: f64 = 32.0 * std::f64::consts::PI / 180.0;

pub(crate) const TRANSFER: Transfer = Transfer {
    depth: f64::INFINITY,
    incidence: INCIDENCE,
    relaxation_rate: 1.7,
    action_slope: 4.5,
};

pub(crate) fn spectrum() -> DirectionalSpectrum {
    let sea = Scene::default().sea;
    DirectionalSpectrum::new(&WindSea {
        wind_speed: sea.wind_speed,
        wind_toward: sea.wind_toward.to_radians(),
        fetch: sea.fetch,
        depth: sea.depth,
        spectrum: sea.spectrum,
        spreading: sea.spreading,
    })
}

pub(crate) fn wake() -> KelvinWake {
    KelvinWake {
        hull: Hull::wigley(195.0, 26.0, 10.0),
        speed: 10.0,
        track: Track::new([0.0, 0.0], 45.0, 0.0),
        depth: f64::INFINITY,
        filter_depth: 0.0,
        steepness: None,
    }
}

/// Fields of sea and wake together.
pub(crate) fn fields(raster: &Raster, quantities: &[Quantity]) -> Vec<Field> {
    let mut fields = Surface::new(&spectrum(), 7, 0.0, raster).fields(&TRANSFER, quantities, 1e-4);
    let wake = wake();
    let waves = wake.waves(&wake.plan(raster, 1e-4));
    let more = reference::synthesize(&waves, &TRANSFER, quantities, raster, 1e-4);
    let fade = wake_physics::kelvin::fade_field(&wake.track, 195.0, raster);
    for (field, more) in fields.iter_mut().zip(&more) {
        for ((f, m), a) in field.values.iter_mut().zip(&more.values).zip(&fade.values) {
            *f += m * a;
        }
    }
    fields
}
