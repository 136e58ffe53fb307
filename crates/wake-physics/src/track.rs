//! Track of a ship, straight or on a circle: its place, its direction, and places seen from it.

use crate::raster::Raster;
use std::f64::consts::PI;
use std::ops::Range;

/// Place and direction of a ship at one instant, and the curve along which it came.
///
/// Places seen from the ship are (ξ, η): ξ forward of midship along the track, η to port of it. On a turning track ξ is the
/// length of arc to the point of the track nearest to the place, negative astern. The ship has turned by half a circle and came
/// straight before; ahead, its track is a quarter of the circle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Track {
    /// Midship (x, y) \[m\].
    pub position: [f64; 2],
    /// Unit vector (x, y) along which the ship moves.
    pub forward: [f64; 2],
    /// Curvature κ [1/m]: the turn to starboard over the distance run \[rad/m\]; 0 on a straight track.
    pub curvature: f64,
}

impl Track {
    /// The straight track of a ship that passed `start` at time 0.
    ///
    /// ```text
    /// forward = (sin χ, cos χ),    position = start + U t · forward
    /// ```
    ///
    /// - `start` (x, y) \[m\]
    /// - `heading` χ [deg clockwise from +y], any finite value
    /// - `distance` U t run since time 0 \[m\]
    #[must_use]
    pub fn new(start: [f64; 2], heading: f64, distance: f64) -> Self {
        let forward = direction(heading);
        Self {
            position: [0, 1].map(|axis| start[axis] + distance * forward[axis]),
            forward,
            curvature: 0.0,
        }
    }

    /// The track of a ship on a circle that passed `start` with a `heading` at time 0.
    ///
    /// ```text
    /// position = start + (sin κs/κ) · forward + ((1 − cos κs)/κ) · starboard,    s = U t
    /// ```
    ///
    /// - `curvature` κ [1/m], positive to starboard; 0 is [`Track::new`]
    #[must_use]
    pub fn turning(start: [f64; 2], heading: f64, distance: f64, curvature: f64) -> Self {
        if curvature == 0.0 {
            return Self::new(start, heading, distance);
        }
        let [fx, fy] = direction(heading);
        let turned = curvature * distance;
        let (ahead, aside) = (turned.sin() / curvature, (1.0 - turned.cos()) / curvature);
        Self {
            position: [
                start[0] + ahead * fx + aside * fy,
                start[1] + ahead * fy - aside * fx,
            ],
            forward: direction(heading + turned.to_degrees()),
            curvature,
        }
    }

    /// Unit vector to port: `forward` turned by 90° against the clock.
    #[must_use]
    pub fn port(&self) -> [f64; 2] {
        [-self.forward[1], self.forward[0]]
    }

    /// Radius \[m\] and side of the turn, 1 to starboard and −1 to port; `None` on a straight track.
    pub(crate) fn turn(&self) -> Option<(f64, f64)> {
        (self.curvature != 0.0).then(|| (self.curvature.abs().recip(), self.curvature.signum()))
    }

    /// The ship with the same place and direction on a straight track.
    pub(crate) fn straight(&self) -> Self {
        Self {
            curvature: 0.0,
            ..*self
        }
    }

    /// Place and direction of the ship at ξ of its track \[m\], negative for the past.
    #[must_use]
    pub fn at(&self, along: f64) -> Self {
        let Some((radius, _)) = self.turn() else {
            return Self {
                position: self.on_sea([along, 0.0]),
                ..*self
            };
        };
        // Half a circle, and the straight line before it.
        let on_circle = along.max(-PI * radius);
        let turned = self.curvature * on_circle;
        let (sin, cos) = turned.sin_cos();
        let [fx, fy] = self.forward;
        let forward = [fx * cos + fy * sin, fy * cos - fx * sin];
        let (ahead, aside) = (sin / self.curvature, (1.0 - cos) / self.curvature);
        let straight = along - on_circle;
        Self {
            position: [
                self.position[0] + ahead * fx + aside * fy + straight * forward[0],
                self.position[1] + ahead * fy - aside * fx + straight * forward[1],
            ],
            forward,
            curvature: self.curvature,
        }
    }

    /// The place (x, y) \[m\] as seen from the ship, (ξ, η) \[m\].
    #[must_use]
    pub fn seen_from_ship(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (dx, dy) = (x - self.position[0], y - self.position[1]);
        let ([fx, fy], [px, py]) = (self.forward, self.port());
        let (ahead, port) = (dx * fx + dy * fy, dx * px + dy * py);
        let Some((radius, side)) = self.turn() else {
            return [ahead, port];
        };
        // From the centre of the circle toward the ship.
        let outward = radius + side * port;
        if ahead > 0.0 && outward < 0.0 {
            return [-PI * radius - ahead, side * (-outward - radius)];
        }
        let angle = ahead.atan2(outward);
        [radius * angle, side * (ahead.hypot(outward) - radius)]
    }

    /// The place (x, y) \[m\] of a point seen from the ship at (ξ, η) \[m\].
    #[must_use]
    pub(crate) fn on_sea(&self, [along, port]: [f64; 2]) -> [f64; 2] {
        if self.turn().is_some() {
            let there = self.at(along);
            let [px, py] = there.port();
            return [there.position[0] + port * px, there.position[1] + port * py];
        }
        let [dx, dy] = self.turned([along, port]);
        [self.position[0] + dx, self.position[1] + dy]
    }

    /// Converts a vector (along the track, to port) at the ship to the directions (x, y).
    #[must_use]
    pub fn turned(&self, [along, across]: [f64; 2]) -> [f64; 2] {
        let ([fx, fy], [px, py]) = (self.forward, self.port());
        [along * fx + across * px, along * fy + across * py]
    }

    /// The corners of a raster's outermost pixels as seen from the ship, in order around it.
    #[must_use]
    pub fn corners(&self, raster: &Raster) -> [[f64; 2]; 4] {
        let (bottom, right) = (raster.rows.max(1) - 1, raster.columns.max(1) - 1);
        [(0, 0), (0, right), (bottom, right), (bottom, 0)]
            .map(|(i, j)| self.seen_from_ship([raster.x(j), raster.y(i)]))
    }

    /// Upper bound on the distance astern of any place of a raster \[m\], at least 0.
    pub(crate) fn farthest_astern(&self, raster: &Raster) -> f64 {
        let corners = self.straight().corners(raster);
        match self.turn() {
            None => corners.iter().map(|c| -c[0]).fold(0.0, f64::max),
            Some((radius, _)) => {
                // The point of the track nearest to a place is no farther from it than the ship is, so its chord to the ship is
                // at most twice that distance, and its arc is at most π/2 times the chord.
                let distances = corners.iter().map(|c| c[0].hypot(c[1]));
                let farthest = distances.fold(0.0, f64::max);
                PI * farthest.min(radius)
                    + if farthest < radius {
                        0.0
                    } else {
                        2.0 * farthest
                    }
            }
        }
    }

    /// Distances astern of midship \[m\] at which the perpendicular of the track may cross a raster, in order: on a turn for the
    /// half circle and for the straight line before it, otherwise for the straight track and an empty range.
    pub(crate) fn astern(&self, raster: &Raster) -> [[f64; 2]; 2] {
        let of = |straight: Self| {
            let corners = straight.corners(raster).map(|corner| -corner[0]);
            let near = corners.iter().copied().fold(f64::INFINITY, f64::min);
            let far = corners.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            [near.max(0.0), far]
        };
        let Some((radius, _)) = self.turn() else {
            return [of(*self), [0.0, -1.0]];
        };
        let half_circle = PI * radius;
        let before = of(self.at(-half_circle).straight());
        [[0.0, half_circle], before.map(|d| half_circle + d)]
    }

    /// Columns of a row of a raster that may lie within `reach` \[m\] of the track.
    pub(crate) fn columns_within(&self, raster: &Raster, row: usize, reach: f64) -> Range<usize> {
        if self.turn().is_some() {
            return 0..raster.columns;
        }
        let across = |j: usize, i: usize| self.seen_from_ship([raster.x(j), raster.y(i)])[1];
        // Places seen from the ship change by the same step from pixel to pixel of a row.
        let step = across(1, 0) - across(0, 0);
        within(across(0, row), step, reach, raster.columns)
    }
}

/// The numbers j below `count` with |start + j·step| ≤ reach.
fn within(start: f64, step: f64, reach: f64, count: usize) -> Range<usize> {
    if step == 0.0 {
        return if start.abs() <= reach { 0..count } else { 0..0 };
    }
    let ends = [-reach, reach].map(|end| (end - start) / step);
    let first = ends[0].min(ends[1]).ceil().max(0.0) as usize;
    let last = (ends[0].max(ends[1]).floor() + 1.0).max(0.0) as usize;
    first.min(count)..last.min(count).max(first.min(count))
}

/// Unit vector (x, y) of a direction [deg clockwise from +y].
///
/// Multiples of 90° are exact.
#[must_use]
pub fn direction(degrees: f64) -> [f64; 2] {
    let turn = degrees.rem_euclid(360.0);
    let quarter = (turn / 90.0).round();
    let (sin, cos) = (turn - 90.0 * quarter).to_radians().sin_cos();
    match quarter as u8 % 4 {
        0 => [sin, cos],
        1 => [cos, -sin],
        2 => [-sin, -cos],
        _ => [-cos, sin],
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "exact by construction")]
mod tests {
    use super::*;

    #[test]
    fn headings_are_clockwise_from_azimuth() {
        for (heading, forward) in [
            (0.0, [0.0, 1.0]),
            (90.0, [1.0, 0.0]),
            (-180.0, [0.0, -1.0]),
            (630.0, [-1.0, 0.0]),
        ] {
            let track = Track::new([3.0, -2.0], heading, 10.0);
            for axis in 0..2 {
                let moved = [3.0, -2.0][axis] + 10.0 * forward[axis];
                assert!((track.forward[axis] - forward[axis]).abs() < 1e-15);
                assert!((track.position[axis] - moved).abs() < 1e-14);
            }
        }
    }

    /// Heading 0: port is toward −x. The round trip changes nothing.
    #[test]
    fn seen_from_ship_and_back() {
        let north = Track::new([0.0, 0.0], 0.0, 0.0);
        assert_eq!(north.seen_from_ship([-5.0, 2.0]), [2.0, 5.0]);
        let track = Track::new([10.0, 20.0], 33.0, 5.0);
        let back = track.on_sea(track.seen_from_ship([7.0, -9.0]));
        assert!((back[0] - 7.0).abs() < 1e-13 && (back[1] + 9.0).abs() < 1e-13);
    }

    #[test]
    fn columns_within_reach_are_those_counted_one_by_one() {
        for (start, step, reach) in [
            (-10.0, 0.7, 4.0),
            (3.0, -0.3, 2.0),
            (50.0, 1.0, 5.0),
            (-2.0, -1.0, 1.0),
            (1.0, 0.0, 2.0),
            (3.0, 0.0, 2.0),
        ] {
            let inside = |&j: &usize| (start + j as f64 * step).abs() <= reach;
            let counted: Vec<usize> = (0..40).filter(inside).collect();
            let range: Vec<usize> = within(start, step, reach, 40).collect();
            assert_eq!(range, counted, "{start} {step} {reach}");
        }
    }

    /// A ship of heading 0 that turns to starboard on a radius of 500 m: the centre is to the east, and it came from the
    /// south-east.
    #[test]
    fn a_turn_to_starboard_by_hand() {
        let track = Track::turning([0.0; 2], 0.0, 0.0, 1.0 / 500.0);
        let near = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]) < 1e-9;
        let quarter = track.at(-250.0 * PI);
        assert!(near(quarter.position, [500.0, -500.0]) && near(quarter.forward, [-1.0, 0.0]));
        let half = track.at(-500.0 * PI);
        assert!(near(half.position, [1000.0, 0.0]) && near(half.forward, [0.0, -1.0]));
        // A straight line before it.
        let before = track.at(-500.0 * PI - 70.0);
        assert!(near(before.position, [1000.0, 70.0]) && near(before.forward, half.forward));
        // Outside the circle is to port.
        assert!(near(
            track.seen_from_ship([500.0, -530.0]),
            [-250.0 * PI, 30.0]
        ));
        assert!(near(
            track.seen_from_ship([990.0, 70.0]),
            [-500.0 * PI - 70.0, -10.0]
        ));
        assert!(near(track.seen_from_ship([-20.0, 0.0]), [0.0, 20.0]));
        // A turn to port is the mirror image.
        let port = Track::turning([0.0; 2], 0.0, 0.0, -1.0 / 500.0);
        assert!(near(port.at(-250.0 * PI).position, [-500.0, -500.0]));
        assert!(near(
            port.seen_from_ship([-500.0, -530.0]),
            [-250.0 * PI, -30.0]
        ));
    }

    #[test]
    fn places_on_a_turn_go_there_and_back() {
        for curvature in [1.0 / 400.0, -1.0 / 700.0, 1e-6] {
            let track = Track::turning([30.0, -80.0], 130.0, 250.0, curvature);
            // A millionth of a radian of the circle rounds to 1e-10 of its radius.
            let rounding = 1e-9 + 1e-12 / curvature.abs();
            for seen in [
                [-300.0, 40.0],
                [-1200.0, -90.0],
                [-2900.0, 25.0],
                [60.0, 5.0],
            ] {
                let back = track.seen_from_ship(track.on_sea(seen));
                let far = (back[0] - seen[0]).hypot(back[1] - seen[1]);
                assert!(far < rounding, "{curvature} {seen:?} {back:?}");
            }
            // Back along the track to where it was at time 0, on its heading.
            let start = track.at(-250.0);
            let far = (start.position[0] - 30.0).hypot(start.position[1] + 80.0);
            assert!(far < rounding);
            let [fx, fy] = direction(130.0);
            assert!((start.forward[0] - fx).hypot(start.forward[1] - fy) < 1e-12);
        }
    }

    /// No place of a raster is farther astern than the bound, on any of several turns.
    #[test]
    fn the_farthest_place_astern_is_a_bound() {
        let raster = Raster::image(40, 60, 25.0);
        for radius in [200.0, 600.0, 5000.0] {
            for (x, y) in [(0.0, 0.0), (300.0, 900.0), (-2500.0, 100.0)] {
                let track = Track::turning([x, y], 70.0, 0.0, -1.0 / radius);
                let bound = track.farthest_astern(&raster);
                for (i, j) in (0..40).flat_map(|i| (0..60).map(move |j| (i, j))) {
                    let seen = track.seen_from_ship([raster.x(j), raster.y(i)]);
                    assert!(-seen[0] <= bound, "{radius} {x} {y}: {} {bound}", seen[0]);
                }
            }
        }
    }
}
