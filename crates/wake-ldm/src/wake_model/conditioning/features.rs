//! Fourier features of a scene's numbers, which a network resolves more easily than single values.

use wake_physics::Scene;
use wake_physics::scene::Polarization;

/// Range of a number, which values may exceed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Range {
    low: f64,
    high: f64,
}

impl Range {
    const fn new(low: f64, high: f64) -> Self {
        Self { low, high }
    }

    /// Scales numbers in the range to −1…1.
    pub(super) fn scaled(self, value: f64) -> f64 {
        2.0 * (value - self.low) / (self.high - self.low) - 1.0
    }

    /// Inverse of [`scaled`](Self::scaled).
    pub(super) fn unscaled(self, u: f64) -> f64 {
        self.low + 0.5 * (u + 1.0) * (self.high - self.low)
    }
}

/// Ship speed [m/s].
pub(super) const SHIP_SPEED: Range = Range::new(0.0, 16.0);
/// Midship x or y \[m\].
pub(super) const PLACE: Range = Range::new(-512.0, 512.0);
/// Wind speed [m/s].
pub(super) const WIND_SPEED: Range = Range::new(0.0, 12.0);
/// log₁₀ of the fetch \[m\].
pub(super) const LOG_FETCH: Range = Range::new(3.0, 6.0);
/// Incidence angle \[deg\].
pub(super) const INCIDENCE: Range = Range::new(10.0, 40.0);

/// log₁₀ of the ship's length \[m\].
const LOG_LENGTH: Range = Range::new(0.5, 3.0);
/// log₁₀ of the water depth \[m\], as far as it affects waves.
const LOG_DEPTH: Range = Range::new(0.0, 3.0);
/// Significant height of the swell \[m\].
const SWELL_HEIGHT: Range = Range::new(0.0, 6.0);
/// log₁₀ of the swell's length \[m\].
const LOG_SWELL: Range = Range::new(1.5, 3.0);
/// Incidence angle of all radars \[deg\].
const ANY_INCIDENCE: Range = Range::new(5.0, 65.0);
/// log₁₀ of the frequency \[Hz\].
const LOG_FREQUENCY: Range = Range::new(9.0, 10.3);
/// Range over platform speed \[s\].
const RANGE_TO_VELOCITY: Range = Range::new(0.0, 150.0);
/// log₁₀ of a resolution or a pixel's side \[m\].
const LOG_SIZE: Range = Range::new(-0.5, 2.0);
/// Noise floor \[dB\].
const NOISE: Range = Range::new(-40.0, 0.0);
/// Depth beyond which the relevant waves are not affected by the bottom \[m\].
const DEEP: f64 = 1000.0;
/// Reference side of a pixel \[m\]: positions on other pixels are scaled to it.
pub(super) const TOLD_SPACING: f64 = 4.0;

/// Waves per number, each with a sine and a cosine.
const WAVES_PER_NUMBER: usize = 4;
/// Harmonics per direction.
const HARMONICS: usize = 3;
/// Flags: any ship, horizontal polarization, breaking waves.
const FLAGS: usize = 3;
/// Numbers with a range: four of the ship, five of the sea, seven of radar and pixels.
const NUMBERS: usize = 16;
/// Directions: of the ship, of the wind and of the swell.
const DIRECTIONS: usize = 3;

/// Length of [`features`].
pub const FEATURES: usize =
    FLAGS + NUMBERS * (2 + 2 * WAVES_PER_NUMBER) + DIRECTIONS * (1 + 2 * HARMONICS);

/// Feature vector of a scene; missing values are 0.
///
/// ```text
/// number v in [a, b]:  u = 2 (v − a)/(b − a) − 1,   [1, u, sin(2^i π u/2), cos(2^i π u/2)],  i = 0…3
/// direction φ:         [1, sin(iφ), cos(iφ)],  i = 1…3
/// ```
///
/// For the ship, if there is only one: speed, position, log₁₀ of its length, heading; for the sea: wind, log₁₀ of fetch and
/// depth, swell; for the radar: incidence, frequency, R/V, resolutions, noise floor; the pixel. For values beyond a range, the
/// shorter waves repeat. Gusts, slicks and echoes are in the expected image.
pub fn features(scene: &Scene) -> Vec<f32> {
    let (sea, radar, spacing) = (&scene.sea, &scene.radar, scene.grid.spacing);
    let mut out = Vec::with_capacity(FEATURES);
    let hh = radar.polarization == Polarization::HH;
    out.extend(
        [!scene.ships.is_empty(), hh, sea.breaking].map(|flag| if flag { 1.0 } else { 0.0 }),
    );
    let ship = match scene.ships.as_slice() {
        [ship] => Some(ship),
        _ => None,
    };
    let place = |axis: usize| ship.map(|s| s.position[axis] * TOLD_SPACING / spacing);
    let swell = (sea.swell_height > 0.0).then_some(sea);
    let log = f64::log10;
    for (value, range) in [
        (ship.map(|s| s.speed), SHIP_SPEED),
        (place(0), PLACE),
        (place(1), PLACE),
        (ship.map(|s| log(s.length)), LOG_LENGTH),
        (Some(sea.wind_speed), WIND_SPEED),
        (Some(log(sea.fetch)), LOG_FETCH),
        (Some(log(sea.depth.min(DEEP))), LOG_DEPTH),
        (swell.map(|s| s.swell_height), SWELL_HEIGHT),
        (swell.map(|s| log(s.swell_length)), LOG_SWELL),
        (Some(radar.incidence), ANY_INCIDENCE),
        (Some(log(radar.frequency)), LOG_FREQUENCY),
        (Some(radar.range_to_velocity), RANGE_TO_VELOCITY),
        (Some(log(radar.azimuth_resolution)), LOG_SIZE),
        (radar.range_resolution.map(log), LOG_SIZE),
        (radar.nesz, NOISE),
        (Some(log(spacing)), LOG_SIZE),
    ] {
        push_number(&mut out, value, range);
    }
    push_direction(&mut out, ship.map(|s| s.heading));
    push_direction(&mut out, (sea.wind_speed > 0.0).then_some(sea.wind_toward));
    push_direction(&mut out, swell.map(|s| s.swell_toward));
    out
}

fn push_number(out: &mut Vec<f32>, value: Option<f64>, range: Range) {
    let Some(value) = value else {
        out.resize(out.len() + 2 + 2 * WAVES_PER_NUMBER, 0.0);
        return;
    };
    let u = range.scaled(value);
    out.extend([1.0, u as f32]);
    for i in 0..WAVES_PER_NUMBER {
        let (sin, cos) = (std::f64::consts::FRAC_PI_2 * u * f64::from(1 << i)).sin_cos();
        out.extend([sin as f32, cos as f32]);
    }
}

fn push_direction(out: &mut Vec<f32>, degrees: Option<f64>) {
    let Some(degrees) = degrees else {
        out.resize(out.len() + 1 + 2 * HARMONICS, 0.0);
        return;
    };
    out.push(1.0);
    for i in 1..=HARMONICS {
        let (sin, cos) = (i as f64 * degrees.to_radians()).sin_cos();
        out.extend([sin as f32, cos as f32]);
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;

    fn full() -> Scene {
        let assignments = [
            "ship.position=[0.0, 100.0]",
            "sea.swell_height=1.5",
            "radar.range_resolution=5.0",
            "radar.noise_floor=-22.0",
        ];
        Scene::default().with_assignments(&assignments).unwrap()
    }

    /// Indices of the features that differ.
    fn changed(a: &Scene, b: &Scene) -> Vec<usize> {
        let (a, b) = (features(a), features(b));
        (0..FEATURES)
            .filter(|&i| (a[i] - b[i]).abs() > 1e-6)
            .collect()
    }

    #[test]
    fn lengths_agree_and_what_is_not_there_is_zero() {
        assert_eq!(features(&full()).len(), FEATURES);
        let mut open = full();
        open.ships.clear();
        let number = 2 + 2 * WAVES_PER_NUMBER;
        let of_open = features(&open);
        assert!(of_open[FLAGS..FLAGS + 4 * number].iter().all(|&x| x == 0.0));
        assert_eq!(of_open.len(), FEATURES);
        // With several ships, none has features of its own.
        let mut two = full();
        two.ships.push(two.ships[0].clone());
        assert_eq!(features(&two)[1..], of_open[1..]);
    }

    #[test]
    fn directions_close_the_circle() {
        let mut turned = full();
        turned.ships[0].heading += 360.0;
        assert!(changed(&full(), &turned).is_empty());
    }

    /// Each number of the scene has features of its own, which no other number changes.
    #[test]
    fn each_number_changes_only_its_own_features() {
        let number = 2 + 2 * WAVES_PER_NUMBER;
        let numbers = FLAGS..FLAGS + NUMBERS * number;
        let assignments = [
            "ship.speed=9.0",
            "ship.position=[30.0, 100.0]",
            "ship.position=[0.0, 130.0]",
            "ship.length=100.0",
            "sea.wind_speed=6.0",
            "sea.fetch=2e4",
            "sea.depth=40.0",
            "sea.swell_height=2.0",
            "sea.swell_length=150.0",
            "radar.incidence=35.0",
            "radar.frequency=5.4e9",
            "radar.range_to_velocity=110.0",
            "radar.resolution=7.0",
            "radar.range_resolution=8.0",
            "radar.noise_floor=-25.0",
        ];
        for (n, assignment) in assignments.iter().enumerate() {
            let other = full().with_assignments(&[assignment]).unwrap();
            let (first, found) = (numbers.start + n * number, changed(&full(), &other));
            assert!(
                found.len() >= 5 && found.iter().all(|i| (first..first + number).contains(i)),
                "{assignment}: {found:?}"
            );
        }
        // A coarser pixel changes its features, and the same ship is fewer pixels away.
        let coarse = full().with_assignments(&["grid.spacing=10.0"]).unwrap();
        let found = changed(&full(), &coarse);
        let last = numbers.end - number..numbers.end;
        assert!(
            found.iter().any(|i| last.contains(i)) && found.iter().any(|i| *i < FLAGS + 3 * number)
        );
        for (n, assignment) in ["radar.polarization=HH", "sea.breaking=true"]
            .iter()
            .enumerate()
        {
            let other = full().with_assignments(&[assignment]).unwrap();
            assert_eq!(changed(&full(), &other), [n + 1], "{assignment}");
        }
        for (n, assignment) in [
            "ship.heading=50.0",
            "sea.wind_toward=80.0",
            "sea.swell_toward=9.0",
        ]
        .iter()
        .enumerate()
        {
            let other = full().with_assignments(&[assignment]).unwrap();
            let first = numbers.end + n * (1 + 2 * HARMONICS);
            let found = changed(&full(), &other);
            let own = first..first + 1 + 2 * HARMONICS;
            assert!(
                !found.is_empty() && found.iter().all(|i| own.contains(i)),
                "{assignment}"
            );
        }
    }

    #[test]
    fn ends_are_minus_one_and_one_and_scaling_goes_both_ways() {
        for (value, u) in [(10.0, -1.0), (25.0, 0.0), (40.0, 1.0), (55.0, 2.0)] {
            assert!((INCIDENCE.scaled(value) - u).abs() < 1e-12);
            assert!((INCIDENCE.unscaled(u) - value).abs() < 1e-12);
        }
    }
}
