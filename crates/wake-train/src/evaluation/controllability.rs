//! Controllability: one value of a scene is changed, and the value measured in the image must follow.

use serde::Serialize;
use wake_physics::Scene;

use super::baseline::Baseline;
use super::reading::Quantity;
use super::source::{ImageSource, Told};
use super::view::View;
use crate::error::Result;

/// Share of pairs in which a measured value follows.
#[derive(Debug, Clone, Serialize)]
pub struct ControllabilityRow {
    /// Name of the quantity that was changed.
    pub quantity: &'static str,
    /// Inputs of the source: "both", "text", "numbers" or "paraphrase"; "simulator" for the simulator with another sea.
    pub told: &'static str,
    /// Number of scenes, each the base of a pair.
    pub pairs: usize,
    /// Pairs in which the value follows on simulated images; only these count.
    pub counted: usize,
    /// Share of the counted pairs in which it follows on generated images, or on simulated ones of other seas.
    pub right: Option<f64>,
}

/// Changes a quantity of each scene, draws both scenes, and counts how often the measured value follows.
///
/// The first row is the simulator's with another sea; the others are the model's for each of `told`.
///
/// Values move by a fixed step toward the other end of the paper's range (ship 6 to 12 m/s, wind 3 to 7 m/s, incidence 16 to
/// 32°), headings by 60°, wind directions by 40°, fetches to three times or a third. Scenes without the ship to be changed do
/// not count.
///
/// - `scenes`: bases of the pairs, with values in those ranges
/// - `step`: called after each scene
///
/// # Errors
///
/// As [`ImageSource::draw`] and [`Reading::of`].
pub(super) fn controllability(
    quantity: Quantity,
    scenes: &[Scene],
    (model, told): (&dyn ImageSource, &[Told]),
    view: &View,
    mut step: impl FnMut(),
) -> Result<Vec<ControllabilityRow>> {
    let mut counted = Vec::new();
    for base in scenes {
        if let Some(pair) = Swap::new(base, quantity)
            && pair.is_followed(view, &Baseline::Simulator, Told::Both)?
        {
            counted.push(pair);
        }
        step();
    }
    let row =
        |name: &'static str, source: &dyn ImageSource, told: Told| -> Result<ControllabilityRow> {
            let mut right = 0;
            for pair in &counted {
                right += usize::from(pair.is_followed(view, source, told)?);
            }
            Ok(ControllabilityRow {
                quantity: quantity.name()[0],
                told: name,
                pairs: scenes.len(),
                counted: counted.len(),
                right: (!counted.is_empty()).then(|| right as f64 / counted.len() as f64),
            })
        };
    let mut rows = vec![row("simulator", &Baseline::OtherSea, Told::Both)?];
    for &told in told {
        rows.push(row(told.name(), model, told)?);
    }
    Ok(rows)
}

/// A scene, and the same with one value changed.
struct Swap {
    quantity: Quantity,
    scenes: [Scene; 2],
    /// Value of the second scene minus the value of the first.
    change: f64,
}

impl Swap {
    /// `None` for a scene without the ship that would change.
    fn new(base: &Scene, quantity: Quantity) -> Option<Self> {
        let before = quantity.truth(base)?;
        // Toward the other end of the range, so that the value stays inside.
        let toward = |low: f64, high: f64, by: f64| match before < 0.5 * (low + high) {
            true => by,
            false => -by,
        };
        let change = match quantity {
            Quantity::Heading => 60.0,
            Quantity::Speed => toward(6.0, 12.0, 3.0),
            Quantity::WindSpeed => toward(3.0, 7.0, 2.0),
            Quantity::WindDirection => 40.0,
            Quantity::Incidence => toward(16.0, 32.0, 8.0),
            // Three times or a third: seas vary with the logarithm of the fetch.
            Quantity::Fetch if before < 26.0 => 2.0 * before,
            Quantity::Fetch => -before / 1.5,
        };
        let (after, turned) = (before + change, (before + change).rem_euclid(360.0));
        let mut scene = base.clone();
        match quantity {
            Quantity::Heading => scene.ships.first_mut()?.heading = turned,
            Quantity::Speed => scene.ships.first_mut()?.speed = after,
            Quantity::WindSpeed => scene.sea.wind_speed = after,
            Quantity::WindDirection => scene.sea.wind_toward = turned,
            Quantity::Incidence => scene.radar.incidence = after,
            Quantity::Fetch => scene.sea.fetch = 1e3 * after,
        }
        Some(Self {
            quantity,
            scenes: [base.clone(), scene],
            change,
        })
    }

    /// Whether the measured value changes in the same direction as the scene's; false where one image does not show it.
    ///
    /// Both images are measured with the base's other values given: they differ in nothing else.
    fn is_followed(&self, view: &View, source: &dyn ImageSource, told: Told) -> Result<bool> {
        let images = view.draw(source, &self.scenes, told)?;
        let read = |n: usize| -> Result<Option<f64>> {
            let reading = view.read(&images[n], &self.scenes[0])?;
            Ok(reading.value(self.quantity).measurable_value())
        };
        let (Some(before), Some(after)) = (read(0)?, read(1)?) else {
            return Ok(false);
        };
        Ok(self.quantity.difference(after, before) * self.change > 0.0)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;

    /// Only one value changes, by the stated amount, and stays in the paper's range.
    #[test]
    fn one_value_moves_and_stays_in_its_range() {
        for (heading, speed, wind) in [(10.0, 6.5, 3.5), (350.0, 11.5, 6.5)] {
            let mut base = Scene::default();
            base.ships[0].heading = heading;
            base.ships[0].speed = speed;
            base.sea.wind_speed = wind;
            base.radar.incidence = 30.0;
            for quantity in Quantity::ALL {
                let swap = Swap::new(&base, quantity).unwrap();
                let other = &swap.scenes[1];
                let moved =
                    |q: Quantity| q.difference(q.truth(other).unwrap(), q.truth(&base).unwrap());
                for each in Quantity::ALL {
                    let expected = if each == quantity { swap.change } else { 0.0 };
                    assert!((moved(each) - expected).abs() < 1e-9, "{quantity:?}");
                }
                assert!((6.0..=12.0).contains(&other.ships[0].speed));
                assert!((3.0..=7.0).contains(&other.sea.wind_speed));
                assert!((16.0..=32.0).contains(&other.radar.incidence));
                assert!((10e3..=78e3).contains(&other.sea.fetch));
            }
        }
        let open = Scene {
            ships: Vec::new(),
            ..Scene::default()
        };
        assert!(Swap::new(&open, Quantity::Speed).is_none());
        assert!(Swap::new(&open, Quantity::WindSpeed).is_some());
    }
}
