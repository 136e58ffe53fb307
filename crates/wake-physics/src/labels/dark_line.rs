//! The turbulent wake as the radar shows it.

use super::short_waves::Profile;
use crate::turbulent::TurbulentWake;
use crate::turbulent::current::WakeEdge;
use std::f64::consts::{PI, SQRT_2};

/// Number of places across a window at which a change is computed.
const PLACES: usize = 16;

/// Distance beyond which edges are ignored, in standard deviations of the smeared damping: their current has fallen to e⁻⁸ of its
/// maximum.
const FARTHEST_EDGE: f64 = 8.0;

/// The turbulent wake as the radar shows it, smeared in azimuth: its dark line and its edges.
pub(super) struct DarkLine {
    pub(super) wake: TurbulentWake,
    /// The edges, if they are drawn.
    pub(super) edge: Option<WakeEdge>,
    /// Share of the intensity that full damping removes, 0 if the dark line is not drawn.
    damped: f64,
    /// Share of the intensity that the edges multiply.
    multiplied: f64,
    /// Standard deviation of the smear across the track \[m\].
    smear: f64,
}

/// The dark line at a distance, and the change by the ship's short waves there.
pub(super) struct DarkNearby<'a> {
    pub(super) line: &'a DarkLine,
    pub(super) short: Option<&'a Profile>,
}

impl DarkLine {
    /// Dark line as an image shows it.
    ///
    /// - `edge`: edges of the wake, if they are drawn
    /// - `damped`, `multiplied`: shares of the intensity that full damping removes and that the edges multiply
    /// - `resolution`: azimuth resolution \[m\]
    pub(super) fn new(
        wake: TurbulentWake,
        edge: Option<WakeEdge>,
        [damped, multiplied]: [f64; 2],
        resolution: f64,
    ) -> Self {
        let deviation = resolution / (SQRT_2 * PI);
        Self {
            edge,
            damped,
            multiplied,
            // The smear acts along azimuth: take the y component of the direction to port.
            smear: deviation * wake.track.port()[1].abs(),
            wake,
        }
    }

    /// Standard deviations of the damping across the track, without and with the smear \[m\].
    fn deviations(&self, distance: f64) -> [f64; 2] {
        let own = 0.5 * crate::turbulent::width(self.wake.beam, distance);
        [own, own.hypot(self.smear)]
    }

    /// Half-width \[m\]: two standard deviations of the damping, or three with edges, which are strongest at two.
    pub(super) fn half_width(&self, distance: f64) -> f64 {
        let reach = if self.edge.is_some() { 3.0 } else { 2.0 };
        reach * self.deviations(distance)[1]
    }

    /// Mean squared changes over a window `width` wide around a place `off` the track \[m\]: by the turbulent wake, by the ship's
    /// short waves, and by both.
    pub(super) fn mean_squares(
        &self,
        distance: f64,
        off: f64,
        width: f64,
        short: Option<&Profile>,
    ) -> [f64; 3] {
        let mut sums = [0.0; 3];
        for n in 0..PLACES {
            let at = off + ((n as f64 + 0.5) / PLACES as f64 - 0.5) * width;
            let dark = self.edges(distance, at) - self.damping(distance, at);
            let short = short.map_or(0.0, |profile| self.short(profile, at));
            for (sum, change) in sums.iter_mut().zip([dark, short, dark + short]) {
                *sum += change * change;
            }
        }
        sums.map(|sum| sum / PLACES as f64)
    }

    /// Smeared change by the ship's short waves at a place.
    fn short(&self, profile: &Profile, at: f64) -> f64 {
        if at.abs() > profile.reach() + 3.0 * self.smear {
            return 0.0;
        }
        self.multiplied * self.smeared(profile.step(), at, |port| profile.at(port))
    }

    /// Smeared decrease by damping at a place.
    fn damping(&self, distance: f64, at: f64) -> f64 {
        let [own, wide] = self.deviations(distance);
        let centre = self.wake.suppression.damping(self.wake.speed, distance);
        self.damped * centre * own / wide * (-0.5 * (at / wide).powi(2)).exp()
    }

    /// Smeared change by the edges at a place, acting on what damping leaves there.
    fn edges(&self, distance: f64, at: f64) -> f64 {
        let [own, wide] = self.deviations(distance);
        let Some(edge) = self.edge.filter(|_| at.abs() < FARTHEST_EDGE * wide) else {
            return 0.0;
        };
        let forward = -distance - 0.5 * self.wake.length;
        let damped = self.damped / self.multiplied;
        let change = |port: f64| {
            let left = 1.0 - damped * self.wake.damping([forward, port]);
            left * (edge.factor([forward, port]) - 1.0)
        };
        self.multiplied * self.smeared(own / 3.0, at, change)
    }

    /// Mean of a change over the smear, by a sum in steps of half its standard deviation, or of `finest` if that is smaller.
    fn smeared(&self, finest: f64, at: f64, change: impl Fn(f64) -> f64) -> f64 {
        let step = (0.5 * self.smear).min(finest);
        let half = if step > 0.0 {
            (3.0 * self.smear / step).ceil() as i32
        } else {
            0
        };
        let weighed = (-half..=half).map(|n| {
            let shift = f64::from(n) * step;
            let weight = match n {
                0 => 1.0,
                _ => (-0.5 * (shift / self.smear).powi(2)).exp(),
            };
            [weight * change(at - shift), weight]
        });
        let [sum, weights] = weighed.fold([0.0; 2], |[a, b], [c, d]| [a + c, b + d]);
        sum / weights
    }
}

#[cfg(test)]
mod tests {
    use super::DarkLine;
    use crate::track::Track;
    use crate::turbulent::current::{EdgeResponse, WakeCurrent, WakeEdge};
    use crate::turbulent::{Suppression, TurbulentWake};

    /// Mean squares over windows across the track agree with sums over the damping itself and a Gaussian smear, at places ten
    /// times closer. The window's 16 places leave an error of a thousandth where the window is no wider than the line.
    #[test]
    fn the_dark_line_of_a_window_is_that_of_the_smeared_wake() {
        let wake = TurbulentWake {
            track: Track::new([0.0, 0.0], 0.0, 0.0),
            speed: 8.0,
            length: 100.0,
            beam: 15.0,
            suppression: Suppression::Given(0.6),
        };
        let line = DarkLine {
            wake,
            edge: None,
            damped: 0.7,
            multiplied: 1.0,
            smear: 12.0,
        };
        let astern = |distance: f64| -distance - 50.0;
        let smeared = |distance: f64, off: f64| -> f64 {
            let weight = |s: f64| (-0.5 * (s / line.smear).powi(2)).exp();
            let steps = (-600..=600).map(|n| 0.1 * f64::from(n));
            let (sum, weights) = steps.fold((0.0, 0.0), |(sum, weights), s| {
                let damping = wake.damping([astern(distance), off - s]);
                (sum + weight(s) * damping, weights + weight(s))
            });
            line.damped * sum / weights
        };
        for (distance, off, width) in [
            (300.0, 0.0, 40.0),
            (300.0, 35.0, 40.0),
            (2000.0, -20.0, 30.0),
        ] {
            let at = |n: i32| off + ((f64::from(n) + 0.5) / 160.0 - 0.5) * width;
            let squares = (0..160).map(|n| smeared(distance, at(n)).powi(2));
            let expected = squares.sum::<f64>() / 160.0;
            let found = line.mean_squares(distance, off, width, None)[0];
            assert!(
                (found / expected - 1.0).abs() < 2e-3,
                "{distance} {off}: {found} {expected}"
            );
        }
    }

    /// Edges contribute their factor on what damping leaves, smeared: compared with a sum over the smear in steps of 0.1 m to ten
    /// standard deviations. The sum for labels ends at three, where 0.3 % of the weight is left.
    #[test]
    fn edges_add_their_factor_on_what_damping_leaves() {
        let wake = TurbulentWake {
            track: Track::new([0.0, 0.0], 70.0, 0.0),
            speed: 8.0,
            length: 100.0,
            beam: 15.0,
            suppression: Suppression::Given(0.6),
        };
        let edge = WakeEdge {
            current: WakeCurrent::of_wind(wake.speed, wake.beam, 0.1, 4.0),
            wind: [0.0, 4.0],
            track: wake.track,
            length: wake.length,
            response: EdgeResponse::Given(400.0),
        };
        let line = DarkLine {
            wake,
            edge: Some(edge),
            damped: 0.6,
            multiplied: 0.8,
            smear: 12.0,
        };
        let mut largest = 0.0f64;
        for (distance, off) in [(300.0, 0.0), (300.0, 35.0), (300.0, -60.0), (1500.0, 90.0)] {
            let change = |port: f64| {
                let seen = [-distance - 50.0, port];
                (0.8 - 0.6 * wake.damping(seen)) * (edge.factor(seen) - 1.0)
            };
            let weight = |s: f64| (-0.5 * (s / line.smear).powi(2)).exp();
            let steps = (-1200..=1200).map(|n| 0.1 * f64::from(n));
            let (sum, weights) = steps.fold((0.0, 0.0), |(sum, weights), s| {
                (sum + weight(s) * change(off - s), weights + weight(s))
            });
            let expected = sum / weights;
            let found = line.edges(distance, off);
            assert!(
                (found - expected).abs() < 3e-3,
                "{distance} {off}: {found} {expected}"
            );
            largest = largest.max(expected.abs());
        }
        assert!(largest > 0.1, "{largest}");
        // Beyond eight standard deviations there is no change.
        assert!(line.edges(300.0, 1e3).abs() < f64::MIN_POSITIVE);
    }
}
