//! Values measured in an image, compared with the values of its scene.

use wake_physics::measure::{
    Measured, ShipPlace, angle_between, axis_between, fetch, incidence, measure_wake, open_sea,
    wind_axis, wind_speed,
};
use wake_physics::scene::Ship;
use wake_physics::{Field, Raster, Scene};

use crate::error::Result;

/// Quantities that can be measured in an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Heading of the scene's first ship \[deg clockwise from azimuth\].
    Heading,
    /// Speed of that ship \[m/s\].
    Speed,
    /// Wind speed \[m/s\].
    WindSpeed,
    /// Direction the wind blows to, measurable to 180° \[deg clockwise from azimuth\].
    WindDirection,
    /// Incidence \[deg\].
    Incidence,
    /// Fetch of the wind \[km\].
    Fetch,
}

/// Value that is not measured.
const NOTHING: Measured = Measured {
    value: f64::NAN,
    confidence: 0.0,
    measurable: false,
};

impl Quantity {
    /// All of them, in the order of every list.
    pub const ALL: [Self; 6] = [
        Self::Heading,
        Self::Speed,
        Self::WindSpeed,
        Self::WindDirection,
        Self::Incidence,
        Self::Fetch,
    ];

    /// Name and unit in reports.
    #[must_use]
    pub fn name(self) -> [&'static str; 2] {
        match self {
            Self::Heading => ["heading", "deg"],
            Self::Speed => ["ship speed", "m/s"],
            Self::WindSpeed => ["wind speed", "m/s"],
            Self::WindDirection => ["wind direction, to 180°", "deg"],
            Self::Incidence => ["incidence", "deg"],
            Self::Fetch => ["fetch", "km"],
        }
    }

    /// True value in a scene; `None` for a ship that is not there.
    #[must_use]
    pub fn truth(self, scene: &Scene) -> Option<f64> {
        match self {
            Self::Heading => scene.ships.first().map(|ship| ship.heading),
            Self::Speed => scene.ships.first().map(|ship| ship.speed),
            Self::WindSpeed => Some(scene.sea.wind_speed),
            Self::WindDirection => Some(scene.sea.wind_toward),
            Self::Incidence => Some(scene.radar.incidence),
            Self::Fetch => Some(1e-3 * scene.sea.fetch),
        }
    }

    /// `one` less `other`, the short way round for directions.
    #[must_use]
    pub fn difference(self, one: f64, other: f64) -> f64 {
        match self {
            Self::Heading => angle_between(one, other),
            Self::WindDirection => axis_between(one, other),
            _ => one - other,
        }
    }
}

/// All values measured in one image.
#[derive(Debug, Clone, Copy)]
pub struct Reading {
    /// In the order of [`Quantity::ALL`].
    pub values: [Measured; 6],
}

impl Reading {
    /// Measures an image of intensity before speckle.
    ///
    /// Wind, incidence and fetch are measured with the scene's other values given, the wake with the place of its first ship;
    /// without a ship neither heading nor speed is measurable.
    ///
    /// # Errors
    ///
    /// [`Error::Scene`](crate::Error::Scene) for a value of the scene out of its range.
    pub fn of(image: &Field, scene: &Scene) -> Result<Self> {
        Self::read(image, scene, 0.0)
    }

    /// Measures an image of intensity with the speckle of the scene's radar.
    ///
    /// # Errors
    ///
    /// As [`of`](Self::of).
    pub fn of_speckled(image: &Field, scene: &Scene) -> Result<Self> {
        Self::read(image, scene, 1.0 / f64::from(scene.radar.looks.max(1)))
    }

    /// - `speckle`: variance of the speckle over its squared mean \[1\]
    fn read(image: &Field, scene: &Scene, speckle: f64) -> Result<Self> {
        let raster = raster(scene);
        let ship = scene.ships.first();
        let wake = ship.map(|ship| measure_wake(image, &raster, &place(ship, scene)));
        let seen = ship.zip(wake.as_ref()).map(|(ship, wake)| {
            let heading = wake.heading.measurable_value();
            (ship.position, heading.unwrap_or(ship.heading))
        });
        let [wind, axis, angle, fetch] = match &open_sea(image, &raster, seen) {
            Some(sea) => {
                // Speckle is multiplicative: 1 + c² is the product of those of sea and speckle.
                let squared = (1.0 + sea.contrast.powi(2)) / (1.0 + speckle) - 1.0;
                let fetch = fetch(squared.max(0.0).sqrt(), scene)?;
                [
                    wind_speed(sea, scene)?,
                    wind_axis(sea, scene)?,
                    incidence(sea, scene)?,
                    Measured {
                        value: 1e-3 * fetch.value,
                        ..fetch
                    },
                ]
            }
            None => [NOTHING; 4],
        };
        let [heading, speed] = wake.map_or([NOTHING; 2], |wake| [wake.heading, wake.speed]);
        Ok(Self {
            values: [heading, speed, wind, axis, angle, fetch],
        })
    }

    /// The measured value of a quantity.
    #[must_use]
    pub fn value(&self, quantity: Quantity) -> Measured {
        self.values[quantity as usize]
    }

    /// Absolute error of a quantity, if it is measurable.
    #[must_use]
    pub fn error(&self, quantity: Quantity, scene: &Scene) -> Option<f64> {
        let value = self.value(quantity).measurable_value()?;
        Some(quantity.difference(value, quantity.truth(scene)?).abs())
    }
}

/// Raster of a scene's image.
pub(super) fn raster(scene: &Scene) -> Raster {
    Raster::image(scene.grid.rows, scene.grid.columns, scene.grid.spacing)
}

/// Inputs to measure the wake of a ship.
pub(super) fn place(ship: &Ship, scene: &Scene) -> ShipPlace {
    ShipPlace {
        position: ship.position,
        length: ship.length,
        depth: scene.sea.depth,
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;

    /// Headings turn by 360°, axes of the wind by 180°.
    #[test]
    fn directions_differ_the_short_way_round() {
        for (quantity, one, other, expected) in [
            (Quantity::Heading, 350.0, 10.0, -20.0),
            (Quantity::WindDirection, 175.0, 5.0, -10.0),
            (Quantity::Speed, 9.0, 10.5, -1.5),
        ] {
            let found = quantity.difference(one, other);
            assert!((found - expected).abs() < 1e-12, "{quantity:?}: {found}");
        }
    }

    /// An image without a ship still has a sea.
    #[test]
    fn a_sea_alone_is_read_without_a_wake() {
        let keys = ["grid.rows = 64", "grid.columns = 64"];
        let mut scene = Scene::default().with_assignments(&keys).unwrap();
        scene.ships.clear();
        let image = wake_physics::expected_intensity(&scene).unwrap();
        let reading = Reading::of(&image, &scene).unwrap();
        for quantity in [Quantity::Heading, Quantity::Speed] {
            assert!(!reading.value(quantity).measurable);
            assert!(reading.error(quantity, &scene).is_none());
        }
        // The brightness of a constant is exactly that of the wind, up to the curve's interpolation.
        let error = reading.error(Quantity::WindSpeed, &scene);
        assert!(error.is_some_and(|error| error < 0.3), "{reading:?}");
    }
}
