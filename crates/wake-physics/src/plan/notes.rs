//! Notes for the user about a scene.

use crate::prepared::Prepared;
use crate::scene::Scene;

/// Computed pixels per side of an image pixel above which an impulse response costs more than it shows: chosen.
const COARSE_PIXEL: f64 = 8.0;

/// Collects the notes for a scene.
pub(super) fn notes(prepared: &Prepared<'_>) -> Vec<String> {
    let (scene, models) = (prepared.scene, &prepared.models);
    let mut notes = Vec::new();
    if models.short_waves_vanish() {
        notes.push(format!(
            "a wind of {} m/s raises no short waves at this incidence: the image is specular only, or dark",
            scene.sea.wind_speed
        ));
    }
    if let Some(asked) = models.pixels.asked_spacing {
        notes.push(format!(
            "waves on the arms of a wake need pixels of {asked:.2} m, but {} m are computed: shorter waves count only by the \
             variances of their slopes and velocities, and only with an impulse response",
            models.pixels.computed.spacing
        ));
    }
    let spacing = models.pixels.image.spacing;
    let divisions = (spacing / models.pixels.computed.spacing).round();
    if let Some(response) = models.response.filter(|_| divisions > COARSE_PIXEL) {
        let [range, azimuth] = [response.range, response.azimuth].map(|axis| axis.resolution);
        notes.push(format!(
            "a pixel of {spacing} m needs {divisions} x {divisions} computed pixels, because the radar resolves {range:.1} x {azimuth:.1} m; for an image \
             averaged to such pixels, set radar.range_resolution and radar.azimuth_resolution to the resolution of that image"
        ));
    }
    let count = models.wakes.len();
    for (n, wake) in models.wakes.iter().enumerate() {
        let wavelength = wake.transverse_wavelength();
        if wake.speed > 0.0 && 2.0 * models.pixels.computed.spacing > wavelength {
            notes.push(format!(
                "the transverse waves of the {} are {wavelength:.2} m long, too short for pixels of {} m",
                Scene::ship_name(n, count),
                models.pixels.computed.spacing
            ));
        }
    }
    notes
}
