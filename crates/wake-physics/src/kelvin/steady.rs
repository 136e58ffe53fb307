//! Waves that keep station with a ship: one curve in the plane of wavenumbers.

use std::f64::consts::PI;

/// Waves whose phase is stationary as seen from a ship of constant speed.
///
/// A wave that runs at the angle θ to the track with λ = sec θ = cosh u satisfies
///
/// ```text
/// k = ν λ² tanh(kh),   ν = g/U²,     along the track α = k/λ,   across β = k tanh u
/// ```
///
/// In deep water k = ν cosh² u for every u. In water of finite depth the curve begins at u = 0 below the critical speed √(gh),
/// and where νhλ² = 1 above it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SteadyWaves {
    /// ν = g/U² [1/m].
    nu: f64,
    /// Depth h \[m\], may be infinite.
    depth: f64,
}

/// One of the steady waves, at the parameter u.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SteadyWave {
    /// Wavenumber k [rad/m].
    pub(crate) wavenumber: f64,
    /// Component α along the track [rad/m].
    pub(crate) along: f64,
    /// Component β to port [rad/m].
    pub(crate) across: f64,
    /// dk/du, dα/du, dβ/du [rad/m].
    pub(crate) rates: [f64; 3],
    /// w = (2/π) k/(1 − νhλ²/cosh²(kh)) [rad/m]: a free wave has the amplitude −w F̄ du.
    pub(crate) weight: f64,
}

impl SteadyWaves {
    pub(crate) fn new(speed: f64, depth: f64) -> Self {
        Self {
            nu: crate::constants::GRAVITY / (speed * speed),
            depth,
        }
    }

    /// νh − 1: positive below the critical speed, infinite in deep water.
    pub(crate) fn subcriticality(&self) -> f64 {
        self.nu * self.depth - 1.0
    }

    /// Smallest |u| of the curve.
    pub(crate) fn first(&self) -> f64 {
        (self.nu * self.depth).sqrt().recip().max(1.0).acosh()
    }

    /// |u| beyond which waves are shorter than 2π/`wavenumber`; `None` if no wave is longer.
    pub(crate) fn last(&self, wavenumber: f64) -> Option<f64> {
        let tanh = (wavenumber * self.depth).tanh();
        let lambda = (wavenumber / (self.nu * tanh)).sqrt();
        let last = lambda.max(1.0).acosh();
        (lambda >= 1.0 && last > self.first()).then_some(last)
    }

    /// The wave at u.
    pub(crate) fn at(&self, u: f64) -> SteadyWave {
        let (cosh, tanh) = (u.cosh(), u.tanh());
        let (k, regularity) = self.wavenumber(u);
        let k_rate = if regularity > 0.0 {
            2.0 * k * tanh / regularity
        } else {
            0.0
        };
        SteadyWave {
            wavenumber: k,
            along: k / cosh,
            across: k * tanh,
            rates: [
                k_rate,
                k_rate / cosh - k * tanh / cosh,
                k_rate * tanh + k / (cosh * cosh),
            ],
            weight: 2.0 / PI * k / regularity.max(f64::MIN_POSITIVE),
        }
    }

    /// k, and the factor 1 − νhλ²/cosh²(kh) by which the slope of the curve differs from deep water.
    fn wavenumber(&self, u: f64) -> (f64, f64) {
        let deep = self.nu * u.cosh().powi(2);
        if (deep * self.depth) > 20.0 {
            return (deep, 1.0); // tanh 20 is 1 in double precision
        }
        // X = A tanh X with X = kh; A − 1 is computed without cancellation.
        let excess = self.subcriticality() + self.nu * self.depth * u.sinh().powi(2);
        let a = 1.0 + excess;
        let x = dispersion_root(a, excess.max(0.0));
        let y = 2.0 * x;
        let regularity = if y < 0.2 {
            let s = y * y / 6.0 * (1.0 + y * y / 20.0 * (1.0 + y * y / 42.0));
            s / (1.0 + s)
        } else {
            1.0 - y / y.sinh()
        };
        (x / self.depth, regularity)
    }
}

/// The positive root of X = A tanh X, for A − 1 = `excess` ≥ 0.
///
/// Newton's method from above: tanh X ≤ X/√(1 + 2X²/3) and tanh X ≤ 1 bound the root, and the function is convex, so the iterates
/// fall monotonically.
fn dispersion_root(a: f64, excess: f64) -> f64 {
    let mut x = (1.5 * excess * (a + 1.0)).sqrt().min(a);
    for _ in 0..40 {
        let tanh = x.tanh();
        let slope = 1.0 - a * (1.0 - tanh * tanh);
        let step = (x - a * tanh) / slope;
        if slope <= 0.0 || step <= 1e-16 * x {
            break;
        }
        x -= step;
    }
    x
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "None and exact zeros")]
mod tests {
    use super::*;
    use crate::constants::GRAVITY;
    use crate::dispersion::depth_factor;

    /// Every wave satisfies ω = U α with the gravity-wave dispersion, sub- and supercritical.
    #[test]
    fn waves_keep_station() {
        for depth in [1.0, 9.0, 10.2, 12.0, 200.0, f64::INFINITY] {
            let waves = SteadyWaves::new(10.0, depth);
            for i in 1..40 {
                let wave = waves.at(waves.first() + 0.07 * f64::from(i));
                let omega =
                    (GRAVITY * wave.wavenumber * depth_factor(wave.wavenumber, depth)).sqrt();
                assert!((omega / (10.0 * wave.along) - 1.0).abs() < 1e-12);
                let k = wave.along.hypot(wave.across);
                assert!((wave.wavenumber / k - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn rates_are_derivatives() {
        for depth in [8.0, 11.0, f64::INFINITY] {
            let waves = SteadyWaves::new(10.0, depth);
            for step in [0.3, 0.9, 2.0] {
                let (u, d) = (waves.first() + step, 1e-5);
                let (a, b) = (waves.at(u - d), waves.at(u + d));
                let slope = |x: f64, y: f64| (y - x) / (2.0 * d);
                let expected = [
                    slope(a.wavenumber, b.wavenumber),
                    slope(a.along, b.along),
                    slope(a.across, b.across),
                ];
                for (rate, slope) in waves.at(u).rates.iter().zip(expected) {
                    // Central differences: d² times third derivatives, below 1e-8 of the largest rate.
                    assert!((rate - slope).abs() < 1e-7 * waves.at(u).rates[0]);
                }
            }
        }
    }

    #[test]
    fn last_wave_has_the_limiting_wavenumber() {
        for depth in [5.0, 30.0, f64::INFINITY] {
            let waves = SteadyWaves::new(10.0, depth);
            let last = waves.last(1.2).unwrap();
            assert!((waves.at(last).wavenumber / 1.2 - 1.0).abs() < 1e-12);
        }
        assert_eq!(SteadyWaves::new(10.0, f64::INFINITY).last(0.09), None);
    }

    /// At the critical speed the curve begins with infinitely long waves: X = √3 u, and the weight 3/(π h X) stays finite where 1
    /// − y/sinh y is below rounding.
    #[test]
    fn weights_near_the_critical_speed_are_their_series() {
        let waves = SteadyWaves {
            nu: 1.0,
            depth: 1.0,
        };
        for u in [1e-4, 1e-7, 1e-9] {
            let x = 3f64.sqrt() * u;
            let wave = waves.at(u);
            // Terms of order u², and the rounding of X − tanh X over X³.
            let allowed = u * u + 1e-15 / (u * u);
            assert!(
                (wave.wavenumber / x - 1.0).abs() < allowed.min(1e-6),
                "{u:e}"
            );
            let weight = 3.0 / (PI * x);
            assert!(
                (wave.weight / weight - 1.0).abs() < allowed.min(1e-6),
                "{u:e}"
            );
        }
    }
}
