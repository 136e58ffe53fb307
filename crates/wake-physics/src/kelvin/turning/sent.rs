//! Which steady waves of a turning ship reach a raster, and from how far they come.

use super::super::KelvinWake;
use crate::dispersion::{angular_frequency, group_speed};
use crate::raster::Raster;
use std::f64::consts::{PI, TAU};

/// Steps along the track in which the waves that reach a raster are looked for, over half its diagonal, and over the distance
/// run where that is longer: chosen.
const STEPS: [f64; 2] = [1.0 / 32.0, 1.0 / 64.0];

/// Wavenumbers at which they are looked for.
const KNOTS: usize = 9;

/// Wavelengths of the longest steady wave over which the oldest waves set in: chosen.
const ONSET: f64 = 3.0;

/// The waves that reach a raster, by wavenumber from that of the longest steady wave to the largest of the raster.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sent {
    /// Wavenumber of the longest steady wave, and the largest of the raster [rad/m].
    pub(super) wavenumbers: [f64; 2],
    /// Distances run between which the oldest waves set in, at equally spaced wavenumbers \[m\].
    onsets: [[f64; 2]; KNOTS],
    /// Largest distance of a wave that is sent from the middle of the raster \[m\].
    pub(super) farthest: f64,
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
        let wavenumber = |knot: usize| {
            let above = knot as f64 / (KNOTS - 1) as f64 * (largest - longest);
            (longest + above).max(1e-3 * largest)
        };
        let wavelength = TAU / wavenumber(0);
        // Distances run, and the steps to them. A turn of any radius takes a few hundred.
        let step = |s: f64| (STEPS[0] * half.max(wavelength)).max(STEPS[1] * s);
        let next = |&[s, _]: &[f64; 2]| (s < run).then(|| [(s + step(s)).min(run), step(s)]);
        let passed: Vec<[f64; 2]> = std::iter::successors(Some([0.0, step(0.0)]), next).collect();
        let ways: [[f64; 2]; KNOTS] =
            std::array::from_fn(|knot| steady_way(wake, wavenumber(knot)));
        // Distances, to port and to starboard, at which the waves are now that were sent a distance s ago.
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
        let onsets: [[f64; 2]; KNOTS] = std::array::from_fn(|knot| {
            // Between two knots the later of them holds.
            let around = &oldest[knot.saturating_sub(1)..(knot + 2).min(KNOTS)];
            let oldest = around.iter().flatten().copied().fold(0.0, f64::max);
            // A wave is sent over a stretch of the track: the cube root of λs² at the cusp, where it is longest.
            let sent_over = (oldest * oldest * TAU / wavenumber(knot)).cbrt();
            let oldest = (oldest + sent_over).min(run);
            let ramp = (ONSET * wavelength).max(0.1 * oldest).min(0.5 * run);
            let end = (oldest + ramp).min(run);
            [end - ramp, end]
        });
        let farthest = ways.iter().zip(&onsets).flat_map(|(&way, &[_, end])| {
            let sent = passed.iter().map(move |&[s, _]| s.min(end));
            sent.flat_map(move |s| away(s, way))
        });
        Some(Self {
            wavenumbers: [longest, largest],
            onsets,
            farthest: farthest.fold(0.0, f64::max),
        })
    }

    /// Distances run between which the oldest waves k set in \[m\]; those of the longest steady wave for longer ones.
    pub(super) fn onset(&self, k: f64) -> [f64; 2] {
        let [longest, largest] = self.wavenumbers;
        let last = (KNOTS - 1) as f64;
        let at = (last * (k - longest) / (largest - longest)).clamp(0.0, last);
        let knot = (at as usize).min(KNOTS - 2);
        let [before, after] = [self.onsets[knot], self.onsets[knot + 1]];
        [0, 1].map(|n| before[n] + (at - knot as f64) * (after[n] - before[n]))
    }
}

/// Way of a steady wave while its ship runs one metre, ahead and aside: the group speed over the ship's, in the direction
/// that keeps station, cos θ = ω/(kU).
fn steady_way(wake: &KelvinWake, k: f64) -> [f64; 2] {
    let cos = (angular_frequency(k, wake.depth) / (k * wake.speed)).min(1.0);
    let group = group_speed(k, wake.depth) / wake.speed;
    [group * cos, group * (1.0 - cos * cos).sqrt()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hull::Hull;
    use crate::track::Track;

    /// Turns so wide that they are straight have the waves of each other, found in a few steps.
    #[test]
    fn of_wide_turns_the_waves_of_a_straight_track_are_sent() {
        let raster = Raster::image(91, 91, 2.0);
        let sent = [1e6f64, 1e9].map(|radius| {
            let wake = KelvinWake {
                hull: Hull::wigley(20.0, 4.0, 1.5),
                speed: 5.0,
                track: Track::turning([10.0, 20.0], 20.0, 0.0, radius.recip()),
                depth: f64::INFINITY,
                filter_depth: 4.0,
                steepness: None,
            };
            Sent::of(&wake, &raster, radius).unwrap()
        });
        assert!((sent[0].farthest / sent[1].farthest - 1.0).abs() < 1e-3);
        assert!(sent[0].farthest < 500.0, "{}", sent[0].farthest);
    }

    /// A wide turn is straight as far as the raster sees. On deep water with c² = cos² θ = k₀/k the wave k that a ship in its
    /// middle sent a distance s ago lies √((1 − c²/2)² + c²(1 − c²)/4) s away: at the distance h of a corner it is the last
    /// that reaches the raster, and three wavelengths later none are sent.
    #[test]
    fn only_waves_that_reach_the_raster_are_sent() {
        let radius = 2000.0f64;
        let wake = KelvinWake {
            hull: Hull::wigley(20.0, 4.0, 1.5),
            speed: 5.0,
            track: Track::turning([0.0, 0.0], 20.0, 0.0, radius.recip()),
            depth: f64::INFINITY,
            filter_depth: 4.0,
            steepness: None,
        };
        let raster = Raster::image(91, 91, 2.0);
        let sent = Sent::of(&wake, &raster, radius).unwrap();
        let half = 90.0 * f64::sqrt(2.0);
        // A step of the search is looked beyond, and one is its resolution; the turn bends 290 m by 21 m, 1 m more.
        let step = STEPS[0] * half;
        let [longest, largest] = sent.wavenumbers;
        for knot in [0, 3, KNOTS - 1] {
            let k = |knot: usize| longest + (largest - longest) * knot as f64 / (KNOTS - 1) as f64;
            // Shorter waves stay behind less: of the knots around, the one before is the latest.
            let square = longest / k(knot.saturating_sub(1));
            let away = (1.0 - 0.5 * square).hypot(0.5 * (square * (1.0 - square)).sqrt());
            let [from, to] = sent.onset(k(knot));
            // They are sent over a stretch of the track.
            let with_stretch = |s: f64| s + (s * s * TAU / k(knot)).cbrt();
            let [least, most] = [half / away - 1.0, (half + step) / away + step + 1.0];
            assert!(
                from > with_stretch(least) && from < with_stretch(most),
                "{knot}: {from}"
            );
            let wavelength = TAU * wake.speed.powi(2) / crate::constants::GRAVITY;
            assert!((to - from - ONSET * wavelength).abs() < 1e-9, "{to}");
        }
        // The last of the longest waves are half as far away as their source; none are farther than the last sources.
        let [_, to] = sent.onset(longest);
        assert!(sent.farthest > 0.49 * to && sent.farthest < to);
    }

    #[test]
    fn waves_that_pass_the_raster_by_are_none() {
        let wake = |position| KelvinWake {
            hull: Hull::wigley(20.0, 4.0, 1.5),
            speed: 5.0,
            track: Track::turning(position, 20.0, 0.0, 1e-2),
            depth: f64::INFINITY,
            filter_depth: 4.0,
            steepness: None,
        };
        let raster = Raster::image(91, 91, 2.0);
        assert!(Sent::of(&wake([0.0, 0.0]), &raster, 100.0).is_some());
        assert!(Sent::of(&wake([2000.0, 0.0]), &raster, 100.0).is_none());
        // Waves of a raster too coarse for the longest of them.
        let coarse = Raster::image(9, 9, 20.0);
        assert!(Sent::of(&wake([0.0, 0.0]), &coarse, 100.0).is_none());
    }
}
