//! Waves of a ship that pixels do not carry: variances of their slopes and velocities, by place.
//!
//! By stationary phase, the wave of parameter u lies on the ray tan ψ = α'/β', and at the distance d astern of midship its mean
//! square is
//!
//! ```text
//! ⟨ζ²⟩ = ½ a_loc² = π|a(u)|²/(β' |dT/du| d),   T = tan ψ(u)         s² = k² ⟨ζ²⟩ e^{−4ν_w k² t},   s² ≤ s²_max
//! ```
//!
//! with |a|² averaged over the interference of bow and stern and t the age of the wave. In deep water β' |dT/du| d is the
//! second derivative of the phase, ν d cosh u |1 − 4 sinh²u/cosh 2u|.

use super::{INTERFERENCE, KelvinWake, fade};
use crate::track::Track;
use std::f64::consts::{PI, TAU};

/// Largest slope variance of one wave (chosen): a wave's with an amplitude of 0.2 over its wavenumber, as steeper waves break. Smaller
/// variances are not changed, so that waves count the same on pixels that carry them.
pub(crate) const LARGEST_SLOPE_VARIANCE: f64 = 0.02;

/// Kinematic viscosity `ν_w` of sea water at 20 °C [m²/s].
const VISCOSITY: f64 = 1.05e-6;

/// Number of steps along the curve of steady waves.
const STEPS: usize = 1024;

/// Number of rays from the track to the outermost ray.
const RAYS: usize = 512;

/// Waves of one ship between two wavenumbers.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SubpixelWake {
    track: Track,
    length: f64,
    /// Angle between two rays \[rad\], and tangent of the angle of the outermost ray.
    step: f64,
    widest: f64,
    /// Transverse and divergent waves by ray: each ray has one of each.
    branches: [Vec<WavesOfRay>; 2],
}

/// The waves of a ray.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct WavesOfRay {
    /// k²⟨ζ²⟩d without decay \[m\].
    slopes: f64,
    /// Direction (along the track, away from it).
    direction: [f64; 2],
    /// Squared phase speed [m²/s²].
    square_speed: f64,
    /// Rate of decay 4 `ν_w` k² t/d [1/m].
    decay: f64,
}

/// Variances at one place.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Roughness {
    /// Variances of the slopes: xx, xy and yy \[1\].
    pub(crate) slopes: [f64; 3],
    /// Variances of the velocity of the water along x and upward, which are a quarter of a period apart [m²/s²].
    pub(crate) velocity: [f64; 2],
}

impl Roughness {
    /// Variances of two ships' waves together.
    pub(crate) fn plus(&self, other: &Self) -> Self {
        Self {
            slopes: [0, 1, 2].map(|n| self.slopes[n] + other.slopes[n]),
            velocity: [0, 1].map(|n| self.velocity[n] + other.velocity[n]),
        }
    }

    /// Variance of the velocity toward the radar at the incidence θ \[rad\] [m²/s²].
    pub(crate) fn radial(&self, incidence: f64) -> f64 {
        let (sin, cos) = incidence.sin_cos();
        self.velocity[0] * sin * sin + self.velocity[1] * cos * cos
    }
}

impl KelvinWake {
    /// Waves of a band of wavenumbers (`from`, `to`) [rad/m]; `None` where there are none.
    pub(crate) fn subpixel(&self, [from, to]: [f64; 2]) -> Option<SubpixelWake> {
        if self.speed <= 0.0 || from >= to {
            return None;
        }
        let waves = self.steady_waves();
        let last = waves.last(to)?;
        let first = waves.last(from).unwrap_or_else(|| waves.first());
        // Uniform in √(u − u₁): above the critical speed the amplitude begins as 1/√(u − u₁).
        let start = waves.first();
        let [low, high] = [first, last].map(|u| (u - start).sqrt());
        let at = |n: f64| start + (low + (high - low) * n / STEPS as f64).powi(2);
        let ray = |u: f64| {
            let [_, along, across] = waves.at(u).rates;
            (along / across).atan()
        };
        let edges: Vec<f64> = (0..=STEPS).map(|n| ray(at(n as f64))).collect();
        let widest = edges.iter().copied().fold(0.0, f64::max);
        let step = widest / RAYS as f64;
        let outermost = edges.iter().position(|&e| e >= widest).unwrap_or(0);
        let mut sums = [(); 2].map(|()| vec![Sum::default(); RAYS]);
        for n in 0..STEPS {
            let [u, next] = [at(n as f64 + 0.5), at(n as f64 + 1.0)];
            let wave = waves.at(u);
            let width = next - at(n as f64);
            let energy = PI * self.envelope(&wave) * width / wave.rates[2].abs();
            let k = wave.wavenumber;
            let cosine = wave.along / k;
            let sum = Sum {
                slopes: k * k * energy,
                cosine,
                // The waves' energy travels at half their speed, c = U cos θ.
                decay: 4.0 * VISCOSITY * k * k / (self.speed * (1.0 - 0.5 * cosine * cosine)),
            };
            let branch = &mut sums[usize::from(n >= outermost)];
            sum.spread([edges[n], edges[n + 1]], step, branch);
        }
        let mean = |sums: Vec<Sum>| -> Vec<WavesOfRay> {
            let of_ray = |(n, sum): (usize, Sum)| sum.on_ray(n, step, self.speed);
            sums.into_iter().enumerate().map(of_ray).collect()
        };
        Some(SubpixelWake {
            track: self.track,
            length: self.hull.length(),
            step,
            widest: widest.tan(),
            branches: sums.map(mean),
        })
    }

    /// |a|² [m² per unit u], averaged over a period of the interference of bow and stern.
    fn envelope(&self, wave: &super::SteadyWave) -> f64 {
        let period = TAU / self.hull.length();
        let square = |n: usize| {
            let shift = ((n as f64 + 0.5) / INTERFERENCE as f64 - 0.5) * period;
            let along = wave.along + shift;
            self.free_wave(&super::SteadyWave { along, ..*wave })
                .norm_sqr()
        };
        (0..INTERFERENCE).map(square).sum::<f64>() / INTERFERENCE as f64
    }
}

/// Waves collected on a ray, weighted with their slopes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Sum {
    slopes: f64,
    cosine: f64,
    decay: f64,
}

impl Sum {
    /// Spreads the waves of a step between two angles [rad] evenly over the rays between them.
    fn spread(&self, edges: [f64; 2], step: f64, rays: &mut [Self]) {
        let [low, high] = [edges[0].min(edges[1]) / step, edges[0].max(edges[1]) / step];
        let last = (high as usize).min(rays.len() - 1);
        let first = (low as usize).min(last);
        for (n, ray) in rays[first..=last].iter_mut().enumerate() {
            let n = (first + n) as f64;
            let inside = high.min(n + 1.0) - low.max(n);
            let share = if high > low {
                inside.max(0.0) / (high - low)
            } else {
                1.0
            };
            let slopes = share * self.slopes;
            ray.slopes += slopes;
            ray.cosine += slopes * self.cosine;
            ray.decay += slopes * self.decay;
        }
    }

    /// Mean over ray number `n`, per distance off the track.
    fn on_ray(&self, n: usize, step: f64, speed: f64) -> WavesOfRay {
        if self.slopes <= 0.0 {
            return WavesOfRay::default();
        }
        let [low, high] = [n, n + 1].map(|n| (n as f64 * step).tan());
        let cosine = (self.cosine / self.slopes).min(1.0);
        WavesOfRay {
            slopes: self.slopes / (high - low),
            direction: [cosine, (1.0 - cosine * cosine).sqrt()],
            square_speed: (speed * cosine).powi(2),
            decay: self.decay / self.slopes,
        }
    }
}

impl SubpixelWake {
    /// Variances at a place (x, y) \[m\], faded over the hull like the waves; `None` outside the rays.
    pub(crate) fn at(&self, place: [f64; 2]) -> Option<Roughness> {
        let [ahead, port] = self.track.seen_from_ship(place);
        // Behind a turning ship, the waves are those of a straight track along the tangent there.
        let there = match self.track.turn() {
            None => self.track,
            Some(_) => self.track.at(ahead),
        };
        if port.abs() >= self.widest * -ahead {
            return None;
        }
        let ray = (port.abs().atan2(-ahead) / self.step) as usize;
        let shown = fade(ahead, self.length).powi(2);
        if ray >= RAYS || shown <= 0.0 {
            return None;
        }
        let mut out = Roughness::default();
        for branch in &self.branches {
            let waves = &branch[ray];
            let variance = shown * waves.variance(-ahead);
            let [along, across] = waves.direction;
            let [x, y] = there.turned([along, across.copysign(port)]);
            let slopes = [x * x, x * y, y * y].map(|product| variance * product);
            for (sum, slope) in out.slopes.iter_mut().zip(slopes) {
                *sum += slope;
            }
            out.velocity[0] += slopes[0] * waves.square_speed;
            out.velocity[1] += variance * waves.square_speed;
        }
        Some(out)
    }

    /// Tangent of the angle from the track to the outermost ray.
    pub(crate) fn widest(&self) -> f64 {
        self.widest
    }

    /// Length of the ship \[m\].
    pub(crate) fn length(&self) -> f64 {
        self.length
    }

    /// The track of the ship.
    pub(crate) fn track(&self) -> &Track {
        &self.track
    }

    /// The largest slope variance at a distance astern of midship \[m\].
    pub(crate) fn steepest(&self, distance: f64) -> f64 {
        let waves = self.branches.iter().flatten();
        waves
            .map(|waves| waves.variance(distance))
            .fold(0.0, f64::max)
    }
}

impl WavesOfRay {
    /// Variance of the slopes at a distance astern of midship \[m\].
    fn variance(&self, distance: f64) -> f64 {
        let decayed = self.slopes / distance * (-self.decay * distance).exp();
        decayed.min(LARGEST_SLOPE_VARIANCE)
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "exact zeros and the cap itself")]
mod tests {
    use super::*;
    use crate::Raster;
    use crate::constants::GRAVITY;
    use crate::hull::Hull;
    use crate::kelvin::SteadyWave;
    use crate::waves::{PlaneWaves, Quantity, Transfer, harmonic_sum};

    /// Wigley's hull of 195 × 26 × 10 m at 10 m/s, along azimuth.
    fn wake() -> KelvinWake {
        KelvinWake {
            hull: Hull::wigley(195.0, 26.0, 10.0),
            speed: 10.0,
            track: Track::new([0.0, 0.0], 0.0, 0.0),
            depth: f64::INFINITY,
            filter_depth: 0.0,
            steepness: None,
        }
    }

    /// The steady wave of a given length \[m\], and the waves around it on their ray.
    fn of_length(length: f64) -> (SteadyWave, WavesOfRay) {
        let (wake, k) = (wake(), TAU / length);
        let steady = wake.steady_waves();
        let wave = steady.at(steady.last(k).unwrap());
        let waves = wake.subpixel([0.7 * k, 1.3 * k]).unwrap();
        let ray = (angle(&wave) / waves.step) as usize;
        (wave, waves.branches[1][ray])
    }

    fn angle(wave: &SteadyWave) -> f64 {
        (wave.rates[1] / wave.rates[2]).atan()
    }

    /// Angle of the ray, amplitude (envelope over √2) and steepness 500 m astern agree with another programme, which uses the
    /// closed form of φ'' and rounds to two or three digits.
    #[test]
    fn rays_and_amplitudes_are_those_of_another_programme() {
        let table = [
            (20.0, 15.35, 0.385, 0.121),
            (10.0, 11.13, 0.227, 0.143),
            (5.0, 7.94, 0.133, 0.168),
            (2.0, 5.05, 0.066, 0.207),
            (1.0, 3.57, 0.039, 0.245),
            (0.2, 1.60, 0.0116, 0.364),
            (0.048, 0.78, 0.0040, 0.520),
        ];
        for (length, degrees, amplitude, steepness) in table {
            let (wave, waves) = of_length(length);
            assert!(
                (angle(&wave).to_degrees() - degrees).abs() < 0.006,
                "{length}"
            );
            let steep = (2.0 * waves.slopes / 500.0).sqrt();
            // Half a unit of the last digit, 1.3 %, and the terms that its envelope omits: (2/kT)² and 1/(αL) to second order, 1
            // % for the longer waves.
            assert!((steep / steepness - 1.0).abs() < 0.025, "{length}: {steep}");
            let a = steep / wave.wavenumber;
            assert!((a / amplitude - 1.0).abs() < 0.025, "{length}: {a}");
        }
    }

    /// Rays and ages by the group velocity, an independent derivation: `tan α = c_g sin χ/(U − c_g cos χ)`, `t = d/(U − c_g cos
    /// χ)`.
    #[test]
    fn waves_lie_and_age_as_their_groups_run() {
        for length in [20.0, 5.0, 1.0, 0.1] {
            let (wave, waves) = of_length(length);
            let phase_speed = (GRAVITY / wave.wavenumber).sqrt();
            let (group, cos) = (0.5 * phase_speed, phase_speed / 10.0);
            let along = 10.0 - group * cos;
            let tangent = group * (1.0 - cos * cos).sqrt() / along;
            assert!(
                (angle(&wave).tan() / tangent - 1.0).abs() < 1e-9,
                "{length}"
            );
            let rate = 4.0 * 1.05e-6 * wave.wavenumber.powi(2) / along;
            // The mean over a ray, a thousandth wide in the angle: k goes as its square.
            assert!((waves.decay / rate - 1.0).abs() < 5e-3, "{length}");
            assert!((waves.square_speed.sqrt() / phase_speed - 1.0).abs() < 2e-3);
        }
    }

    /// Variances agree with the simulator's own sum of waves, 4 km astern: the mean square of its slopes over a sector in which
    /// the phase between bow and stern waves turns three times.
    #[test]
    fn variances_are_those_of_the_sum_of_waves() {
        let wake = wake();
        let steady = wake.steady_waves();
        let nu = GRAVITY / 100.0;
        let cosines = [2.5, 2.5 + 3.0 * TAU / (nu * 195.0)];
        let ends = cosines.map(|c: f64| angle(&steady.at(c.acosh())));
        let waves = wake.subpixel([0.3, 2.5]).unwrap();
        let middle = 0.5 * (ends[0] + ends[1]);
        // Port is −x of a ship along +y.
        let raster = Raster {
            origin_row: -(4000.0 / 1.25) as i64 + 40,
            origin_column: (4000.0 * middle.tan() / 1.25) as i64 + 100,
            ..Raster::image(80, 200, 1.25)
        };
        let inside = |&[i, j]: &[usize; 2]| {
            let [ahead, port] = wake.track.seen_from_ship([raster.x(j), raster.y(i)]);
            (ends[1]..ends[0]).contains(&(port / -ahead).atan())
        };
        let pixels: Vec<[usize; 2]> = (0..raster.len())
            .map(|n| [n / raster.columns, n % raster.columns])
            .filter(inside)
            .collect();
        // The sector is 223 m wide.
        assert!(pixels.len() > 14_000 && pixels.len() < 15_000);
        let all = wake.waves(&wake.plan(&raster, 1e-3));
        let mut short = PlaneWaves::default();
        for n in 0..all.len() {
            let k = [all.kx[n], all.ky[n]];
            if k[0].hypot(k[1]) > 0.3 {
                short.push(k, all.omega[n], all.amplitude[n]);
            }
        }
        let transfer = Transfer {
            depth: f64::INFINITY,
            incidence: 0.5,
            relaxation_rate: 1.0,
            action_slope: 4.5,
        };
        let quantities = [
            Quantity::SlopeX,
            Quantity::SlopeY,
            Quantity::VelocityX,
            Quantity::VelocityZ,
        ];
        let fields = harmonic_sum(&short, &transfer, &quantities, &raster, &pixels);
        let product = |a: usize, b: usize| -> f64 {
            fields[a].iter().zip(&fields[b]).map(|(a, b)| a * b).sum()
        };
        let mut sum = [0.0; 5];
        for [i, j] in &pixels {
            let rough = waves.at([raster.x(*j), raster.y(*i)]).unwrap();
            let values = rough.slopes.into_iter().chain(rough.velocity);
            sum.iter_mut()
                .zip(values)
                .for_each(|(sum, value)| *sum += value);
        }
        let found = [(0, 0), (0, 1), (1, 1), (2, 2), (3, 3)].map(|(a, b)| product(a, b));
        for (n, (found, expected)) in found.into_iter().zip(sum).enumerate() {
            // Some 15 × 20 waves, complete to within one at the edges, and the curvature of the envelope.
            assert!(
                (found / expected - 1.0).abs() < 0.05,
                "{n}: {found} {expected}"
            );
        }
    }

    #[test]
    fn waves_break_end_with_the_rays_and_fade_over_the_hull() {
        let waves = wake().subpixel([0.6, 50.0]).unwrap();
        let near = waves.at([-10.0, -150.0]).unwrap();
        let variance = near.slopes[0] + near.slopes[2];
        assert!((variance - LARGEST_SLOPE_VARIANCE).abs() < 1e-12);
        assert_eq!(waves.steepest(10.0), LARGEST_SLOPE_VARIANCE);
        // Waves of 10.5 m lie at 11.4°; there are none outside, nor ahead of the bow.
        assert!(waves.at([-190.0, -1000.0]).is_some() && waves.at([-210.0, -1000.0]).is_none());
        assert!(waves.at([-1.0, 98.0]).is_none());
        let over = waves.at([1.0, -20.0]).unwrap();
        let expected = fade(-20.0, 195.0).powi(2) * LARGEST_SLOPE_VARIANCE;
        assert!((over.slopes[0] + over.slopes[2] - expected).abs() < 1e-12);
        // Port and starboard mirror each other.
        let [port, starboard] = [-60.0, 60.0].map(|x| waves.at([x, -700.0]).unwrap());
        assert_eq!(port.slopes[0], starboard.slopes[0]);
        assert_eq!(port.slopes[1], -starboard.slopes[1]);
        // Far astern, viscosity has removed the shortest waves.
        let [mid, far] = [2e3, 6e3].map(|d| waves.at([-0.025 * d, -d]).unwrap().slopes[0]);
        assert!(mid > 0.0 && far < 0.1 * mid);
        assert!(wake().subpixel([60.0, 50.0]).is_none());
        let still = KelvinWake {
            speed: 0.0,
            ..wake()
        };
        assert!(still.subpixel([0.6, 50.0]).is_none());
    }
}
