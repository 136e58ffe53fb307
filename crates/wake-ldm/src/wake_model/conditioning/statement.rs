//! Statements of a prompt as numbers that a network can learn to read from it.

use super::features::{INCIDENCE, LOG_FETCH, Range, SHIP_SPEED, WIND_SPEED};
use wake_text::PartialScene;

/// Number of quantities that a prompt can state: whether there is a ship, its speed and heading, wind speed and
/// direction, fetch, incidence.
pub const QUANTITIES: usize = 7;

/// Encodes whether each quantity is stated, and its value.
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
pub fn statement(said: &PartialScene) -> Vec<f32> {
    let number = |value: Option<f64>, range: Range| value.map(|v| [range.scaled(v), 0.0]);
    let direction = |degrees: Option<f64>| {
        degrees.map(|degrees| <[f64; 2]>::from(degrees.to_radians().sin_cos()))
    };
    let quantities: [Option<[f64; 2]>; QUANTITIES] = [
        said.says_of_ships()
            .map(|ship| [if ship { 1.0 } else { -1.0 }, 0.0]),
        number(said.ship_speed, SHIP_SPEED),
        direction(said.ship_heading),
        number(said.wind_speed, WIND_SPEED),
        direction(said.wind_toward),
        number(said.fetch.map(f64::log10), LOG_FETCH),
        number(said.incidence, INCIDENCE),
    ];
    let triple =
        |value: Option<[f64; 2]>| value.map_or([0.0; 3], |[a, b]| [1.0, a as f32, b as f32]);
    quantities.into_iter().flat_map(triple).collect()
}

/// Decodes a [`statement`]; a quantity is stated if its flag is above ½, and numbers are clamped to their range.
///
/// # Panics
///
/// When `statement` does not have `3 · QUANTITIES` numbers.
pub fn said(statement: &[f32]) -> PartialScene {
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
    PartialScene {
        ship: value(0).map(|[ship, _]| ship > 0.0),
        ship_speed: number(1, SHIP_SPEED),
        ship_heading: direction(2),
        wind_speed: number(3, WIND_SPEED),
        wind_toward: direction(4),
        fetch: number(5, LOG_FETCH).map(|log| 10f64.powf(log)),
        incidence: number(6, INCIDENCE),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn full() -> PartialScene {
        PartialScene {
            ship: Some(true),
            ship_speed: Some(10.3),
            ship_heading: Some(225.0),
            wind_speed: Some(5.1),
            wind_toward: Some(90.0),
            fetch: Some(4e4),
            incidence: Some(32.0),
        }
    }

    #[test]
    fn a_statement_gives_what_was_said_back() {
        let again = said(&statement(&full()));
        let pairs = [
            (again.ship_speed, 10.3),
            (again.ship_heading, 225.0),
            (again.wind_speed, 5.1),
            (again.wind_toward, 90.0),
            (again.fetch, 4e4),
            (again.incidence, 32.0),
        ];
        for (found, expected) in pairs {
            // Rounding to f32.
            assert!(
                (found.unwrap() / expected - 1.0).abs() < 1e-5,
                "{found:?} {expected}"
            );
        }
        assert_eq!(again.ship, Some(true));
        let none = statement(&PartialScene::default());
        assert_eq!(said(&none), PartialScene::default());
    }
}
