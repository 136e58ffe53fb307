//! What is read from an image, against what its scene says.

use crate::scenes::ship;
use crate::source::Result;
use crate::statistics::Errors;
use serde::Serialize;
use wake_physics::measure::{
    Measured, ShipPlace, angle_between, axis_between, incidence, measure_wake, open_sea, wind_axis,
    wind_speed,
};
use wake_physics::{Field, Raster, Scene};

/// The quantities, in the order of every list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Quantity {
    Heading,
    Speed,
    WindSpeed,
    WindDirection,
    Incidence,
}

impl Quantity {
    pub(crate) const ALL: [Self; 5] = [
        Self::Heading,
        Self::Speed,
        Self::WindSpeed,
        Self::WindDirection,
        Self::Incidence,
    ];

    /// Name and unit in reports.
    pub(crate) fn name(self) -> [&'static str; 2] {
        match self {
            Self::Heading => ["heading", "deg"],
            Self::Speed => ["ship speed", "m/s"],
            Self::WindSpeed => ["wind speed", "m/s"],
            Self::WindDirection => ["wind direction, to 180°", "deg"],
            Self::Incidence => ["incidence", "deg"],
        }
    }

    /// Its value in a scene.
    pub(crate) fn truth(self, scene: &Scene) -> f64 {
        match self {
            Self::Heading => ship(scene).heading,
            Self::Speed => ship(scene).speed,
            Self::WindSpeed => scene.sea.wind_speed,
            Self::WindDirection => scene.sea.wind_toward,
            Self::Incidence => scene.radar.incidence,
        }
    }

    /// `one` less `other`, the short way round for directions.
    pub(crate) fn difference(self, one: f64, other: f64) -> f64 {
        match self {
            Self::Heading => angle_between(one, other),
            Self::WindDirection => axis_between(one, other),
            _ => one - other,
        }
    }
}

/// All that was read from one image, in the order of [`Quantity::ALL`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reading {
    pub(crate) values: [Measured; 5],
}

impl Reading {
    /// Reads an image of intensity before speckle. Brightness is read with the scene's other values given.
    pub(crate) fn of(image: &Field, scene: &Scene) -> Result<Self> {
        let raster = raster(scene);
        let ship = ship(scene);
        let place = ShipPlace {
            position: ship.position,
            length: ship.length,
            depth: scene.sea.depth,
        };
        let wake = measure_wake(image, &raster, &place);
        let heading = wake.heading.measurable_value().unwrap_or(ship.heading);
        let sea = open_sea(image, &raster, Some((ship.position, heading)));
        let nothing = Measured {
            value: f64::NAN,
            confidence: 0.0,
            measurable: false,
        };
        let [wind, axis, angle] = match &sea {
            Some(sea) => [
                wind_speed(sea, scene)?,
                wind_axis(sea, scene)?,
                incidence(sea, scene)?,
            ],
            None => [nothing; 3],
        };
        Ok(Self {
            values: [wake.heading, wake.speed, wind, axis, angle],
        })
    }

    /// Absolute error of a quantity, if it is measurable.
    pub(crate) fn error(&self, quantity: Quantity, scene: &Scene) -> Option<f64> {
        let value = self.values[quantity as usize].measurable_value()?;
        Some(quantity.difference(value, quantity.truth(scene)).abs())
    }
}

/// The pixels of a scene.
pub(crate) fn raster(scene: &Scene) -> Raster {
    Raster::image(scene.grid.rows, scene.grid.columns, scene.grid.spacing)
}

/// One quantity over all scenes.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct MeasurementRow {
    pub(crate) quantity: &'static str,
    pub(crate) unit: &'static str,
    /// The measurement on simulated images: its own error.
    pub(crate) simulator: Errors,
    /// On generated images, over the scenes in which it is measurable on the simulated one; what is not measurable
    /// there is a miss.
    pub(crate) model: Option<Errors>,
    /// Likewise on the expected image with a Gaussian sea.
    pub(crate) gaussian: Option<Errors>,
}

/// The rows of all quantities.
pub(crate) fn rows(
    scenes: &[Scene],
    simulated: &[Reading],
    generated: Option<&[Reading]>,
    gaussian: Option<&[Reading]>,
) -> Vec<MeasurementRow> {
    let errors = |readings: &[Reading], quantity: Quantity| -> Vec<Option<f64>> {
        let pairs = readings.iter().zip(scenes);
        pairs.map(|(r, s)| r.error(quantity, s)).collect()
    };
    Quantity::ALL
        .map(|quantity| {
            let own = errors(simulated, quantity);
            let of = |others: &[Reading]| {
                let both = errors(others, quantity).into_iter().zip(&own);
                let counted: Vec<Option<f64>> = both
                    .filter(|(_, own)| own.is_some())
                    .map(|(e, _)| e)
                    .collect();
                Errors::of(&counted)
            };
            let [name, unit] = quantity.name();
            MeasurementRow {
                quantity: name,
                unit,
                simulator: Errors::of(&own),
                model: generated.map(of),
                gaussian: gaussian.map(of),
            }
        })
        .to_vec()
}
