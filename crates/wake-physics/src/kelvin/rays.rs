//! Directions in which the waves of a wake are seen: each on its ray from the ship, all of them between the arms.

use super::KelvinWake;
use super::steady::SteadyWaves;
use crate::numeric::largest;
use std::f64::consts::{FRAC_PI_2, PI};

/// Kelvin's angle arcsin(1/3) \[rad\] between the track and the arms of a wake in deep water.
pub const KELVIN_ANGLE: f64 = 0.339_836_909_454_121_9;

/// νh above which the depth changes the angle by less than rounding: tanh(νh) is 1.
const DEEP: f64 = 20.0;

/// Range of ln u in which the steady wave that bounds a subcritical wake is searched. The upper end is the cusp wave of deep
/// water, tan θ = sinh u = 1/√2, and shallower water moves it down.
const SEARCH: [f64; 2] = [-25.0, -0.417];

/// Steps of the search. Each leaves 0.618 of the interval: 25·0.618⁶⁰ is 7e-12 of ln u, and the error of the largest angle is
/// quadratic in that.
const STEPS: usize = 60;

/// Waves of one side of a wake: a step along the curve of steady waves, seen on one ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Ray {
    /// Wavenumber (along the track, away from it) [rad/m].
    pub(crate) k: [f64; 2],
    /// Angular frequency in the frame of the sea [rad/s].
    pub(crate) omega: f64,
    /// tan ψ: distance off the track over the distance astern of midship \[1\].
    pub(crate) tangent: f64,
    /// Integral of the mean square elevation across the step \[m³\].
    pub(crate) energy: f64,
}

/// Steps along the curve; the interference of bow and stern turns by less than a radian in each.
const RAYS: usize = 512;

impl KelvinWake {
    /// Waves of one side that a pixel carries (k up to `largest` [rad/m]), on their rays.
    ///
    /// By stationary phase, the mean square off the track is ½·2π|a|²/|φ''| at any distance astern. Over the places of a step du
    /// of the curve that is
    ///
    /// ```text
    /// ∫ ⟨ζ²⟩ dη = π |a(u)|² du/|dβ/du|
    /// ```
    ///
    /// without the infinity of stationary phase on the arms themselves.
    pub(crate) fn rays(&self, largest: f64) -> Vec<Ray> {
        let waves = self.steady_waves();
        let last = (self.speed > 0.0).then(|| waves.last(largest)).flatten();
        let Some(last) = last else {
            return Vec::new();
        };
        // Uniform in √(u − u₁): above the critical speed the amplitude begins as 1/√(u − u₁).
        let first = waves.first();
        let step = (last - first).sqrt() / RAYS as f64;
        let ray = |n: usize| {
            let root = (n as f64 + 0.5) * step;
            let wave = waves.at(first + root * root);
            let [_, along, across] = wave.rates;
            Ray {
                k: [wave.along, wave.across],
                omega: self.speed * wave.along,
                tangent: along / across,
                energy: PI * self.free_wave(&wave).norm_sqr() * 2.0 * root * step / across.abs(),
            }
        };
        (0..RAYS).map(ray).filter(|r| r.energy > 0.0).collect()
    }
}

/// Angle between the track and each arm of the wake.
///
/// A steady wave of parameter u (sec θ = cosh u) reaches the places where its phase αξ + βη is stationary along the curve of
/// steady waves: a ray at
///
/// ```text
/// tan ψ(u) = (dα/du)/(dβ/du)
/// half-angle = max ψ(u)            deep water: arcsin(1/3);  rises to 90° at the critical speed F = U/√(gh) = 1
///            = arcsin(1/F)         above it, where the longest waves run along the front
/// ```
///
/// - `speed` U [m/s], at least 0; `depth` h \[m\], above 0, may be infinite
/// - returns the angle \[rad\], from arcsin(1/3) to π/2; for a ship at rest, which has no wake, the angle of deep water
///
/// # References
///
/// Kelvin (1887) for deep water; Havelock (1908), Proc. R. Soc. Lond. A 81, 398 for finite depth.
#[must_use]
pub fn half_angle(speed: f64, depth: f64) -> f64 {
    let waves = SteadyWaves::new(speed, depth);
    let excess = waves.subcriticality();
    if speed <= 0.0 || excess + 1.0 > DEEP {
        return KELVIN_ANGLE;
    }
    if excess <= 0.0 {
        // F² = 1/(1 + excess).
        return (1.0 + excess).sqrt().min(1.0).asin();
    }
    let steepest = |ln_u: f64| {
        let [_, along, across] = waves.at(ln_u.exp()).rates;
        along.atan2(across)
    };
    largest(steepest, SEARCH, STEPS).clamp(KELVIN_ANGLE, FRAC_PI_2)
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "values that nothing may change")]
mod tests {
    use super::*;
    use crate::constants::GRAVITY;
    use std::f64::consts::FRAC_1_SQRT_2;

    fn depth_of(speed: f64, froude: f64) -> f64 {
        (speed / froude).powi(2) / GRAVITY
    }

    #[test]
    fn deep_water_opens_at_the_arcsine_of_a_third() {
        assert!((KELVIN_ANGLE.sin() - 1.0 / 3.0).abs() < 1e-16);
        assert!((SEARCH[1] - FRAC_1_SQRT_2.asinh().ln()).abs() < 1e-3 && SEARCH[1] > -0.4180);
        assert_eq!(half_angle(10.0, f64::INFINITY), KELVIN_ANGLE);
        assert_eq!(half_angle(0.0, 5.0), KELVIN_ANGLE);
        // The search itself finds the angle where depth just ceases to matter.
        let searched = half_angle(10.0, 0.99 * DEEP * 100.0 / GRAVITY);
        assert!((searched - KELVIN_ANGLE).abs() < 1e-12, "{searched}");
    }

    #[test]
    fn above_the_critical_speed_it_is_machs_angle() {
        for froude in [1.0 + 1e-9, 1.2, 1.5, 3.0, 40.0] {
            let angle = half_angle(12.0, depth_of(12.0, froude));
            // The root of 1 + (1/F² − 1) near F = 1: 1e-16 in the argument is 1e-8·√2 in the arcsine.
            assert!((angle.sin() - 1.0 / froude).abs() < 1e-14, "{froude}");
        }
        assert!((half_angle(10.0, depth_of(10.0, 1.0)) - FRAC_PI_2).abs() < 1e-7);
    }

    /// Near the critical speed, with u and ε = νh − 1 small, the ray is tan ψ = u/(ε + 2u²) to leading order, with the largest
    /// value 1/√(8ε). The next order is ε relative to it.
    #[test]
    fn just_below_the_critical_speed_it_follows_its_expansion() {
        for excess in [1e-3, 1e-5, 1e-7] {
            let speed = 10.0;
            let angle = half_angle(speed, (1.0 + excess) * speed * speed / GRAVITY);
            let leading = 1.0 / (8.0 * excess).sqrt();
            assert!(
                (angle.tan() / leading - 1.0).abs() < 4.0 * excess + 1e-8,
                "{excess}"
            );
        }
    }

    /// An independent derivation by group velocity: a wave of phase speed U cos θ runs at θ with the group speed q U cos θ, q =
    /// ½(1 + 2kh/sinh 2kh), so it lies at tan ψ = q sin θ cos θ/(1 − q cos² θ). Searched on a lattice of kh, from which θ follows
    /// by cos²θ = tanh(kh)/(kh F²).
    #[test]
    fn group_velocity_gives_the_same_angle() {
        for froude in [0.3, 0.5, 0.7, 0.9, 0.97, 0.999] {
            let mut largest = 0.0f64;
            for n in 1..400_000 {
                let x = 1e-4 * f64::from(n);
                let cos2 = x.tanh() / (x * froude * froude);
                if cos2 >= 1.0 {
                    continue;
                }
                let q = 0.5 * (1.0 + 2.0 * x / (2.0 * x).sinh());
                let tan = q * (cos2 * (1.0 - cos2)).sqrt() / (1.0 - q * cos2);
                largest = largest.max(tan.atan());
            }
            let angle = half_angle(7.0, depth_of(7.0, froude));
            // A lattice of 1e-4 in kh misses a peak some 0.05 wide at F = 0.999 by (1e-3)², elsewhere by less.
            assert!(
                (angle - largest).abs() < 1e-5,
                "{froude}: {angle} {largest}"
            );
        }
    }

    #[test]
    fn it_depends_on_the_depth_froude_number_alone_and_rises_to_the_critical_speed() {
        let mut last = 0.0;
        for froude in [0.1, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99, 0.9999] {
            let [one, other] = [3.0, 25.0].map(|speed| half_angle(speed, depth_of(speed, froude)));
            assert!((one - other).abs() < 1e-9, "{froude}");
            assert!(one >= last, "{froude}");
            last = one;
        }
        assert!(last > 80f64.to_radians());
    }
}
