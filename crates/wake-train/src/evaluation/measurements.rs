//! Errors of measured values over many scenes.

use serde::Serialize;
use wake_physics::Scene;

use super::reading::{Quantity, Reading};
use super::statistics::AbsoluteErrors;

/// One quantity over all scenes.
#[derive(Debug, Clone, Serialize)]
pub struct MeasurementRow {
    /// Name of the quantity.
    pub quantity: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Errors on simulated images: errors of the measurement itself.
    pub simulator: AbsoluteErrors,
    /// Errors on generated images, over the scenes in which the value is measurable on the simulated image; a value that is
    /// not measurable on the generated one is a miss.
    pub model: Option<AbsoluteErrors>,
    /// Likewise on the expected image with a Gaussian sea.
    pub gaussian: Option<AbsoluteErrors>,
}

impl MeasurementRow {
    /// The rows of all quantities, from a reading of every scene in the order of the scenes.
    #[must_use]
    pub fn of_all(
        scenes: &[Scene],
        simulated: &[Reading],
        generated: Option<&[Reading]>,
        gaussian: Option<&[Reading]>,
    ) -> Vec<Self> {
        let errors = |readings: &[Reading], quantity: Quantity| -> Vec<Option<f64>> {
            let pairs = readings.iter().zip(scenes);
            pairs.map(|(r, s)| r.error(quantity, s)).collect()
        };
        let row = |quantity: Quantity| {
            let own = errors(simulated, quantity);
            let of = |others: &[Reading]| {
                let both = errors(others, quantity).into_iter().zip(&own);
                let counted = both.filter(|(_, own)| own.is_some()).map(|(e, _)| e);
                AbsoluteErrors::of(&counted.collect::<Vec<_>>())
            };
            let [name, unit] = quantity.name();
            Self {
                quantity: name,
                unit,
                simulator: AbsoluteErrors::of(&own),
                model: generated.map(of),
                gaussian: gaussian.map(of),
            }
        };
        Quantity::ALL.map(row).to_vec()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wake_physics::measure::Measured;

    /// The speed is measurable in the simulated image of one of two scenes: only there is the model scored, and it misses.
    #[test]
    fn the_model_is_judged_where_the_simulator_shows_the_value() {
        let scenes = vec![Scene::default(); 2];
        let speed = scenes[0].ships.first().map_or(0.0, |ship| ship.speed);
        let read = |shown: bool| {
            let measured = |measurable: bool| Measured {
                value: speed + 2.0,
                confidence: 1.0,
                measurable,
            };
            let mut values = [measured(false); 6];
            values[Quantity::Speed as usize] = measured(shown);
            Reading { values }
        };
        let (simulated, generated) = ([read(true), read(false)], [read(false), read(true)]);
        let rows = MeasurementRow::of_all(&scenes, &simulated, Some(&generated), None);
        let row = &rows[Quantity::Speed as usize];
        assert_eq!((row.simulator.scenes, row.simulator.median), (2, Some(2.0)));
        let model = row
            .model
            .as_ref()
            .map(|errors| (errors.scenes, errors.median));
        assert_eq!(model, Some((1, None)));
        assert!(row.gaussian.is_none());
    }
}
