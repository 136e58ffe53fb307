//! What a prompt states, as numbers that a network can learn to read from it.

use super::conditions::Conditions;
use super::features::{INCIDENCE, LOG_FETCH, Range, SHIP_SPEED, WIND_SPEED};

/// Quantities that a prompt can state: ship or not, its speed and heading, wind speed and direction, fetch,
/// incidence.
pub const QUANTITIES: usize = 7;

/// Whether each quantity is stated, and its value.
///
/// ```text
/// number in [a, b]:  [1, u, 0],  u as in features
/// direction φ:       [1, sin φ, cos φ]
/// ship:              [1, ±1, 0]
/// not stated:        [0, 0, 0]
/// ```
///
/// # Shapes
///
/// `[QUANTITIES, 3]`
pub fn statement(conditions: &Conditions) -> Vec<f32> {
    let number = |value: Option<f64>, range: Range| value.map(|v| [range.scaled(v), 0.0]);
    let direction = |degrees: Option<f64>| {
        degrees.map(|degrees| <[f64; 2]>::from(degrees.to_radians().sin_cos()))
    };
    let quantities: [Option<[f64; 2]>; QUANTITIES] = [
        conditions
            .ship
            .map(|ship| [if ship { 1.0 } else { -1.0 }, 0.0]),
        number(conditions.ship_speed, SHIP_SPEED),
        direction(conditions.ship_heading),
        number(conditions.wind_speed, WIND_SPEED),
        direction(conditions.wind_toward),
        number(conditions.fetch.map(f64::log10), LOG_FETCH),
        number(conditions.incidence, INCIDENCE),
    ];
    let triple =
        |value: Option<[f64; 2]>| value.map_or([0.0; 3], |[a, b]| [1.0, a as f32, b as f32]);
    quantities.into_iter().flat_map(triple).collect()
}

impl Conditions {
    /// The conditions of a [`statement`]; a quantity counts as stated above ½, a number beyond its range as the end of
    /// it. The ship, if any, is in the middle.
    ///
    /// # Panics
    ///
    /// When `statement` has other than `3 · QUANTITIES` numbers.
    pub fn of_statement(statement: &[f32]) -> Self {
        assert_eq!(statement.len(), 3 * QUANTITIES, "numbers of a statement");
        let value = |quantity: usize| -> Option<[f64; 2]> {
            let [stated, a, b] = [0, 1, 2].map(|i| f64::from(statement[3 * quantity + i]));
            (stated > 0.5).then_some([a, b])
        };
        let number = |quantity: usize, range: Range| {
            value(quantity).map(|[u, _]| range.unscaled(u.clamp(-1.0, 1.0)))
        };
        let direction = |quantity: usize| {
            value(quantity).map(|[sin, cos]| sin.atan2(cos).to_degrees().rem_euclid(360.0))
        };
        let ship_speed = number(1, SHIP_SPEED);
        Self {
            ship: value(0).map(|[ship, _]| ship > 0.0),
            ship_speed,
            ship_heading: direction(2),
            ship_position: ship_speed.and(Some([0.0, 0.0])),
            wind_speed: number(3, WIND_SPEED),
            wind_toward: direction(4),
            fetch: number(5, LOG_FETCH).map(|log| 10f64.powf(log)),
            incidence: number(6, INCIDENCE),
            ..Self::default()
        }
    }

    /// These conditions, and those of `other` where they leave a quantity open; without a ship there are no values of
    /// one.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        let ship = self.ship.or(other.ship);
        let there = ship != Some(false);
        let either = |ours: Option<f64>, theirs: Option<f64>| ours.or(theirs).filter(|_| there);
        Self {
            ship,
            ship_speed: either(self.ship_speed, other.ship_speed),
            ship_heading: either(self.ship_heading, other.ship_heading),
            ship_position: self.ship_position.or(other.ship_position).filter(|_| there),
            ship_length: either(self.ship_length, other.ship_length),
            wind_speed: self.wind_speed.or(other.wind_speed),
            wind_toward: self.wind_toward.or(other.wind_toward),
            fetch: self.fetch.or(other.fetch),
            depth: self.depth.or(other.depth),
            incidence: self.incidence.or(other.incidence),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn full() -> Conditions {
        Conditions {
            ship: Some(true),
            ship_speed: Some(10.3),
            ship_heading: Some(225.0),
            ship_position: Some([0.0, 0.0]),
            wind_speed: Some(5.1),
            wind_toward: Some(90.0),
            fetch: Some(4e4),
            incidence: Some(32.0),
            ..Conditions::default()
        }
    }

    #[test]
    fn a_statement_gives_its_conditions_back() {
        let again = Conditions::of_statement(&statement(&full()));
        let pairs = [
            (again.ship_speed, 10.3),
            (again.ship_heading, 225.0),
            (again.wind_speed, 5.1),
            (again.wind_toward, 90.0),
            (again.fetch, 4e4),
            (again.incidence, 32.0),
        ];
        for (found, expected) in pairs {
            // Rounding of f32.
            assert!(
                (found.unwrap() / expected - 1.0).abs() < 1e-5,
                "{found:?} {expected}"
            );
        }
        assert_eq!(again.ship, Some(true));
        let none = statement(&Conditions::default());
        assert_eq!(Conditions::of_statement(&none), Conditions::default());
    }

    #[test]
    fn what_is_open_comes_from_the_other() {
        let some = Conditions {
            wind_speed: Some(7.0),
            ..Conditions::default()
        };
        let both = some.or(full());
        assert_eq!(both.wind_speed, Some(7.0));
        assert_eq!(both.incidence, full().incidence);
        let open_sea = Conditions {
            ship: Some(false),
            ..Conditions::default()
        };
        let sea = open_sea.or(full());
        assert_eq!((sea.ship, sea.wind_toward), (Some(false), Some(90.0)));
        assert_eq!(
            (sea.ship_speed, sea.ship_heading, sea.ship_position),
            (None, None, None)
        );
    }
}
