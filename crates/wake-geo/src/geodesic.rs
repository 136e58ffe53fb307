//! Geodesics on the WGS84 ellipsoid.

use geographiclib_rs::{DirectGeodesic, Geodesic, InverseGeodesic};

/// Shortest line between two places.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Track {
    /// Length \[m\].
    pub distance: f64,
    /// Direction at the start, clockwise from true north, in [0, 360) \[degrees\].
    pub azimuth: f64,
}

/// Geodesic from one (latitude, longitude) to another \[degrees\]; C. F. F. Karney, *Algorithms for geodesics* (2013).
pub fn track(from: (f64, f64), to: (f64, f64)) -> Track {
    let (distance, azimuth, _, _) = Geodesic::wgs84().inverse(from.0, from.1, to.0, to.1);
    Track {
        distance,
        azimuth: azimuth.rem_euclid(360.0) % 360.0,
    }
}

/// The (latitude, longitude) at a distance \[m\] from a place, in a direction clockwise from true north \[degrees\].
pub fn destination(from: (f64, f64), azimuth: f64, distance: f64) -> (f64, f64) {
    let (latitude, longitude) = Geodesic::wgs84().direct(from.0, from.1, azimuth, distance);
    (latitude, longitude)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Karney's example, from JFK to the north-east; and lines along a meridian and the equator.
    #[test]
    fn tracks_are_those_of_geographiclib() {
        let to = (32.621100463725796, 49.052487092959836);
        let found = track((40.64, -73.78), to);
        assert!((found.distance - 10e6).abs() < 1e-6 && (found.azimuth - 45.0).abs() < 1e-9);
        let found = destination((40.64, -73.78), 45.0, 10e6);
        assert!((found.0 - to.0).abs() < 1e-11 && (found.1 - to.1).abs() < 1e-11);
        let degree = track((0.0, 179.5), (0.0, -179.5));
        assert!((degree.azimuth - 90.0).abs() < 1e-9);
        assert!((degree.distance - 6_378_137.0 * std::f64::consts::PI / 180.0).abs() < 1e-6);
        assert!((track((10.0, 5.0), (9.0, 5.0)).azimuth - 180.0).abs() < 1e-9);
    }
}
