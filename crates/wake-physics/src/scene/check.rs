//! Every value against its closed range.

use super::{Grid, HullForm, Radar, Scene, Sea, Ship};
use crate::error::{Error, Result, finite, in_range};

impl Scene {
    /// Checks every value against its closed range.
    ///
    /// # Errors
    ///
    /// The first value found outside, with name, value and range.
    pub fn validate(&self) -> Result<()> {
        self.grid.validate()?;
        self.sea.validate()?;
        if let Some(ship) = &self.ship {
            ship.validate()?;
        }
        self.radar.validate()?;
        in_range("model.tolerance", self.model.tolerance, 1e-6, 0.1, "")
    }
}

impl Grid {
    fn validate(&self) -> Result<()> {
        in_range("grid.rows", self.rows as f64, 1.0, 16384.0, "pixels")?;
        in_range("grid.columns", self.columns as f64, 1.0, 16384.0, "pixels")?;
        in_range("grid.spacing", self.spacing, 0.1, 100.0, "m")
    }
}

impl Sea {
    fn validate(&self) -> Result<()> {
        in_range("sea.wind_speed", self.wind_speed, 0.0, 30.0, "m/s")?;
        finite("sea.wind_toward", self.wind_toward, "degrees")?;
        in_range("sea.fetch", self.fetch, 100.0, 1e7, "m")?;
        in_range("sea.depth", self.depth, 1.0, f64::INFINITY, "m")?;
        in_range("sea.time", self.time, 0.0, 1e5, "s")?;
        in_range("sea.temperature", self.temperature, -2.0, 40.0, "°C")?;
        in_range("sea.salinity", self.salinity, 0.0, 45.0, "psu")
    }
}

impl Ship {
    fn validate(&self) -> Result<()> {
        in_range("ship.length", self.length, 1.0, 500.0, "m")?;
        in_range("ship.beam", self.beam, 0.2, 100.0, "m")?;
        in_range("ship.draft", self.draft, 0.1, 40.0, "m")?;
        for (name, value) in [("ship.beam", self.beam), ("ship.draft", self.draft)] {
            if value >= self.length {
                return Err(Error::Conflict {
                    name: name.to_owned(),
                    value: format!("{value} m"),
                    requirement: format!("but must be below ship.length, {} m", self.length),
                });
            }
        }
        in_range("ship.speed", self.speed, 0.0, 40.0, "m/s")?;
        finite("ship.heading", self.heading, "degrees")?;
        finite("ship.position[0]", self.position[0], "m")?;
        finite("ship.position[1]", self.position[1], "m")?;
        in_range("ship.filter_depth", self.filter_depth, 0.0, 20.0, "m")?;
        match (self.hull, self.block_coefficient) {
            (HullForm::Wigley, Some(value)) => Err(Error::Conflict {
                name: "ship.block_coefficient".to_owned(),
                value: value.to_string(),
                requirement: "but the Wigley hull has 4/9; set ship.hull = \"full\" to choose it"
                    .to_owned(),
            }),
            (HullForm::Full, Some(value)) => {
                in_range("ship.block_coefficient", value, 0.45, 0.9, "")
            }
            (_, None) => Ok(()),
        }
    }
}

impl Radar {
    fn validate(&self) -> Result<()> {
        in_range("radar.frequency", self.frequency, 1e9, 2e10, "Hz")?;
        in_range("radar.incidence", self.incidence, 5.0, 75.0, "degrees")?;
        in_range(
            "radar.range_to_velocity",
            self.range_to_velocity,
            0.0,
            200.0,
            "s",
        )?;
        in_range("radar.resolution", self.resolution, 0.5, 100.0, "m")?;
        in_range("radar.looks", f64::from(self.looks), 1.0, 1000.0, "")?;
        match self.relaxation_rate {
            Some(rate) => in_range("radar.relaxation_rate", rate, 0.01, 100.0, "1/s"),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Key, closed range, and values just outside it.
    const RANGES: [(&str, f64, f64); 20] = [
        ("grid.rows", 1.0, 16384.0),
        ("grid.columns", 1.0, 16384.0),
        ("grid.spacing", 0.1, 100.0),
        ("sea.wind_speed", 0.0, 30.0),
        ("sea.fetch", 100.0, 1e7),
        ("sea.depth", 1.0, f64::INFINITY),
        ("sea.time", 0.0, 1e5),
        ("sea.temperature", -2.0, 40.0),
        ("sea.salinity", 0.0, 45.0),
        ("ship.length", 1.0, 500.0),
        ("ship.beam", 0.2, 100.0),
        ("ship.draft", 0.1, 40.0),
        ("ship.speed", 0.0, 40.0),
        ("ship.filter_depth", 0.0, 20.0),
        ("radar.frequency", 1e9, 2e10),
        ("radar.incidence", 5.0, 75.0),
        ("radar.range_to_velocity", 0.0, 200.0),
        ("radar.resolution", 0.5, 100.0),
        ("radar.relaxation_rate", 0.01, 100.0),
        ("model.tolerance", 1e-6, 0.1),
    ];

    fn set(key: &str, value: f64) -> Result<Scene> {
        let whole = key.starts_with("grid.r") || key.starts_with("grid.c");
        let value = if whole {
            format!("{value}")
        } else {
            format!("{value:e}")
        };
        let mut scene = Scene::default();
        if let Some(ship) = &mut scene.ship {
            // A hull on which every single value may take its extremes.
            (ship.length, ship.beam, ship.draft) = (300.0, 0.5, 0.5);
        }
        scene.with_assignments(&[format!("{key}={value}")])
    }

    #[test]
    fn ranges_are_closed() {
        for (key, min, max) in RANGES {
            for value in [min, max] {
                assert!(
                    set(key, value).is_ok(),
                    "{key} = {value}: {:?}",
                    set(key, value)
                );
            }
            for value in [below(min, key), above(max, key)] {
                if value == max || value < 0.0 && key.starts_with("grid") {
                    continue;
                }
                let message = set(key, value).unwrap_err().to_string();
                assert!(message.contains(key), "{key} = {value}: {message}");
            }
        }
    }

    fn whole(key: &str) -> bool {
        key == "grid.rows" || key == "grid.columns"
    }

    fn below(min: f64, key: &str) -> f64 {
        if whole(key) {
            min - 1.0
        } else {
            min.next_down()
        }
    }

    fn above(max: f64, key: &str) -> f64 {
        if whole(key) { max + 1.0 } else { max.next_up() }
    }

    #[test]
    fn looks_are_whole_and_bounded() {
        for (looks, good) in [(0, false), (1, true), (1000, true), (1001, false)] {
            let scene = Scene::default().with_assignments(&[format!("radar.looks={looks}")]);
            assert_eq!(scene.is_ok(), good, "{looks}");
        }
        assert!(
            Scene::default()
                .with_assignments(&["radar.looks=2.5"])
                .is_err()
        );
    }

    #[test]
    fn nan_and_infinity_are_refused() {
        let keys = [
            "sea.wind_toward",
            "ship.heading",
            "radar.incidence",
            "sea.wind_speed",
        ];
        for key in keys {
            for value in ["nan", "inf", "-inf"] {
                let scene = Scene::default().with_assignments(&[format!("{key}={value}")]);
                assert!(scene.unwrap_err().to_string().contains(key));
            }
        }
        for position in ["[nan, 0.0]", "[0.0, inf]"] {
            let text = format!("ship.position={position}");
            assert!(Scene::default().with_assignments(&[text]).is_err());
        }
    }

    #[test]
    fn a_ship_is_longer_than_wide_and_deep() {
        for text in ["ship.beam=20", "ship.draft=20"] {
            let scene = Scene::default().with_assignments(&["ship.length=20", text]);
            assert!(matches!(scene, Err(Error::Conflict { .. })));
        }
    }

    #[test]
    fn block_coefficient_belongs_to_the_full_hull() {
        let full = |value: f64| {
            let text = format!("ship.block_coefficient={value}");
            Scene::default().with_assignments(&["ship.hull=full".to_owned(), text])
        };
        assert!(full(0.45).is_ok() && full(0.9).is_ok());
        assert!(full(0.44999).is_err() && full(0.90001).is_err());
        assert!(
            Scene::default()
                .with_assignments(&["ship.block_coefficient=0.6"])
                .is_err()
        );
        assert!(
            Scene::default()
                .with_assignments(&["ship.hull=full"])
                .is_ok()
        );
    }
}
