//! Directional spreading of waves around the wind: D(k, δ) with ∫D dδ = 1 over the full circle.

mod cos2s;
mod elfouhaily;

pub use cos2s::Cos2s;
pub(crate) use cos2s::Spread;
pub use elfouhaily::EvenSpreading;

use crate::scene::SpreadingModel;
use crate::spectrum::Elfouhaily;

/// Spreading of one sea, by one of the models.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Spreading {
    /// cos-2s: most waves travel with the wind.
    Cos2s(Cos2s),
    /// Elfouhaily et al. (1997): even.
    Even(EvenSpreading),
}

impl Spreading {
    /// Spreading around a wind U₁₀ [m/s] for a sea with deep-water peak `k_p` [rad/m].
    ///
    /// The even spreading is that of Elfouhaily's sea for this wind and fetch \[m\].
    #[must_use]
    pub fn new(model: SpreadingModel, wind_speed: f64, fetch: f64, peak_wavenumber: f64) -> Self {
        match model {
            SpreadingModel::Hasselmann => {
                Self::Cos2s(Cos2s::hasselmann(wind_speed, peak_wavenumber))
            }
            SpreadingModel::Mitsuyasu => Self::Cos2s(Cos2s::mitsuyasu(wind_speed, peak_wavenumber)),
            SpreadingModel::Elfouhaily => {
                Self::Even(EvenSpreading::new(Elfouhaily::new(wind_speed, fetch)))
            }
        }
    }

    /// D(k, δ) [1/rad] for deep-water wavenumber k [rad/m] and cos δ, δ the angle to the wind.
    #[must_use]
    pub fn density(&self, wavenumber: f64, cos_angle: f64) -> f64 {
        self.at(wavenumber).density(cos_angle)
    }

    /// Spreading of the waves at a deep-water wavenumber [rad/m].
    pub(crate) fn at(&self, wavenumber: f64) -> Spread {
        match self {
            Self::Cos2s(model) => model.at(wavenumber),
            Self::Even(model) => model.at(wavenumber),
        }
    }

    /// Second harmonic ∫D cos 2δ dδ \[1\]: 1 if all waves run along the wind, 0 without preference, −1 if all run across.
    #[must_use]
    pub fn second_harmonic(&self, wavenumber: f64) -> f64 {
        match self {
            Self::Cos2s(model) => model.second_harmonic(wavenumber),
            Self::Even(model) => model.second_harmonic(wavenumber),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constants::GRAVITY;
    use std::f64::consts::TAU;

    /// The integral is 1 and the second harmonic matches, by the trapezoidal rule over the circle.
    #[test]
    fn spreads_integrate_to_one() {
        for model in [
            SpreadingModel::Hasselmann,
            SpreadingModel::Mitsuyasu,
            SpreadingModel::Elfouhaily,
        ] {
            for age in [0.84, 1.2, 4.0] {
                let (wind, n) = (6.0f64, 20_000);
                let peak = GRAVITY * (age / wind).powi(2);
                let spreading = Spreading::new(model, wind, 4e4, peak);
                for ratio in [0.3, 0.9, 1.0, 1.1, 2.0, 30.0] {
                    let k = ratio * peak;
                    let (mut sum, mut second) = (0.0, 0.0);
                    for i in 0..n {
                        let delta = (f64::from(i) + 0.5) * TAU / f64::from(n);
                        let d = spreading.density(k, delta.cos());
                        sum += d * TAU / f64::from(n);
                        second += d * (2.0 * delta).cos() * TAU / f64::from(n);
                    }
                    // The rule is exact up to rounding for smooth spreads; for s below 1 the cusp at δ = π,
                    // |π − δ|^2s, causes an error of step^(1+2s), at most one step.
                    let bound = 2.0 / f64::from(n);
                    assert!((sum - 1.0).abs() < bound, "{model:?} {age} {ratio} {sum}");
                    assert!((second - spreading.second_harmonic(k)).abs() < bound);
                }
            }
        }
    }
}
