//! The turbulent wake: a dark band of suppressed short waves along the track. A phenomenological model.
//!
//! Water stirred by hull and propeller, and the films it brings up, damp the waves that scatter radar. The
//! model multiplies the Bragg spectrum by 1 − damping with
//!
//! ```text
//! damping(d, η) = D(d) · exp(−η²/(2 (W(d)/2)²)),     d astern of the stern, η off the track
//! ```
//!
//! Every constant below carries its source or the word "chosen".
//!
//! In a wind, the damped waves recover at their relaxation rate μ. With γ the rate at which the turbulence damps them, the
//! balance 0 = μ (N₀ − N) − γ N of their action gives
//!
//! ```text
//! D = γ/(μ + γ) = r/(1 + r),     r = γ/μ = r₅ (u*(5 m/s)/u*)² e^{−d/(U T)},     T = 600 s
//! ```
//!
//! since μ = 0.04 (u*/c)² ω (Plant 1982) has the same power of u* for all Bragg waves ([`Suppression::Balance`]). A stronger wind
//! thus lowers the damping and shortens the dark line. T is the median time for which bubbles and turbulence of 38 ships could be
//! observed, about 10 minutes, some more than 20 (Nylund, Arneborg, Tengberg, Mallast and Hassellöv 2021, Ocean Sci. 17, 1285).

pub mod current;

use crate::kelvin::fade;
use crate::raster::{Field, Raster};
use crate::spectrum::elfouhaily::{DragLaw, friction_velocity};
use crate::track::Track;
use rayon::prelude::*;

/// Damping on the centreline at the stern, D(0) = 0.6, that is −4 dB: chosen.
pub const STERN_DAMPING: f64 = 0.6;

/// Time T in which the damping turbulence falls to 1/e where the wind restores the waves \[s\]: see the module's documentation.
pub const TURBULENCE_TIME: f64 = 600.0;

/// Wind at which a ship's damping is given, where the wind restores the waves [m/s]: chosen.
pub const REFERENCE_WIND: f64 = 5.0;

/// Time in which the damping falls to 1/e, 1000 s: chosen, so that 6 % is left 28 km behind a ship of 10 m/s. Dark centrelines
/// have been seen up to 41 km (Shemdin 1990, J. Geophys. Res. 95).
pub const RECOVERY_TIME: f64 = 1000.0;

/// Factor of the width law W = w B^{4/5} x^{1/5}, w⁵ = 4: chosen, of the size used with Milgram et al. (1993), J. Geophys. Res.
/// 98, who found the power 1/5.
const WIDTH_FACTOR: f64 = 4.0;

/// Full width W of the wake \[m\]: twice the distance off the track at which the damping falls to e^{−1/2}.
///
/// ```text
/// W(d) = B (1 + 4 d/B)^{1/5}
/// ```
///
/// The law W ∝ x^{1/5} of Milgram et al. (1993), shifted so that the wake is as wide as the ship at the stern.
///
/// - `beam` B \[m\], above 0
/// - `distance` d astern of the stern \[m\]; W is B where it is negative
#[must_use]
pub fn width(beam: f64, distance: f64) -> f64 {
    beam * (1.0 + WIDTH_FACTOR * distance.max(0.0) / beam).powf(0.2)
}

/// Damping of the Bragg spectrum on the centreline.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Suppression {
    /// The damping D(0) at the stern \[1\], in every wind: D(d) = D(0) exp(−d/(U · 1000 s)).
    Given(f64),
    /// The ratio r(0) at the stern of the rates of damping and of recovery \[1\], see the module's documentation.
    Balance(f64),
}

impl Suppression {
    /// Balance in a wind, from the damping in the reference wind.
    ///
    /// - `damping` D in 5 m/s \[1\], 0 to 1; at 1 nothing is restored
    /// - `wind_speed` at 10 m [m/s]; without wind nothing is restored
    #[must_use]
    pub fn in_wind(damping: f64, wind_speed: f64) -> Self {
        let stress = |wind: f64| friction_velocity(wind, DragLaw::default()).powi(2);
        if damping <= 0.0 {
            return Self::Balance(0.0);
        }
        Self::Balance(damping / (1.0 - damping) * stress(REFERENCE_WIND) / stress(wind_speed))
    }

    /// Damping D on the centreline \[1\].
    ///
    /// - `speed` U [m/s]; 0 behind a ship at rest
    /// - `distance` d astern of the stern \[m\]
    #[must_use]
    pub fn damping(&self, speed: f64, distance: f64) -> f64 {
        if speed <= 0.0 {
            return 0.0;
        }
        let age = distance.max(0.0) / speed;
        match *self {
            Self::Given(stern) => stern * (-age / RECOVERY_TIME).exp(),
            Self::Balance(ratio) if ratio.is_infinite() => 1.0,
            Self::Balance(ratio) => {
                let ratio = ratio * (-age / TURBULENCE_TIME).exp();
                ratio / (1.0 + ratio)
            }
        }
    }
}

/// The turbulent wake of a ship.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurbulentWake {
    /// Place and direction of the ship.
    pub track: Track,
    /// Speed U [m/s], at least 0.
    pub speed: f64,
    /// Length of the hull L \[m\].
    pub length: f64,
    /// Beam of the hull B \[m\].
    pub beam: f64,
    /// Damping on the centreline.
    pub suppression: Suppression,
}

impl TurbulentWake {
    /// Damping of the Bragg spectrum \[1\] at ξ forward of midship and η to port \[m\]: 0 ahead of the bow, rising smoothly along
    /// the hull like the Kelvin wake ([`fade`]).
    #[must_use]
    pub fn damping(&self, [forward, port]: [f64; 2]) -> f64 {
        let distance = (-forward - 0.5 * self.length).max(0.0);
        let off = 2.0 * port / width(self.beam, distance);
        let centre = self.suppression.damping(self.speed, distance);
        centre * (-0.5 * off * off).exp() * fade(forward, self.length)
    }

    /// Fills a field of the raster's size with [`Self::damping`]; the Bragg spectrum is multiplied by 1 minus the field.
    pub(crate) fn fill_damping(&self, field: &mut Field, raster: &Raster) {
        let farthest = self.track.farthest_astern(raster);
        // Six standard deviations: exp(−18) ≈ 1.5e-8 lies below the rounding of 1 − damping in f32.
        let reach = 3.0 * width(self.beam, farthest);
        field.values.fill(0.0);
        field
            .values
            .par_chunks_mut(raster.columns.max(1))
            .enumerate()
            .for_each(|(i, row)| {
                let seen = |j: usize| self.track.seen_from_ship([raster.x(j), raster.y(i)]);
                let columns = self.track.columns_within(raster, i, reach);
                for (j, value) in columns.clone().zip(&mut row[columns]) {
                    *value = self.damping(seen(j)) as f32;
                }
            });
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "exact ends and symmetry")]
mod tests {
    use super::*;

    fn damping_field(wake: &TurbulentWake, raster: &Raster) -> Field {
        let mut field = Field::constant(raster, 0.5);
        wake.fill_damping(&mut field, raster);
        field
    }

    fn wake() -> TurbulentWake {
        TurbulentWake {
            track: Track::new([30.0, -20.0], 120.0, 0.0),
            speed: 10.0,
            length: 195.0,
            beam: 26.0,
            suppression: Suppression::Given(STERN_DAMPING),
        }
    }

    #[test]
    fn ships_damp_as_much_unless_told() {
        assert_eq!(crate::scene::Ship::default().damping, STERN_DAMPING);
    }

    /// In 5 m/s the damping is the given one. By Wu's drag (0.8 + 0.065 U) 10⁻³, u*² is 0.00372, 0.02812, 0.145 and 0.2275 m²/s²
    /// in 2, 5, 10 and 12 m/s: a ratio of 1.5 in 5 m/s becomes 11.34, 0.2909 and 0.1854 in the other winds.
    #[test]
    fn the_wind_restores_the_waves() {
        for (wind, damping) in [
            (5.0, 0.6),
            (2.0, 11.34 / 12.34),
            (10.0, 0.2909 / 1.2909),
            (12.0, 0.1854 / 1.1854),
        ] {
            let found = Suppression::in_wind(0.6, wind).damping(8.0, 0.0);
            assert!((found - damping).abs() < 3e-4, "{wind}: {found} {damping}");
        }
        // Ten minutes later the ratio has fallen to 1/e.
        let later = Suppression::in_wind(0.6, 5.0).damping(8.0, 4800.0);
        let ratio = 1.5 * (-1.0f64).exp();
        assert!((later - ratio / (1.0 + ratio)).abs() < 1e-12);
        assert_eq!(Suppression::in_wind(0.6, 0.0).damping(8.0, 1e4), 1.0);
        assert_eq!(Suppression::in_wind(1.0, 9.0).damping(8.0, 1e4), 1.0);
        assert_eq!(Suppression::in_wind(0.0, 0.0).damping(8.0, 0.0), 0.0);
        assert_eq!(Suppression::in_wind(0.6, 5.0).damping(0.0, 9.0), 0.0);
    }

    /// The law W ∝ x^{1/5} far astern, the beam at the stern.
    #[test]
    fn width_grows_with_the_fifth_root() {
        assert_eq!(width(26.0, 0.0), 26.0);
        let slope = (width(26.0, 2e6) / width(26.0, 1e6)).log2();
        assert!((slope - 0.2).abs() < 1e-5);
        // 5 km behind the default ship: about four beams.
        assert!((width(26.0, 5000.0) / 26.0 - 3.78).abs() < 0.01);
    }

    #[test]
    fn damping_is_between_none_and_its_value_at_the_stern() {
        let wake = wake();
        assert_eq!(wake.damping([97.5, 0.0]), 0.0);
        assert_eq!(wake.damping([1e4, 0.0]), 0.0);
        assert!((wake.damping([-97.5, 0.0]) - STERN_DAMPING).abs() < 1e-15);
        let one_recovery = wake.damping([-97.5 - 1e4, 0.0]);
        assert!((one_recovery / STERN_DAMPING - (-1.0f64).exp()).abs() < 1e-12);
        let half_width = 0.5 * width(26.0, 900.0);
        let (centre, side) = (
            wake.damping([-997.5, 0.0]),
            wake.damping([-997.5, half_width]),
        );
        assert!((side / centre - (-0.5f64).exp()).abs() < 1e-12);
        assert_eq!(wake.damping([-300.0, 15.0]), wake.damping([-300.0, -15.0]));
    }

    #[test]
    fn ship_at_rest_leaves_nothing() {
        let still = TurbulentWake {
            speed: 0.0,
            ..wake()
        };
        let raster = Raster::image(20, 30, 10.0);
        assert_eq!(
            damping_field(&still, &raster),
            Field::constant(&raster, 0.0)
        );
    }

    #[test]
    fn field_is_the_function() {
        let raster = Raster::image(60, 80, 25.0);
        let field = damping_field(&wake(), &raster);
        let mut dark = 0;
        for i in 0..raster.rows {
            for j in 0..raster.columns {
                let seen = wake().track.seen_from_ship([raster.x(j), raster.y(i)]);
                assert!((f64::from(field.at(i, j)) - wake().damping(seen)).abs() < 6e-8);
                dark += usize::from(field.at(i, j) > 0.3);
            }
        }
        assert!(dark > 50);
    }
}
