//! Scene values by which an image is differentiated and which are estimated.

use crate::scene::{Scene, Ship};
use serde::Serialize;

/// A scene value of which the mean image is a smooth function; ship values are the first ship's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Value {
    /// `ship.speed` [m/s], through the water.
    Speed,
    /// `ship.heading` \[deg\].
    Heading,
    /// `ship.position[0]`, ground range of midship \[m\].
    X,
    /// `ship.position[1]`, azimuth of midship \[m\].
    Y,
    /// `ship.length` \[m\], beam and draft in proportion.
    Size,
    /// `ship.length` \[m\].
    Length,
    /// `ship.beam` \[m\].
    Beam,
    /// `ship.draft` \[m\].
    Draft,
    /// `sea.wind_speed` [m/s].
    WindSpeed,
    /// `sea.wind_toward` \[deg\].
    WindToward,
    /// `radar.incidence` \[deg\].
    Incidence,
}

impl Value {
    /// All values, in the order of their numbers.
    pub const ALL: [Self; 11] = [
        Self::Speed,
        Self::Heading,
        Self::X,
        Self::Y,
        Self::Size,
        Self::Length,
        Self::Beam,
        Self::Draft,
        Self::WindSpeed,
        Self::WindToward,
        Self::Incidence,
    ];

    /// Key of the scene file.
    #[must_use]
    pub fn key(self) -> &'static str {
        match self {
            Self::Speed => "ship.speed",
            Self::Heading => "ship.heading",
            Self::X => "ship.position[0]",
            Self::Y => "ship.position[1]",
            Self::Size | Self::Length => "ship.length",
            Self::Beam => "ship.beam",
            Self::Draft => "ship.draft",
            Self::WindSpeed => "sea.wind_speed",
            Self::WindToward => "sea.wind_toward",
            Self::Incidence => "radar.incidence",
        }
    }

    /// Whether the value belongs to the ship.
    #[must_use]
    pub fn is_of_ship(self) -> bool {
        (self as usize) <= Self::Draft as usize
    }

    /// The value in a scene; NaN for a ship's value without a ship.
    #[must_use]
    pub fn of(self, scene: &Scene) -> f64 {
        let of_ship = |value: fn(&Ship) -> f64| scene.ships.first().map_or(f64::NAN, value);
        match self {
            Self::Speed => of_ship(|ship| ship.speed),
            Self::Heading => of_ship(|ship| ship.heading),
            Self::X => of_ship(|ship| ship.position[0]),
            Self::Y => of_ship(|ship| ship.position[1]),
            Self::Size | Self::Length => of_ship(|ship| ship.length),
            Self::Beam => of_ship(|ship| ship.beam),
            Self::Draft => of_ship(|ship| ship.draft),
            Self::WindSpeed => scene.sea.wind_speed,
            Self::WindToward => scene.sea.wind_toward,
            Self::Incidence => scene.radar.incidence,
        }
    }

    /// Sets the value; a ship's value has no effect on a scene without a ship.
    pub fn set(self, scene: &mut Scene, value: f64) {
        match self {
            Self::WindSpeed => scene.sea.wind_speed = value,
            Self::WindToward => scene.sea.wind_toward = value,
            Self::Incidence => scene.radar.incidence = value,
            _ => {
                if let Some(ship) = scene.ships.first_mut() {
                    if self == Self::Size {
                        let factor = value / ship.length;
                        ship.beam *= factor;
                        ship.draft *= factor;
                    }
                    let of_ship = match self {
                        Self::Speed => &mut ship.speed,
                        Self::Heading => &mut ship.heading,
                        Self::X => &mut ship.position[0],
                        Self::Y => &mut ship.position[1],
                        Self::Size | Self::Length => &mut ship.length,
                        Self::Beam => &mut ship.beam,
                        _ => &mut ship.draft,
                    };
                    *of_ship = value;
                }
            }
        }
    }

    /// Returns the scene with the value changed by `by`.
    #[must_use]
    pub fn moved(self, scene: &Scene, by: f64) -> Scene {
        let mut moved = scene.clone();
        self.set(&mut moved, self.of(scene) + by);
        moved
    }

    /// Step of the differences of small stages without analytic derivatives, in the unit of the value: a few thousandths of the
    /// scale over which the stages change.
    pub(crate) fn step(self, scene: &Scene) -> f64 {
        let beam = scene.ships.first().map_or(1.0, |ship| ship.beam);
        match self {
            Self::Speed => 2e-3 * self.of(scene).max(0.1),
            // At half a kilometre, this moves a point as far as the step of a position.
            Self::Heading => (0.002 * beam / 500.0).to_degrees(),
            Self::X | Self::Y => 0.002 * beam,
            Self::Size | Self::Length | Self::Beam | Self::Draft | Self::WindSpeed => {
                2e-3 * self.of(scene).max(0.01)
            }
            Self::WindToward => 0.05,
            Self::Incidence => 0.02,
        }
    }
}
