//! One number of the scene is changed; the value measured in the image must follow.

use crate::measurements::{Quantity, Reading};
use crate::scenes::{held_out, ship};
use crate::source::{ImageSource, OtherSea, Result, Simulator, Told};
use serde::Serialize;
use wake_physics::Scene;

/// First index of the scenes of this test: apart from those of the other figures.
const FIRST: u64 = 1 << 20;

/// How often a measured value followed.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct SwapRow {
    pub(crate) quantity: &'static str,
    /// What the images' source was told.
    pub(crate) told: &'static str,
    /// Pairs that were drawn.
    pub(crate) pairs: usize,
    /// Pairs in which the value follows on simulated images: those that count.
    pub(crate) counted: usize,
    /// Share of the counted pairs in which it follows on generated images, or on simulated ones of other seas.
    pub(crate) right: Option<f64>,
}

/// A scene with one value changed, and by how much it is larger than the base's.
fn swapped(base: &Scene, quantity: Quantity) -> (Scene, f64) {
    let mut scene = base.clone();
    let mut moved = ship(base);
    let before = quantity.truth(base);
    // Toward the other end of the range, so that the value stays inside.
    let change = |low: f64, high: f64, by: f64| if before < 0.5 * (low + high) { by } else { -by };
    let change = match quantity {
        Quantity::Heading => 60.0,
        Quantity::Speed => change(6.0, 12.0, 3.0),
        Quantity::WindSpeed => change(3.0, 7.0, 2.0),
        Quantity::WindDirection => 40.0,
        Quantity::Incidence => change(16.0, 32.0, 8.0),
    };
    match quantity {
        Quantity::Heading => moved.heading = (before + change).rem_euclid(360.0),
        Quantity::Speed => moved.speed = before + change,
        Quantity::WindSpeed => scene.sea.wind_speed = before + change,
        Quantity::WindDirection => scene.sea.wind_toward = (before + change).rem_euclid(360.0),
        Quantity::Incidence => scene.radar.incidence = before + change,
    }
    scene.ships = vec![moved];
    (scene, change)
}

/// Draws `pairs` pairs for each quantity and each of `told`.
pub(crate) fn swaps(
    pairs: usize,
    model: Option<&dyn ImageSource>,
    told: &[Told],
    mut progress: impl FnMut(),
) -> Result<Vec<SwapRow>> {
    let mut rows = Vec::new();
    for quantity in Quantity::ALL {
        let scenes: Vec<(Scene, Scene, f64)> = (0..pairs as u64)
            .map(|n| held_out(FIRST + (quantity as u64) * (1 << 12) + n))
            .map(|base| {
                let (other, change) = swapped(&base, quantity);
                (base, other, change)
            })
            .collect();
        let mut counted = Vec::new();
        for pair in scenes {
            if follows(&pair, quantity, &Simulator, Told::Both)? {
                counted.push(pair);
            }
            progress();
        }
        let share = |source: &dyn ImageSource, told: Told| -> Result<Option<f64>> {
            let mut right = 0;
            for pair in &counted {
                right += usize::from(follows(pair, quantity, source, told)?);
            }
            Ok((!counted.is_empty()).then(|| right as f64 / counted.len() as f64))
        };
        let row = |told: &'static str, right: Option<f64>| SwapRow {
            quantity: quantity.name()[0],
            told,
            pairs,
            counted: counted.len(),
            right,
        };
        rows.push(row("simulator", share(&OtherSea, Told::Both)?));
        for &told in told.iter().filter(|_| model.is_some()) {
            let right = model.map(|model| share(model, told)).transpose()?;
            rows.push(row(told.name(), right.flatten()));
        }
    }
    Ok(rows)
}

/// Whether the measured value moves the way the scene's did; not where either image does not show it.
///
/// Both images are read with the base's other values given: they differ in nothing else.
fn follows(
    (base, other, change): &(Scene, Scene, f64),
    quantity: Quantity,
    source: &dyn ImageSource,
    told: Told,
) -> Result<bool> {
    let images = source.draw(&[base.clone(), other.clone()], told)?;
    let values = [
        Reading::of(&images[0], base)?.values[quantity as usize].measurable_value(),
        Reading::of(&images[1], base)?.values[quantity as usize].measurable_value(),
    ];
    let [Some(before), Some(after)] = values else {
        return Ok(false);
    };
    Ok(quantity.difference(after, before) * change > 0.0)
}
