//! Checks of every value of a scene against its closed range.

use super::{Grid, HullForm, Radar, Scene, Sea, Ship};
use crate::constants::GRAVITY;
use crate::error::{Error, Result, finite, in_range};
use crate::window::Window;

/// Smallest turning radius over the larger of ship length and transverse wavelength: chosen; waves follow ray theory there.
const NARROWEST_TURN: f64 = 2.0;

/// Largest turning radius \[m\]: chosen; over 3 km the track deviates from a straight line by 45 m.
const WIDEST_TURN: f64 = 1e5;

/// Largest number of ships in a scene: chosen; each adds the cost of a wake.
const MOST_SHIPS: f64 = 100.0;

impl Scene {
    /// Checks every value against its closed range.
    ///
    /// # Errors
    ///
    /// The first value found outside, with name, value and range.
    pub fn validate(&self) -> Result<()> {
        self.grid.validate()?;
        self.sea.validate()?;
        let count = self.ships.len();
        in_range("number of ships", count as f64, 0.0, MOST_SHIPS, "")?;
        for (n, ship) in self.ships.iter().enumerate() {
            ship.validate(&Self::ship_name(n, count))?;
        }
        self.radar.validate()?;
        in_range("model.tolerance", self.model.tolerance, 1e-6, 0.1, "")
    }
}

impl Scene {
    /// Name of ship `n`, counted from 0, in a scene of `count` ships: "ship" for a single ship, else "ship.1" and so on.
    pub(crate) fn ship_name(n: usize, count: usize) -> String {
        if count == 1 {
            return "ship".to_owned();
        }
        format!("ship.{}", n + 1)
    }
}

impl Grid {
    fn validate(&self) -> Result<()> {
        in_range("grid.rows", self.rows as f64, 1.0, 16384.0, "pixels")?;
        in_range("grid.columns", self.columns as f64, 1.0, 16384.0, "pixels")?;
        in_range("grid.spacing", self.spacing, 0.1, 100.0, "m")?;
        let divisions = self.oversampling.map(f64::from);
        optional("grid.oversampling", divisions, [1.0, 16.0], "")
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
        in_range("sea.salinity", self.salinity, 0.0, 45.0, "psu")?;
        in_range("sea.gust_strength", self.gust_strength, 0.0, 0.5, "")?;
        in_range("sea.gust_scale", self.gust_scale, 100.0, 5e4, "m")?;
        in_range("sea.mottle_strength", self.mottle_strength, 0.0, 0.5, "")?;
        in_range("sea.mottle_scale", self.mottle_scale, 20.0, 5e3, "m")?;
        in_range("sea.swell_height", self.swell_height, 0.0, 15.0, "m")?;
        in_range("sea.swell_length", self.swell_length, 30.0, 1000.0, "m")?;
        finite("sea.swell_toward", self.swell_toward, "degrees")?;
        in_range("sea.slick_damping", self.slick_damping, 0.0, 1.0, "")?;
        in_range("sea.slick_width", self.slick_width, 5.0, 1000.0, "m")?;
        in_range("sea.slick_scale", self.slick_scale, 100.0, 5e4, "m")
    }
}

impl Ship {
    /// Checks that the turning radius is large enough for the ship and its waves, and at most [`WIDEST_TURN`].
    fn validate_turn(&self, name: &str) -> Result<()> {
        if self.turn_rate == 0.0 {
            return Ok(());
        }
        let radius = self.curvature().abs().recip();
        let wavelength = std::f64::consts::TAU * self.speed * self.speed / GRAVITY;
        let smallest = NARROWEST_TURN * self.length.max(wavelength);
        if self.speed > 0.0 && (smallest..=WIDEST_TURN).contains(&radius) {
            return Ok(());
        }
        let degrees = |radius: f64| (self.speed / radius).to_degrees();
        let requirement = match self.speed > 0.0 {
            false => "but a ship at rest cannot turn; use 0, or give it a speed".to_owned(),
            true => format!(
                "but a ship of {} m at {} m/s can turn by {:.2e} to {:.3} degrees per second, on a radius of {} km to {smallest:.0} m; use 0 for a straight track",
                self.length,
                self.speed,
                degrees(WIDEST_TURN),
                degrees(smallest),
                1e-3 * WIDEST_TURN,
            ),
        };
        Err(Error::Conflict {
            name: format!("{name}.turn_rate"),
            value: format!("{} degrees per second", self.turn_rate),
            requirement,
        })
    }

    /// Refuses keys that have no effect without an echo or without edges of the wake.
    fn validate_needless(&self, name: &str) -> Result<()> {
        let edge_time = self.edge_time.unwrap_or(0.0);
        let period = self.roll_period.unwrap_or(0.0);
        let points = self.scatterers.map_or(0.0, f64::from);
        let needless = [
            ("roll", self.roll, "m/s", "echo", self.echo),
            ("roll_period", period, "s", "echo", self.echo),
            ("scatterers", points, "points", "echo", self.echo),
            ("edge_time", edge_time, "s", "edge", self.edge),
            ("edge_outflow", self.edge_outflow, "m/s", "edge", self.edge),
        ];
        let ignored = |&(_, value, _, _, set): &(_, f64, _, _, bool)| value > 0.0 && !set;
        match needless.into_iter().find(ignored) {
            None if self.halo.is_some() && !self.echo => Err(Error::Conflict {
                name: format!("{name}.halo"),
                value: "set".to_owned(),
                requirement: format!(
                    "but needs {name}.echo: set {name}.echo = true, or leave it out"
                ),
            }),
            None => Ok(()),
            Some((key, value, unit, of, _)) => Err(Error::Conflict {
                name: format!("{name}.{key}"),
                value: format!("{value} {unit}"),
                requirement: format!(
                    "but needs {name}.{of}: set {name}.{of} = true, or leave it out"
                ),
            }),
        }
    }

    /// Checks the values of a ship.
    ///
    /// - `name`: name of the ship in errors
    fn validate(&self, name: &str) -> Result<()> {
        let range = |key: &str, value, [min, max]: [f64; 2], unit| {
            in_range(&format!("{name}.{key}"), value, min, max, unit)
        };
        let number = |key: &str, value, unit| finite(&format!("{name}.{key}"), value, unit);
        range("length", self.length, [1.0, 500.0], "m")?;
        range("beam", self.beam, [0.2, 100.0], "m")?;
        range("draft", self.draft, [0.1, 40.0], "m")?;
        for (key, value) in [("beam", self.beam), ("draft", self.draft)] {
            if value >= self.length {
                return Err(Error::Conflict {
                    name: format!("{name}.{key}"),
                    value: format!("{value} m"),
                    requirement: format!("but must be below {name}.length, {} m", self.length),
                });
            }
        }
        range("speed", self.speed, [0.0, 40.0], "m/s")?;
        number("heading", self.heading, "degrees")?;
        range(
            "turn_rate",
            self.turn_rate,
            [-10.0, 10.0],
            "degrees per second",
        )?;
        self.validate_turn(name)?;
        number("position[0]", self.position[0], "m")?;
        number("position[1]", self.position[1], "m")?;
        range("filter_depth", self.filter_depth, [0.0, 20.0], "m")?;
        optional(
            &format!("{name}.steepness"),
            self.steepness,
            [0.02, 1.0],
            "",
        )?;
        range("damping", self.damping, [0.0, 1.0], "")?;
        optional(
            &format!("{name}.edge_time"),
            self.edge_time,
            [0.0, 1000.0],
            "s",
        )?;
        range("edge_outflow", self.edge_outflow, [0.0, 0.3], "m/s")?;
        range("roll", self.roll, [0.0, 2.0], "m/s")?;
        optional(
            &format!("{name}.roll_period"),
            self.roll_period,
            [4.0, 60.0],
            "s",
        )?;
        optional(
            &format!("{name}.scatterers"),
            self.scatterers.map(f64::from),
            [1.0, 1000.0],
            "",
        )?;
        optional(&format!("{name}.halo"), self.halo, [-40.0, 0.0], "dB")?;
        self.validate_needless(name)?;
        match (self.hull, self.block_coefficient) {
            (HullForm::Wigley, Some(value)) => Err(Error::Conflict {
                name: format!("{name}.block_coefficient"),
                value: value.to_string(),
                requirement: format!(
                    "but the Wigley hull has 4/9; set {name}.hull = \"full\" to choose it"
                ),
            }),
            (HullForm::Full, Some(value)) => range("block_coefficient", value, [0.45, 0.9], ""),
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
        in_range(
            "radar.azimuth_resolution",
            self.azimuth_resolution,
            0.5,
            100.0,
            "m",
        )?;
        in_range("radar.looks", f64::from(self.looks), 1.0, 1000.0, "")?;
        optional(
            "radar.range_resolution",
            self.range_resolution,
            [0.5, 500.0],
            "m",
        )?;
        optional("radar.look_overlap", self.look_overlap, [0.0, 0.9], "")?;
        optional("radar.nesz", self.nesz, [-60.0, 20.0], "dB")?;
        optional(
            "radar.azimuth_ambiguity",
            self.azimuth_ambiguity,
            [-60.0, 0.0],
            "dB",
        )?;
        optional("radar.prf", self.prf, [100.0, 2e4], "Hz")?;
        optional(
            "radar.paired_echoes",
            self.paired_echoes,
            [-40.0, 0.0],
            "dB",
        )?;
        optional(
            "radar.relaxation_rate",
            self.relaxation_rate,
            [0.01, 100.0],
            "1/s",
        )?;
        window("radar.window", self.window)?;
        window("radar.azimuth_window", self.azimuth_window)?;
        self.response()
    }

    /// Refuses keys that have no effect without an impulse response.
    fn response(&self) -> Result<()> {
        let needless = [
            ("radar.window", self.window.is_some()),
            ("radar.azimuth_window", self.azimuth_window.is_some()),
            ("radar.look_overlap", self.look_overlap.is_some()),
            ("radar.azimuth_ambiguity", self.azimuth_ambiguity.is_some()),
            ("radar.paired_echoes", self.paired_echoes.is_some()),
        ];
        let refuse = |name: &str, requirement: &str| {
            Err(Error::Conflict {
                name: name.to_owned(),
                value: "set".to_owned(),
                requirement: requirement.to_owned(),
            })
        };
        if let (None, Some((name, _))) =
            (self.range_resolution, needless.iter().find(|(_, set)| *set))
        {
            return refuse(
                name,
                "but needs radar.range_resolution: set it, or name a radar.sensor",
            );
        }
        if self.azimuth_ambiguity.is_some() && self.prf.is_none() {
            return refuse("radar.azimuth_ambiguity", "but needs radar.prf: set it too");
        }
        if self.prf.is_some() && self.azimuth_ambiguity.is_none() {
            return refuse(
                "radar.prf",
                "but only affects ambiguities: set radar.azimuth_ambiguity too, or leave radar.prf out",
            );
        }
        Ok(())
    }
}

/// Checks a value that may be absent.
fn optional(
    name: &str,
    value: Option<f64>,
    [min, max]: [f64; 2],
    unit: &'static str,
) -> Result<()> {
    value.map_or(Ok(()), |value| in_range(name, value, min, max, unit))
}

/// Checks the parameter of a window.
fn window(name: &str, window: Option<Window>) -> Result<()> {
    match window {
        Some(Window::Hamming(alpha)) => in_range(&format!("{name}.hamming"), alpha, 0.5, 1.0, ""),
        Some(Window::Kaiser(beta)) => in_range(&format!("{name}.kaiser"), beta, 0.0, 10.0, ""),
        Some(Window::Uniform) | None => Ok(()),
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "values that must be the same bits")]
mod tests {
    use super::*;

    /// Keys and their closed ranges.
    const RANGES: [(&str, f64, f64); 43] = [
        ("grid.rows", 1.0, 16384.0),
        ("grid.columns", 1.0, 16384.0),
        ("grid.spacing", 0.1, 100.0),
        ("grid.oversampling", 1.0, 16.0),
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
        ("radar.azimuth_resolution", 0.5, 100.0),
        ("radar.relaxation_rate", 0.01, 100.0),
        ("model.tolerance", 1e-6, 0.1),
        ("sea.gust_strength", 0.0, 0.5),
        ("sea.gust_scale", 100.0, 5e4),
        ("sea.swell_height", 0.0, 15.0),
        ("sea.swell_length", 30.0, 1000.0),
        ("sea.slick_damping", 0.0, 1.0),
        ("sea.slick_width", 5.0, 1000.0),
        ("sea.slick_scale", 100.0, 5e4),
        ("sea.mottle_strength", 0.0, 0.5),
        ("sea.mottle_scale", 20.0, 5e3),
        ("ship.steepness", 0.02, 1.0),
        ("ship.damping", 0.0, 1.0),
        ("ship.edge_time", 0.0, 1000.0),
        ("ship.edge_outflow", 0.0, 0.3),
        ("ship.roll", 0.0, 2.0),
        ("ship.roll_period", 4.0, 60.0),
        ("ship.scatterers", 1.0, 1000.0),
        ("ship.halo", -40.0, 0.0),
        ("radar.paired_echoes", -40.0, 0.0),
        ("radar.range_resolution", 0.5, 500.0),
        ("radar.nesz", -60.0, 20.0),
        ("radar.prf", 100.0, 2e4),
        ("radar.look_overlap", 0.0, 0.9),
    ];

    fn set(key: &str, value: f64) -> Result<Scene> {
        let value = if whole(key) {
            format!("{value}")
        } else {
            format!("{value:e}")
        };
        let mut scene = Scene::default();
        scene.radar.range_resolution = Some(10.0);
        (scene.radar.azimuth_ambiguity, scene.radar.prf) = (Some(-25.0), Some(1700.0));
        for ship in &mut scene.ships {
            (ship.echo, ship.edge) = (true, true);
            // A hull for which each key alone may take the ends of its range.
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
        [
            "grid.rows",
            "grid.columns",
            "grid.oversampling",
            "ship.scatterers",
        ]
        .contains(&key)
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
    fn an_impulse_response_is_asked_for_by_its_resolution() {
        let refused = |keys: &[&str]| {
            Scene::default()
                .with_assignments(keys)
                .unwrap_err()
                .to_string()
        };
        for key in [
            "radar.window=uniform",
            "radar.azimuth_window={ hamming = 0.7 }",
            "radar.look_overlap=0.2",
            "radar.azimuth_ambiguity=-25",
        ] {
            assert!(refused(&[key]).contains("radar.range_resolution"), "{key}");
        }
        let ghost = ["radar.range_resolution=10", "radar.azimuth_ambiguity=-25"];
        assert!(refused(&ghost).contains("radar.prf"));
        assert!(refused(&["radar.prf=1700"]).contains("radar.azimuth_ambiguity"));
        for (key, good) in [
            ("radar.window={ hamming = 0.5 }", true),
            ("radar.window={ hamming = 1.0 }", true),
            ("radar.window={ hamming = 0.499 }", false),
            ("radar.window={ kaiser = 10 }", true),
            ("radar.azimuth_window={ kaiser = 10.1 }", false),
            ("radar.window=kaiser", false),
        ] {
            let scene = Scene::default().with_assignments(&["radar.range_resolution=10", key]);
            assert_eq!(scene.is_ok(), good, "{key}: {scene:?}");
        }
    }

    /// A key of the ship that would be ignored is refused, and the error names the key that it needs.
    #[test]
    fn keys_without_effect_are_refused() {
        for (key, of) in [
            ("ship.roll=0.2", "ship.echo"),
            ("ship.roll_period=8", "ship.echo"),
            ("ship.scatterers=40", "ship.echo"),
            ("ship.halo=-10", "ship.echo"),
            ("ship.edge_time=400", "ship.edge"),
            ("ship.edge_outflow=0.02", "ship.edge"),
        ] {
            let message = Scene::default().with_assignments(&[key]).unwrap_err();
            let needed = format!("needs {of}: set {of} = true");
            assert!(message.to_string().contains(&needed), "{message}");
            let both = Scene::default().with_assignments(&[key, &format!("{of}=true")]);
            assert!(both.is_ok(), "{both:?}");
        }
        let zero = ["ship.roll=0", "ship.edge_outflow=0"];
        assert!(Scene::default().with_assignments(&zero).is_ok());
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

    /// A ship of 195 m at 10 m/s turns on radii of 390 m to 100 km, so by at most 1.469 degrees a second.
    #[test]
    fn a_turn_is_wide_for_the_ship_and_its_waves() {
        let turned = |keys: &[&str]| Scene::default().with_assignments(keys);
        for rate in [
            "ship.turn_rate=1.46",
            "ship.turn_rate=-1.46",
            "ship.turn_rate=0.006",
        ] {
            assert!(turned(&[rate]).is_ok(), "{rate}");
        }
        for keys in [
            &["ship.turn_rate=1.48"][..],
            &["ship.turn_rate=-1.48"],
            &["ship.turn_rate=0.005"],
            &["ship.turn_rate=11"],
            &["ship.turn_rate=nan"],
            &["ship.speed=0", "ship.turn_rate=1"],
            // Waves of 256 m are longer than the ship.
            &["ship.speed=20", "ship.turn_rate=2.3"],
        ] {
            let message = turned(keys).unwrap_err().to_string();
            assert!(message.contains("ship.turn_rate is "), "{message}");
            let at_rest = keys.contains(&"ship.speed=0");
            assert_eq!(message.contains("at rest"), at_rest, "{message}");
        }
        assert!(turned(&["ship.speed=20", "ship.turn_rate=2.2"]).is_ok());
    }
}
