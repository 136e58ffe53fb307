//! Numbers as waves of several lengths, which a network tells apart more easily than one value.

use super::conditions::Conditions;

/// An open range of a number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Range {
    low: f64,
    high: f64,
}

impl Range {
    const fn new(low: f64, high: f64) -> Self {
        Self { low, high }
    }

    /// −1…1 for numbers in the range.
    pub(super) fn scaled(self, value: f64) -> f64 {
        2.0 * (value - self.low) / (self.high - self.low) - 1.0
    }

    /// The number that [`scaled`](Self::scaled) made `u` of.
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

/// Waves per number on an open range: each has a sine and a cosine.
const WAVES_PER_NUMBER: usize = 4;
/// Harmonics per direction.
const HARMONICS: usize = 3;
/// Numbers on an open range: speed, x and y of the ship, wind speed, fetch, incidence.
const NUMBERS: usize = 6;
/// Directions: of the ship and of the wind.
const DIRECTIONS: usize = 2;

/// Length of [`features`].
pub(crate) const FEATURES: usize =
    2 + NUMBERS * (2 + 2 * WAVES_PER_NUMBER) + DIRECTIONS * (1 + 2 * HARMONICS);

/// What is known of a scene as a vector; unknown values are 0.
///
/// ```text
/// number v in [a, b]:  u = 2 (v − a)/(b − a) − 1,   [1, u, sin(2^i π u/2), cos(2^i π u/2)],  i = 0…3
/// direction φ:         [1, sin(iφ), cos(iφ)],  i = 1…3
/// ```
///
/// Ranges: speed 0 to 16 m/s, place ±512 m, wind 0 to 12 m/s, log₁₀ fetch 3 to 6, incidence 10 to 40°. Values
/// beyond a range repeat those within for the shorter waves.
pub(crate) fn features(conditions: &Conditions) -> Vec<f32> {
    let mut out = Vec::with_capacity(FEATURES);
    out.push(if conditions.ship.is_some() { 1.0 } else { 0.0 });
    out.push(if conditions.ship == Some(true) {
        1.0
    } else {
        0.0
    });
    push_number(&mut out, conditions.ship_speed, SHIP_SPEED);
    let place = conditions.ship_position;
    push_number(&mut out, place.map(|p| p[0]), PLACE);
    push_number(&mut out, place.map(|p| p[1]), PLACE);
    push_number(&mut out, conditions.wind_speed, WIND_SPEED);
    push_number(&mut out, conditions.fetch.map(f64::log10), LOG_FETCH);
    push_number(&mut out, conditions.incidence, INCIDENCE);
    push_direction(&mut out, conditions.ship_heading);
    push_direction(&mut out, conditions.wind_toward);
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
mod tests {
    use super::*;

    fn full() -> Conditions {
        Conditions {
            ship: Some(true),
            ship_speed: Some(10.0),
            ship_heading: Some(45.0),
            ship_position: Some([0.0, 100.0]),
            wind_speed: Some(5.0),
            wind_toward: Some(90.0),
            fetch: Some(4e4),
            incidence: Some(32.0),
            ..Conditions::default()
        }
    }

    #[test]
    fn nothing_known_is_zero_and_lengths_agree() {
        assert_eq!(features(&Conditions::default()), vec![0.0; FEATURES]);
        assert_eq!(features(&full()).len(), FEATURES);
    }

    #[test]
    fn directions_close_the_circle() {
        let turned = Conditions {
            ship_heading: Some(45.0 + 360.0),
            ..full()
        };
        let (a, b) = (features(&full()), features(&turned));
        assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-6));
    }

    #[test]
    fn each_number_changes_only_its_own_features() {
        let louder = Conditions {
            wind_speed: Some(6.0),
            ..full()
        };
        let (a, b) = (features(&full()), features(&louder));
        let changed: Vec<usize> = (0..FEATURES)
            .filter(|&i| (a[i] - b[i]).abs() > 1e-6)
            .collect();
        let start = 2 + 3 * (2 + 2 * WAVES_PER_NUMBER);
        assert!(
            changed.iter().all(|&i| (start..start + 10).contains(&i)),
            "{changed:?}"
        );
        assert!(changed.len() >= 8);
    }

    #[test]
    fn ends_are_minus_one_and_one_and_scaling_goes_both_ways() {
        for (value, u) in [(10.0, -1.0), (25.0, 0.0), (40.0, 1.0), (55.0, 2.0)] {
            assert!((INCIDENCE.scaled(value) - u).abs() < 1e-12);
            assert!((INCIDENCE.unscaled(u) - value).abs() < 1e-12);
        }
    }
}
