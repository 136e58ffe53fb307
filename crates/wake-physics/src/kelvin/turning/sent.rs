//! Steady waves of a turning ship that reach a raster: how far they come, and which of them are summed.

use super::super::KelvinWake;
use crate::constants::GRAVITY;
use crate::dispersion::{angular_frequency, group_speed};
use crate::raster::Raster;
use std::f64::consts::{PI, TAU};

/// Steps along the track in the search for waves that reach a raster, over half its diagonal, and over the distance run where
/// that is longer (chosen).
const STEPS: [f64; 2] = [1.0 / 32.0, 1.0 / 64.0];

/// Number of wavenumbers at which they are searched.
const KNOTS: usize = 12;

/// Wavelengths over which the oldest waves set in (chosen): in deep water, and where all waves are equally fast, so that waves of
/// the onset stay near the waves of the wake.
const ONSET: [f64; 2] = [3.0, 10.0];

/// Largest wavelength with a reach and an onset of its own, over the wavelength of the longest steady wave in deep water (chosen). A ship
/// faster than the waves of a shallow sea has steady waves of any length.
const LONGEST: f64 = 20.0;

/// Factor on the number of samples that the largest phase requires, for the tails of the sum.
const GUARD: f64 = 1.15;

/// Waves that reach a raster, by wavenumber.
///
/// Waves that come from a distance ℓ have phases that change by ℓ dk. They are summed in steps of 2π/ℓ(k), which are shorter for
/// the long waves that come from far away than for short ones.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sent {
    /// Wavenumber of the longest steady wave [rad/m].
    pub(super) longest: f64,
    /// Wavenumbers at which the other values are tabulated, increasing to the largest of the raster [rad/m].
    knots: [f64; KNOTS],
    /// Distances run between which the oldest waves set in \[m\].
    onsets: [[f64; 2]; KNOTS],
    /// Largest phase over k \[m\].
    reaches: [f64; KNOTS],
    /// Number of rings below each knot.
    below: [f64; KNOTS],
}

impl Sent {
    /// `None` where no wave reaches the raster.
    pub(super) fn of(wake: &KelvinWake, raster: &Raster, radius: f64) -> Option<Self> {
        let steady = wake.steady_waves();
        let longest = steady.at(steady.first()).wavenumber;
        let largest = raster.nyquist_wavenumber();
        if longest >= largest {
            return None;
        }
        let [x, y] = [raster.columns, raster.rows].map(|n| 0.5 * (n.max(1) - 1) as f64);
        let middle = [
            raster.x(0) + x * raster.spacing,
            raster.y(0) - y * raster.spacing,
        ];
        let half = x.hypot(y) * raster.spacing;
        let run = PI * radius;
        let least = GRAVITY / (LONGEST * wake.speed.powi(2));
        let first = longest.max(least).min(0.5 * (longest + largest));
        let knots: [f64; KNOTS] = std::array::from_fn(|knot| {
            first * (largest / first).powf(knot as f64 / (KNOTS - 1) as f64)
        });
        // Distances run, and the steps to them. A turn of any radius takes a few hundred.
        let step = |s: f64| (STEPS[0] * half.max(TAU / largest)).max(STEPS[1] * s);
        let next = |&[s, _]: &[f64; 2]| (s < run).then(|| [(s + step(s)).min(run), step(s)]);
        let passed: Vec<[f64; 2]> = std::iter::successors(Some([0.0, step(0.0)]), next).collect();
        let ways = knots.map(|k| steady_way(wake, k));
        // Present distances from the middle of the raster, to port and to starboard, of the waves sent a distance s ago.
        let away = |s: f64, [ahead, aside]: [f64; 2]| {
            let there = wake.track.at(-s);
            let port = there.port();
            [-1.0, 1.0].map(|side| {
                let place = [0, 1].map(|a| {
                    let way = ahead * there.forward[a] + side * aside * port[a];
                    there.position[a] + s * way - middle[a]
                });
                place[0].hypot(place[1])
            })
        };
        let oldest = ways.map(|way| {
            let reaches = |&&[s, step]: &&[f64; 2]| {
                let [port, starboard] = away(s, way);
                port.min(starboard) <= half + step
            };
            passed.iter().rev().find(reaches).map(|&[s, _]| s)
        });
        if oldest.iter().all(Option::is_none) {
            return None;
        }
        // Between two knots, the later or farther of them holds.
        let largest_around = |values: [f64; KNOTS]| -> [f64; KNOTS] {
            std::array::from_fn(|knot| {
                let around = &values[knot.saturating_sub(1)..(knot + 2).min(KNOTS)];
                around.iter().copied().fold(0.0, f64::max)
            })
        };
        let oldest = largest_around(oldest.map(Option::unwrap_or_default));
        let onsets: [[f64; 2]; KNOTS] = std::array::from_fn(|knot| {
            let (oldest, length) = (oldest[knot], TAU / knots[knot]);
            // A wave is sent over a stretch of the track, longest at the cusp, where it is the cube root of λs².
            let oldest = (oldest + (oldest * oldest * length).cbrt()).min(run);
            let ramp = (onset_lengths(wake, knots[knot]) * length)
                .max(0.1 * oldest)
                .min(0.5 * run);
            let end = (oldest + ramp).min(run);
            [end - ramp, end]
        });
        let reaches = largest_around(std::array::from_fn(|knot| {
            let [_, end] = onsets[knot];
            let sent = passed
                .iter()
                .flat_map(|&[s, _]| away(s.min(end), ways[knot]));
            GUARD * (sent.fold(0.0, f64::max) + half) + TAU / knots[knot]
        }));
        let mut sent = Self {
            longest,
            knots,
            onsets,
            reaches,
            below: [0.0; KNOTS],
        };
        sent.below[0] = knots[0] * reaches[0] / TAU;
        for knot in 1..KNOTS {
            let mean = 0.5 * (reaches[knot - 1] + reaches[knot]);
            let rings = mean * (knots[knot] - knots[knot - 1]) / TAU;
            sent.below[knot] = sent.below[knot - 1] + rings;
        }
        // A whole number of rings.
        let more = sent.below[KNOTS - 1].ceil() / sent.below[KNOTS - 1];
        sent.below = sent.below.map(|rings| more * rings);
        sent.reaches = sent.reaches.map(|reach| more * reach);
        Some(sent)
    }

    /// The same waves in more rings.
    #[cfg(test)]
    pub(super) fn finer(mut self, times: f64) -> Self {
        self.below = self.below.map(|rings| times * rings);
        self.reaches = self.reaches.map(|reach| times * reach);
        self
    }

    /// Largest wavenumber of the raster [rad/m].
    pub(super) fn largest(&self) -> f64 {
        self.knots[KNOTS - 1]
    }

    /// Number of rings.
    pub(super) fn rings(&self) -> usize {
        self.below[KNOTS - 1].round() as usize
    }

    /// Wavenumber of a ring, the middle of its step [rad/m].
    pub(super) fn wavenumber(&self, ring: usize) -> f64 {
        let rings = ring as f64 + 0.5;
        let knot = self.below.partition_point(|&below| below <= rings);
        if knot == 0 {
            return rings * TAU / self.reaches[0];
        }
        // The reach changes linearly from knot to knot, so the rings between them follow a parabola.
        let before = knot.min(KNOTS - 1) - 1;
        let [reach, next] = [self.reaches[before], self.reaches[before + 1]];
        let slope = (next - reach) / (self.knots[before + 1] - self.knots[before]);
        let phase = TAU * (rings - self.below[before]);
        let root = (reach * reach + 2.0 * slope * phase).max(0.0).sqrt();
        self.knots[before] + 2.0 * phase / (reach + root)
    }

    /// Largest phase of the waves k, divided by k \[m\].
    pub(super) fn reach(&self, k: f64) -> f64 {
        let (knot, part) = self.place(k);
        self.reaches[knot] + part * (self.reaches[knot + 1] - self.reaches[knot])
    }

    /// Distances run between which the oldest waves k set in \[m\]; longer waves take the distances of the first knot.
    pub(super) fn onset(&self, k: f64) -> [f64; 2] {
        let (knot, part) = self.place(k);
        let [before, after] = [self.onsets[knot], self.onsets[knot + 1]];
        [0, 1].map(|n| before[n] + part * (after[n] - before[n]))
    }

    /// Index of the knot before a wavenumber, and fraction of the way to the next.
    fn place(&self, k: f64) -> (usize, f64) {
        let after = self.knots.partition_point(|&knot| knot <= k);
        let knot = after.clamp(1, KNOTS - 1) - 1;
        let [before, next] = [self.knots[knot], self.knots[knot + 1]];
        (knot, ((k - before) / (next - before)).clamp(0.0, 1.0))
    }
}

/// Distance that a steady wave travels, ahead and aside, while its ship runs one metre: the group speed over the ship's, in the
/// direction that keeps station, cos θ = ω/(kU).
fn steady_way(wake: &KelvinWake, k: f64) -> [f64; 2] {
    let cos = (angular_frequency(k, wake.depth) / (k * wake.speed)).min(1.0);
    let group = group_speed(k, wake.depth) / wake.speed;
    [group * cos, group * (1.0 - cos * cos).sqrt()]
}

/// Wavelengths over which the oldest waves k set in, by group over phase speed: ½ in deep water, 1 in shallow.
fn onset_lengths(wake: &KelvinWake, k: f64) -> f64 {
    let share = group_speed(k, wake.depth) * k / angular_frequency(k, wake.depth);
    ONSET[0] + (ONSET[1] - ONSET[0]) * (2.0 * share - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::Track;

    fn boat(position: [f64; 2], radius: f64) -> KelvinWake {
        KelvinWake {
            track: Track::turning(position, 20.0, 0.0, radius.recip()),
            ..super::super::tests::boat(20.0, radius)
        }
    }

    /// On turns so wide that they are straight, the same waves are sent, and they are found in a few steps.
    #[test]
    fn of_wide_turns_the_waves_of_a_straight_track_are_sent() {
        let raster = Raster::image(91, 91, 2.0);
        let sent = [1e6f64, 1e9]
            .map(|radius| Sent::of(&boat([10.0, 20.0], radius), &raster, radius).unwrap());
        for (a, b) in sent[0].reaches.iter().zip(sent[1].reaches) {
            assert!((a / b - 1.0).abs() < 1e-3 && b < 800.0, "{a} {b}");
        }
    }

    /// A wide turn is straight within the raster. In deep water, with c² = cos² θ = k₀/k, the wave k that a ship in the middle
    /// sent a distance s ago lies √((1 − c²/2)² + c²(1 − c²)/4) s away: at the distance h of a corner it is the last that reaches
    /// the raster, and three wavelengths later none are sent.
    #[test]
    fn only_waves_that_reach_the_raster_are_sent() {
        let radius = 2000.0f64;
        let raster = Raster::image(91, 91, 2.0);
        let sent = Sent::of(&boat([0.0, 0.0], radius), &raster, radius).unwrap();
        let half = 90.0 * f64::sqrt(2.0);
        // The search looks one step beyond, and one step is its resolution; the turn bends 290 m by 21 m, 1 m more.
        let step = STEPS[0] * half;
        assert!((sent.longest - GRAVITY / 25.0).abs() < 1e-9 * sent.longest);
        for knot in [0, 3, KNOTS - 1] {
            let k = sent.knots[knot];
            // Shorter waves fall behind less, so of the neighbouring knots the one before is the latest.
            let square = sent.longest / sent.knots[knot.saturating_sub(1)];
            let away = (1.0 - 0.5 * square).hypot(0.5 * (square * (1.0 - square)).sqrt());
            let [from, to] = sent.onset(k);
            // They are sent over a stretch of the track.
            let with_stretch = |s: f64| s + (s * s * TAU / k).cbrt();
            let [least, most] = [half / away - 1.0, (half + step) / away + step + 1.0];
            assert!(
                from > with_stretch(least) && from < with_stretch(most),
                "{knot}: {from}"
            );
            let ramp = (ONSET[0] * TAU / k).max(0.1 * from);
            // Surface tension makes the group faster by (k/370 m⁻¹)², at most by 2e-5; five times that in the onset.
            assert!(
                (to - from - ramp).abs() < 1e-4 * ramp,
                "{knot}: {from} {to} {ramp}"
            );
            // No wave is farther away than its source.
            assert!(sent.reach(k) < GUARD * (to + half) + TAU / sent.longest + 1.0);
        }
    }

    /// Rings are spaced by 2π over their reach, and fill the wavenumbers of the raster.
    #[test]
    fn rings_are_as_far_apart_as_their_reach_asks_for() {
        let raster = Raster::image(91, 91, 2.0);
        // A ship faster than the waves of its sea, whose long waves come from far away.
        let shallow = KelvinWake {
            depth: 1.6,
            ..boat([20.0, 40.0], 1e5)
        };
        for (wake, uneven) in [(boat([20.0, 40.0], 300.0), 1.0), (shallow, 3.0)] {
            let sent = Sent::of(&wake, &raster, wake.track.turn().unwrap().0).unwrap();
            assert!(sent.reach(0.0) > uneven * sent.reach(sent.largest()));
            let mut end = 0.0;
            for ring in 0..sent.rings() {
                let k = sent.wavenumber(ring);
                let step = TAU / sent.reach(k);
                // The middle of a step begins where the last one ended, to second order in the change.
                assert!((k - end - 0.5 * step).abs() < 0.02 * step, "{ring}: {k}");
                end = k + 0.5 * step;
            }
            assert!((end / sent.largest() - 1.0).abs() < 1e-3);
        }
    }

    #[test]
    fn waves_that_pass_the_raster_by_are_none() {
        let wake = |position| boat(position, 100.0);
        let raster = Raster::image(91, 91, 2.0);
        assert!(Sent::of(&wake([0.0, 0.0]), &raster, 100.0).is_some());
        assert!(Sent::of(&wake([2000.0, 0.0]), &raster, 100.0).is_none());
        // A raster too coarse for the longest waves.
        let coarse = Raster::image(9, 9, 20.0);
        assert!(Sent::of(&wake([0.0, 0.0]), &coarse, 100.0).is_none());
    }
}
