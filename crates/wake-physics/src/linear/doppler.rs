//! Apparent velocity of the sea toward the radar: the mean Doppler shift of its echo.

use super::waves;
use crate::constants::SPEED_OF_LIGHT;
use crate::dispersion::phase_speed;
use crate::models::Models;
use crate::scattering::bragg;
use crate::scattering::modulation::ModulationTransfer;
use crate::scene::Scene;
use crate::track::direction;
use crate::turbulent::current::DRIFT_OF_WIND;
use std::f64::consts::TAU;

/// Mean velocity of the open sea toward the radar, weighted by the echo [m/s].
///
/// ```text
/// v = Σ ⟨ζ²⟩ Re(M T*) + (b c_B + 0.03 W) sin θ cos φ
/// ```
///
/// The sum runs over all waves longer than the split to the Bragg waves, M being their modulation of σ⁰ by tilt and short
/// waves and T the velocity of a wave of unit height toward the radar: approaching crests are brighter. b is the share of
/// the Bragg return, `c_B` the phase speed of its waves, all of which travel with the wind (chosen), W the wind speed with
/// its drift of 3 % (chosen), φ the angle between the wind and the direction to the radar.
///
/// # Validity
///
/// First order in the slope. At C band, 35° and 5 to 10 m/s it agrees with measurements within 0.25 m/s (see the test).
pub(super) fn mean_velocity(scene: &Scene, models: &Models, radar: &ModulationTransfer) -> f64 {
    let wave_induced: f64 = waves::sea(&models.sea, models.two_scale.split_wavenumber())
        .iter()
        .map(|wave| {
            let modulation = radar.at(wave.k, wave.omega);
            let moved = radar.transfer.radial(wave.k, wave.omega);
            wave.variance * ((modulation.tilt + modulation.hydrodynamic) * moved.conj()).re
        })
        .sum();
    let wind = scene.sea.wind_speed;
    if wind <= 0.0 {
        return wave_induced;
    }
    let bragg = bragg::wavenumber(
        TAU * scene.radar.frequency / SPEED_OF_LIGHT,
        models.incidence,
    );
    let short_waves = radar.bragg_share * phase_speed(bragg, scene.sea.depth);
    // The radar lies toward −x.
    let toward = -direction(scene.sea.wind_toward)[0] * models.incidence.sin();
    wave_induced + toward * (short_waves + DRIFT_OF_WIND * wind)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Velocity for a wind speed and direction at C band and 35°.
    fn velocity(polarization: &str, wind: f64, toward: f64) -> f64 {
        let scene = Scene::default()
            .with_assignments(&[
                "radar.frequency=5.405e9".to_owned(),
                "radar.incidence=35".to_owned(),
                "sea.fetch=1e6".to_owned(),
                format!("radar.polarization={polarization}"),
                format!("sea.wind_speed={wind}"),
                format!("sea.wind_toward={toward}"),
            ])
            .unwrap();
        let models = Models::new(&scene);
        crate::linear::OpenSea::new(&models).mean_velocity(&scene, &models)
    }

    /// Expected values evaluated from CDOP (Mouche et al., 2012, IEEE Trans. Geosci. Remote Sens. 50, 2901), a fit to
    /// measured Doppler shifts.
    #[test]
    fn the_velocity_is_near_that_of_measured_doppler_shifts() {
        for (polarization, wind, toward, measured) in [
            ("VV", 5.0, 270.0, 0.55),
            ("VV", 10.0, 270.0, 0.74),
            ("VV", 5.0, 0.0, 0.02),
            ("VV", 10.0, 180.0, 0.02),
            ("VV", 5.0, 90.0, -0.36),
            ("VV", 10.0, 90.0, -0.48),
            ("HH", 5.0, 270.0, 0.60),
            ("HH", 10.0, 270.0, 0.81),
            ("HH", 5.0, 0.0, -0.04),
            ("HH", 5.0, 90.0, -0.50),
            ("HH", 10.0, 90.0, -0.74),
        ] {
            let v = velocity(polarization, wind, toward);
            assert!(
                (v - measured).abs() < 0.25,
                "{polarization} {wind} {toward}: {v} {measured}"
            );
        }
    }
}
