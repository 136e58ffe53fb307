//! The straight track of a ship: where it is, which way it goes, and places seen from it.

use crate::raster::Raster;

/// A ship's place and direction at one instant.
///
/// Places seen from the ship are (ξ, η): ξ forward of midship along the track, η to port of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Track {
    /// Midship (x, y) \[m\].
    pub position: [f64; 2],
    /// Unit vector (x, y) the ship moves along.
    pub forward: [f64; 2],
}

impl Track {
    /// The track of a ship that passed `start` at time 0.
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
        }
    }

    /// Unit vector to port: `forward` turned by 90° against the clock.
    #[must_use]
    pub fn port(&self) -> [f64; 2] {
        [-self.forward[1], self.forward[0]]
    }

    /// The place (x, y) \[m\] as seen from the ship, (ξ, η) \[m\].
    #[must_use]
    pub fn seen_from_ship(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (dx, dy) = (x - self.position[0], y - self.position[1]);
        let ([fx, fy], [px, py]) = (self.forward, self.port());
        [dx * fx + dy * fy, dx * px + dy * py]
    }

    /// The place (x, y) \[m\] of what is seen from the ship at (ξ, η) \[m\].
    #[must_use]
    pub fn on_sea(&self, seen: [f64; 2]) -> [f64; 2] {
        let [dx, dy] = self.turned(seen);
        [self.position[0] + dx, self.position[1] + dy]
    }

    /// A vector (along the track, to port) in the directions (x, y).
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

    /// Heading 0: port is toward −x. There and back again changes nothing.
    #[test]
    fn seen_from_ship_and_back() {
        let north = Track::new([0.0, 0.0], 0.0, 0.0);
        assert_eq!(north.seen_from_ship([-5.0, 2.0]), [2.0, 5.0]);
        let track = Track::new([10.0, 20.0], 33.0, 5.0);
        let back = track.on_sea(track.seen_from_ship([7.0, -9.0]));
        assert!((back[0] - 7.0).abs() < 1e-13 && (back[1] + 9.0).abs() < 1e-13);
    }
}
