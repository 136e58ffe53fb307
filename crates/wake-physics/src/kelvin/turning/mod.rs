//! Waves of a turning ship: every point of its past track sends the waves that keep station with it there.
//!
//! A source that moves along x(s), s the distance run since, sends all waves k. At the time of the image they sum to
//!
//! ```text
//! ζ(x) = Re ∫ d²k B(k)/(2πU) e^{ik·x} ∫ w(s) e^{−ik·x(s) − iωs/U} ds,      B = −(U/π) F̄ e^{−kd}
//! ```
//!
//! On a straight track the inner integral is 2πU δ(U k·t − ω), the curve of steady waves, and B gives the amplitude of
//! [`KelvinWake::amplitude`]. On a circle of radius R around C, with α = s/R and β the direction of k from the heading, both
//! counted against the turn, it is
//!
//! ```text
//! ∫ w e^{−ik·x(s) − iωs/U} ds = R e^{−ik·C} Σₘ Jₘ(kR) ŵ(m − ωR/U) e^{imβ},     ŵ(q) = ∫ w(α) e^{iqα} dα
//! ```
//!
//! by e^{iz sin φ} = Σ Jₘ(z) e^{imφ} (Jacobi and Anger): one FFT for each k. The only approximation is that strength and phase F̄
//! of the source equal the steady wave's of length 2π/k. Caustics, where a turn focuses its waves, are therefore right, too.
//!
//! w rises from bow to stern like the fade of the waves of a straight track. Waves longer than any steady wave are summed with
//! all others: they are the local rise of water around the hull, and without them the sum over k would end sharply where they
//! begin.

mod sent;

use super::KelvinWake;
use crate::dispersion::angular_frequency;
use crate::fft::{Circle, fast_length};
use crate::raster::Raster;
use crate::waves::PlaneWaves;
use num_complex::Complex64;
use rayon::prelude::*;
use sent::Sent;
use std::f64::consts::{PI, TAU};

/// Wavenumbers, over the wavenumber of the longest steady wave, between which the onset becomes sharp (chosen).
const LONG: [f64; 2] = [0.6, 1.0];

/// Largest number of rings that are counted one by one.
const MOST_COUNTED: usize = 1 << 14;

/// Number of rings from which the number of kept waves is estimated, and largest number of waves computed for it (chosen).
const LOOKED_AT: usize = 16;
const MOST_LOOKED_AT: f64 = 2e6;

/// Work for the waves of turning ships, counted before they are computed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct RingWork {
    /// Waves of all ships, and of the ship that has most.
    pub(crate) nodes: f64,
    pub(crate) most_nodes: f64,
    /// Waves that are strong enough to be summed, of all ships and of the ship that has most.
    pub(crate) kept: f64,
    pub(crate) most_kept: f64,
    /// Bessel functions, and terms of their sums.
    pub(crate) terms: f64,
}

/// Size of the terms of the sum over m that are left out, over the share of weak waves and the largest term (chosen).
const WEAK: f64 = 1e-3;

/// Number of rings whose transforms are planned at once: a plan takes as much memory as the waves of its ring.
const PLANNED_AT_ONCE: usize = 64;

/// Waves of a turning ship that are summed: rings of wavenumbers, each with as many directions as the raster requires.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rings {
    /// Radius of the turn R \[m\].
    radius: f64,
    /// 1 to starboard, −1 to port.
    side: f64,
    /// The waves that reach the raster.
    sent: Sent,
    /// Share of the root mean square below which waves are left out, by energy.
    least: f64,
}

impl Rings {
    /// Rings for a raster; `None` if no wave that it carries reaches it.
    pub(super) fn of(wake: &KelvinWake, raster: &Raster, tolerance: f64) -> Option<Self> {
        let (radius, side) = wake.track.turn()?;
        if wake.speed <= 0.0 {
            return None;
        }
        let sent = Sent::of(wake, raster, radius)?;
        Some(Self {
            radius,
            side,
            sent,
            least: tolerance,
        })
    }

    /// Smallest and largest wavenumber [rad/m].
    pub(super) fn wavenumbers(&self) -> [f64; 2] {
        [self.sent.wavenumber(0), self.sent.largest()]
    }

    /// Number of directions of a ring.
    fn directions(&self, ring: usize) -> usize {
        let k = self.sent.wavenumber(ring);
        let phase = k * self.sent.reach(k);
        // Tails of the Bessel functions beyond their argument fall over a few cube roots of it.
        fast_length((phase + 10.0 * phase.cbrt() + 32.0).ceil() as usize)
    }

    /// Rings that are counted, each with the number of rings it stands for: rings change little from one to the next, so of very
    /// many only some are counted.
    fn counted(&self) -> impl Iterator<Item = [usize; 2]> {
        let rings = self.sent.rings();
        let every = rings.div_ceil(MOST_COUNTED).max(1);
        (0..rings).step_by(every).map(move |first| {
            let some = every.min(rings - first);
            [first + some / 2, some]
        })
    }

    /// Number of waves of all rings below a wavenumber, and from it on, before weak waves are left out.
    pub(super) fn nodes(&self, cusp: f64) -> [usize; 2] {
        let mut nodes = [0; 2];
        for [ring, some] in self.counted() {
            nodes[usize::from(self.sent.wavenumber(ring) >= cusp)] += some * self.directions(ring);
        }
        nodes
    }

    /// Work to compute the rings.
    pub(super) fn work(&self, wake: &KelvinWake) -> RingWork {
        let nodes = self.nodes(f64::INFINITY)[0] as f64;
        let kept = (self.kept_share(wake, nodes) * nodes).ceil();
        let wavenumbers = self
            .counted()
            .map(|[ring, some]| some as f64 * self.sent.wavenumber(ring));
        RingWork {
            nodes,
            most_nodes: nodes,
            kept,
            most_kept: kept,
            terms: 2.0 * self.radius * wavenumbers.sum::<f64>(),
        }
    }

    /// Share of the waves that are not weak, estimated from a few rings; 1 where even a few rings have too many waves to compute.
    fn kept_share(&self, wake: &KelvinWake, nodes: f64) -> f64 {
        let count = self.sent.rings();
        let every = count.div_ceil(LOOKED_AT).max(1);
        let rings: Vec<usize> = (every / 2..count).step_by(every).collect();
        if nodes / every as f64 > MOST_LOOKED_AT || rings.is_empty() {
            return 1.0;
        }
        let amplitudes = self.amplitudes_of(wake, &rings);
        let energies = || {
            let pairs = rings.iter().zip(&amplitudes);
            pairs.flat_map(|(&ring, amplitudes)| amplitudes.iter().map(self.energy(ring)))
        };
        let (count, least) = self.least_energy(energies());
        energies().filter(|&energy| energy > least).count() as f64 / count as f64
    }

    /// Energy of a wave of a ring, up to a factor: its share of all water, which is larger the less of the plane of wavenumbers
    /// it stands for.
    fn energy(&self, ring: usize) -> impl Fn(&Complex64) -> f64 + use<> {
        let reach = self.sent.reach(self.sent.wavenumber(ring));
        move |amplitude| amplitude.norm_sqr() * reach * reach
    }

    /// Number of waves, and energy below which a wave is weak.
    fn least_energy(&self, energies: impl Iterator<Item = f64>) -> (usize, f64) {
        let (count, sum) =
            energies.fold((0, 0.0), |(count, sum), energy| (count + 1, sum + energy));
        (count, self.least.powi(2) * sum / count.max(1) as f64)
    }

    /// Plane waves of all rings without the weak ones.
    pub(super) fn waves(&self, wake: &KelvinWake) -> PlaneWaves {
        let count = self.sent.rings();
        let rings: Vec<Vec<Complex64>> = (0..count)
            .step_by(PLANNED_AT_ONCE)
            .flat_map(|first| {
                let some = first..(first + PLANNED_AT_ONCE).min(count);
                self.amplitudes_of(wake, &some.collect::<Vec<_>>())
            })
            .collect();
        let energies = || {
            let pairs = rings.iter().enumerate();
            pairs.flat_map(|(ring, amplitudes)| amplitudes.iter().map(self.energy(ring)))
        };
        let (_, least) = self.least_energy(energies());
        let mut out = PlaneWaves::with_capacity(energies().filter(|&e| e > least).count());
        let centre = self.centre(wake);
        for (ring, amplitudes) in rings.iter().enumerate() {
            let energy = self.energy(ring);
            let k = self.sent.wavenumber(ring);
            let omega = angular_frequency(k, wake.depth);
            let turn = TAU / amplitudes.len() as f64;
            for (n, amplitude) in amplitudes.iter().enumerate() {
                if energy(amplitude) > least {
                    let (sin, cos) = (turn * n as f64).sin_cos();
                    // Counter-clockwise from the heading is to port.
                    let k = wake.track.turned([k * cos, -self.side * k * sin]);
                    let phase = Complex64::cis(-(k[0] * centre[0] + k[1] * centre[1]));
                    out.push(k, omega, amplitude * phase);
                }
            }
        }
        out
    }

    /// Amplitudes of several rings.
    fn amplitudes_of(&self, wake: &KelvinWake, rings: &[usize]) -> Vec<Vec<Complex64>> {
        let mut planner = Circle::planner();
        let plan = |&ring: &usize| Circle::planned(&mut planner, self.directions(ring));
        let circles: Vec<Circle> = rings.iter().map(plan).collect();
        let of_ring = |(&ring, circle)| self.amplitudes(wake, ring, circle);
        rings.par_iter().zip(&circles).map(of_ring).collect()
    }

    /// The centre of the circle (x, y) \[m\].
    fn centre(&self, wake: &KelvinWake) -> [f64; 2] {
        let port = wake.track.port();
        [0, 1].map(|a| wake.track.position[a] - self.side * self.radius * port[a])
    }

    /// k dk dβ B R/(2πU) Σₘ Jₘ(kR) ŵ(m − ωR/U) e^{imβ} for the directions β of a ring.
    fn amplitudes(&self, wake: &KelvinWake, ring: usize, circle: &Circle) -> Vec<Complex64> {
        let k = self.sent.wavenumber(ring);
        let omega = angular_frequency(k, wake.depth);
        let count = circle.len();
        let mut values = vec![Complex64::ZERO; count];
        let turned = omega * self.radius / wake.speed;
        let bessel = bessel_functions(k * self.radius);
        let window = Onsets::new(self, wake, k);
        // Far from ωR/U, ŵ is weak.
        let width = window.width((WEAK * self.least).max(1e-12));
        let first = (turned - width).max(0.0).ceil() as usize;
        let mut spectrum = window.from(first as f64 - turned, 1.0);
        let ahead = bessel.iter().enumerate().skip(first);
        for (m, &value) in ahead.take_while(|(m, _)| *m as f64 <= turned + width) {
            values[m % count] += spectrum.next() * value;
        }
        let mut spectrum = window.from(-1.0 - turned, -1.0);
        let below = bessel.iter().enumerate().skip(1);
        for (m, &value) in below.take_while(|(m, _)| *m as f64 <= width - turned) {
            let odd = if m % 2 == 1 { -value } else { value };
            values[(count - m % count) % count] += spectrum.next() * odd;
        }
        circle.sum(&mut values);
        let along = (omega / wake.speed).min(k);
        let area = k * TAU / self.sent.reach(k) * TAU / count as f64;
        // B R/(2πU), B = (U/π) · source.
        let strength = wake.source(along, k, area * self.radius / (TAU * PI));
        values.iter_mut().for_each(|value| *value *= strength);
        values
    }

    /// Middle and width of the onset of the oldest waves k \[m\].
    ///
    /// Waves longer than any steady wave are not sent on the way, but a sharp onset would send them ahead of all others; their
    /// onset is as wide as the time since allows.
    fn fall(&self, k: f64) -> [f64; 2] {
        let [from, to] = self.sent.onset(k);
        let middle = 0.5 * (from + to);
        let steady = rise((k / self.sent.longest - LONG[0]) / (LONG[1] - LONG[0]));
        [middle, 2.0 * middle + (to - from - 2.0 * middle) * steady]
    }
}

/// Onsets of w, which rises along the hull like the fade of a straight wake and falls over the onset of a wave: angles of the
/// middle of the fall, and of half the widths of fall and rise.
#[derive(Clone, Copy)]
struct Onsets {
    angles: [f64; 3],
}

impl Onsets {
    fn new(rings: &Rings, wake: &KelvinWake, k: f64) -> Self {
        let [middle, width] = rings.fall(k);
        let angles = [middle, 0.5 * width, 0.5 * wake.hull.length()];
        Self {
            angles: angles.map(|s| s / rings.radius),
        }
    }

    /// |q| beyond which ŵ is below a share of its largest value: each of its two steps is at most 15 (1 + 3/z + 3/z²)/z³, with z
    /// = q times half the width.
    fn width(&self, share: f64) -> f64 {
        let [middle, fall, rise] = self.angles;
        let bound = |q: f64| {
            let step = |z: f64| (15.0 * (1.0 + 3.0 / z + 3.0 / (z * z)) / z.powi(3)).min(1.0);
            (step(q * fall) + step(q * rise)) / q
        };
        let mut q = 1.0 / middle;
        while bound(q) > share * middle {
            q *= 1.1;
        }
        q
    }

    /// Sequence ŵ(q), ŵ(q + by), …, whose phases follow by rotation.
    fn from(self, q: f64, by: f64) -> Spectrum {
        Spectrum {
            of: self,
            q,
            by,
            phases: self.angles.map(|angle| Complex64::cis(q * angle)),
            turns: self.angles.map(|angle| Complex64::cis(by * angle)),
        }
    }
}

/// ŵ at equal steps of q.
struct Spectrum {
    of: Onsets,
    q: f64,
    by: f64,
    phases: [Complex64; 3],
    turns: [Complex64; 3],
}

impl Spectrum {
    fn next(&mut self) -> Complex64 {
        let (q, [middle, fall, rise]) = (self.q, self.phases);
        let [at, fall_width, rise_width] = self.of.angles;
        self.q += self.by;
        for (phase, turn) in self.phases.iter_mut().zip(self.turns) {
            *phase *= turn;
        }
        if q.abs() < 1e-6 {
            return Complex64::new(at, 0.0);
        }
        let fall = middle * step_spectrum(q * fall_width, fall);
        (fall - step_spectrum(q * rise_width, rise)) * Complex64::new(0.0, -1.0 / q)
    }
}

/// Smooth step from 0 to 1, s³ (10 − 15 s + 6 s²); 1 where s is not a number.
fn rise(s: f64) -> f64 {
    let s = if s.is_nan() { 1.0 } else { s.clamp(0.0, 1.0) };
    s * s * s * (10.0 + s * (6.0 * s - 15.0))
}

/// Spectrum of the slope of the smooth step s³ (10 − 15 s + 6 s²) of width 1 around 0, 30 ∫ s²(1 − s)² e^{iqt} dt.
///
/// ```text
/// 15 j₂(z)/z²,     z = q/2
/// ```
///
/// - `phase`: e^{iz}
fn step_spectrum(z: f64, phase: Complex64) -> f64 {
    let square = z * z;
    if square < 0.1 {
        // The series of j₂, whose closed form cancels here.
        return 1.0 - square / 14.0 * (1.0 - square / 36.0 * (1.0 - square / 66.0));
    }
    15.0 * ((3.0 / square - 1.0) * phase.im / z - 3.0 * phase.re / square) / square
}

/// J₀(z), J₁(z) … up to the order where they fall below rounding, z at least 0.
///
/// Miller's method: downward recurrence from an order where they vanish, scaled so that J₀ + 2J₂ + 2J₄ + … = 1.
fn bessel_functions(z: f64) -> Vec<f64> {
    if z <= 0.0 {
        return vec![1.0];
    }
    let kept = (z + 10.0 * z.cbrt() + 20.0).ceil() as usize;
    let start = kept + 20 + 10 * z.cbrt().ceil() as usize;
    let mut values = vec![0.0; start + 2];
    values[start] = 1e-300;
    for m in (1..=start).rev() {
        values[m - 1] = 2.0 * m as f64 / z * values[m] - values[m + 1];
        if values[m - 1].abs() > 1e200 {
            values[m - 1..].iter_mut().for_each(|v| *v *= 1e-300);
        }
    }
    let sum = values[0] + 2.0 * values.iter().skip(2).step_by(2).sum::<f64>();
    values.truncate(kept + 1);
    values.iter_mut().for_each(|v| *v /= sum);
    values
}

#[cfg(test)]
mod tests;
