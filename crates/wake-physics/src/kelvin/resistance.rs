//! Wave resistance, the work that a ship does to sustain its waves, for comparison with published curves.

use super::KelvinWake;
use super::panels::unwindowed;
use super::zones::Reach;
use crate::constants::{GRAVITY, SEA_WATER_DENSITY};

/// λ beyond which the integrand, falling as λ⁻⁴, contributes less than 1e-10 of the resistance.
const LAST_LAMBDA: f64 = 300.0;

/// Error of the quadrature relative to the integral of the magnitude.
const ERROR: f64 = 1e-10;

impl KelvinWake {
    /// Wave resistance from the spectrum of the free waves, without `filter_depth`.
    ///
    /// ```text
    /// R_w = ρ g ∫ |a|²/w du          in deep water = ½ π ρ U² ∫ |A|² cos³θ dθ = (4ρg²/(πU²)) ∫ |F|² sec³θ dθ, θ > 0
    /// ```
    ///
    /// with a = −w F̄ and w = (2/π) k/(1 − νh sec²θ/cosh²(kh)).
    ///
    /// - returns `R_w` \[N\]; 0 for a ship at rest
    ///
    /// # References
    ///
    /// Michell (1898); Tuck, Scullen and Lazauskas (2002), Eq. 9; Sretensky (1936) for finite depth.
    pub(super) fn wave_resistance(&self) -> f64 {
        if self.speed == 0.0 {
            return 0.0;
        }
        let steady = self.steady_waves();
        let first = steady.first();
        // |F|² has the phase between bow and stern, twice the phase of F to midship, and twice the decay.
        let reach = Reach::new(
            steady,
            vec![[0.0, 0.0]],
            self.hull.length(),
            2.0 * self.hull.draft(),
        );
        let range = [first, first + LAST_LAMBDA.acosh()];
        let integral: f64 = unwindowed(&reach, range, first, self.grading(), ERROR)
            .into_iter()
            .map(|(u, du)| {
                let wave = steady.at(u);
                let michell = self
                    .hull
                    .michell_integral(wave.along, wave.wavenumber, self.depth);
                michell.norm_sqr() * wave.weight * du
            })
            .sum();
        2.0 * SEA_WATER_DENSITY * GRAVITY * integral
    }

    /// Coefficient of wave resistance `R_w`/(½ ρ U² S) \[1\], S the wetted surface; 0 at rest.
    pub(super) fn wave_resistance_coefficient(&self) -> f64 {
        if self.speed == 0.0 {
            return 0.0;
        }
        let pressure = 0.5 * SEA_WATER_DENSITY * self.speed * self.speed;
        self.wave_resistance() / (pressure * self.hull.wetted_surface())
    }
}
