//! Imaging geometry of a point: line of sight, azimuth displacement, layover.

pub use crate::track::direction;

/// Velocity toward the radar, positive when the point approaches.
///
/// ```text
/// u_r = v_z cos θ − v_x sin θ
/// ```
///
/// - `velocity_x` `v_x` [m/s], away from the radar; `velocity_z` `v_z` [m/s], upward
/// - `incidence` θ \[rad\]
/// - returns `u_r` [m/s]; the same sum of two accelerations is the acceleration toward the radar [m/s²]
#[must_use]
pub fn radial_velocity(velocity_x: f64, velocity_z: f64, incidence: f64) -> f64 {
    velocity_z * incidence.cos() - velocity_x * incidence.sin()
}

/// Velocity of a ship toward the radar.
///
/// ```text
/// u_r = −U sin(heading) sin θ
/// ```
///
/// - `speed` U [m/s]; `heading` of its motion [deg clockwise from azimuth]; `incidence` θ \[rad\]
/// - returns `u_r` [m/s], negative for a ship that moves away from the radar
#[must_use]
pub fn ship_radial_velocity(speed: f64, heading: f64, incidence: f64) -> f64 {
    radial_velocity(speed * direction(heading)[0], 0.0, incidence)
}

/// Azimuth displacement of a moving point: imaged minus true azimuth.
///
/// ```text
/// Δy = (R/V) u_r
/// ```
///
/// - `range_to_velocity` R/V \[s\]; `radial_velocity` `u_r` [m/s], toward the radar positive
/// - returns Δy \[m\]: along the flight for a point that approaches
///
/// # References
///
/// Raney (1971), IEEE Trans. Aerosp. Electron. Syst. 7; Alpers and Rufenach (1979), IEEE Trans. Antennas
/// Propag. 27.
#[must_use]
pub fn azimuth_displacement(range_to_velocity: f64, radial_velocity: f64) -> f64 {
    range_to_velocity * radial_velocity
}

/// Layover of an elevated point: imaged minus true ground range.
///
/// ```text
/// Δx = −ζ cot θ
/// ```
///
/// - `elevation` ζ \[m\]; `incidence` θ \[rad\]
/// - returns Δx \[m\]: toward the radar for a crest
#[must_use]
pub fn layover(elevation: f64, incidence: f64) -> f64 {
    -elevation / incidence.tan()
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "exact by construction")]
mod tests {
    use super::*;

    #[test]
    fn directions_are_clockwise_from_azimuth() {
        assert_eq!(direction(0.0), [0.0, 1.0]);
        assert_eq!(direction(90.0), [1.0, 0.0]);
        assert_eq!(direction(180.0), [0.0, -1.0]);
        assert_eq!(direction(270.0), [-1.0, 0.0]);
        assert_eq!(direction(-90.0), direction(270.0));
        for degrees in [0.3, 44.9, 45.1, 135.0, 200.0, 314.9, 359.9, 725.0] {
            let [x, y] = direction(degrees);
            let (sin, cos) = f64::to_radians(degrees).sin_cos();
            // One rounding of the angle, at most 725°.
            assert!((x - sin).abs() < 1e-14 && (y - cos).abs() < 1e-14);
        }
    }

    #[test]
    fn approaching_is_positive() {
        let incidence = 0.5;
        // A point that rises, or moves toward the radar (−x), approaches it.
        assert!(radial_velocity(0.0, 1.0, incidence) > 0.0);
        assert!(radial_velocity(-1.0, 0.0, incidence) > 0.0);
        // Motion along the line of sight (sin θ, −cos θ), away from the radar, counts fully.
        let (sin, cos) = f64::sin_cos(incidence);
        assert!((radial_velocity(sin, -cos, incidence) + 1.0).abs() < 1e-15);
        assert!(radial_velocity(cos, sin, incidence).abs() < 1e-15);
    }

    #[test]
    fn a_receding_ship_is_displaced_against_the_flight() {
        let incidence = 32f64.to_radians();
        let away = ship_radial_velocity(10.0, 90.0, incidence);
        assert!((away + 10.0 * incidence.sin()).abs() < 1e-14);
        assert!(azimuth_displacement(78.0, away) < -400.0);
        assert_eq!(ship_radial_velocity(10.0, 0.0, incidence), 0.0);
        assert_eq!(ship_radial_velocity(10.0, 180.0, incidence), 0.0);
    }

    #[test]
    fn a_crest_leans_toward_the_radar() {
        assert!((layover(2.0, std::f64::consts::FRAC_PI_4) + 2.0).abs() < 1e-15);
    }
}
