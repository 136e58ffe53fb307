//! Keys of a scene file. Absent keys take the values of the sensor or, without a sensor, the defaults.

use super::forms;
use super::{Grid, Model, Polarization, Radar, Scene, Sea, Sensor, Ship, default_seed};
use crate::window::Window;
use serde::Deserialize;

/// Level of azimuth ambiguities relative to a ship's echo where a sensor is named \[dB\]: chosen from −20 to −30.
const AMBIGUITY: f64 = -25.0;

/// A scene as written in a file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, rename = "Scene")]
pub(super) struct SceneKeys {
    #[serde(
        default = "default_seed",
        deserialize_with = "forms::seed::deserialize"
    )]
    seed: u64,
    #[serde(default)]
    grid: GridKeys,
    #[serde(default)]
    sea: Sea,
    #[serde(
        default,
        rename = "ship",
        deserialize_with = "forms::ships::deserialize"
    )]
    ships: Vec<Ship>,
    #[serde(default)]
    radar: RadarKeys,
    #[serde(default)]
    model: Model,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default, rename = "Grid")]
struct GridKeys {
    rows: Option<usize>,
    columns: Option<usize>,
    spacing: Option<f64>,
    oversampling: Option<u32>,
}

/// Keys of the radar, each with the method that replaces an absent value by another radar's.
macro_rules! radar_keys {
    ($($(#[$alias:meta])? $key:ident: $type:ty, $or:ident;)*) => {
        #[derive(Debug, Default, Deserialize)]
        #[serde(deny_unknown_fields, default, rename = "Radar")]
        struct RadarKeys {
            sensor: Option<Sensor>,
            relaxation_rate: Option<f64>,
            $($(#[$alias])? $key: Option<$type>,)*
        }

        impl RadarKeys {
            /// Returns a radar with these keys, and with the values of `base` for absent keys.
            fn over(self, base: Radar) -> Radar {
                Radar {
                    sensor: self.sensor,
                    relaxation_rate: self.relaxation_rate,
                    $($key: self.$key.$or(base.$key),)*
                }
            }
        }
    };
}

radar_keys! {
    frequency: f64, unwrap_or;
    polarization: Polarization, unwrap_or;
    incidence: f64, unwrap_or;
    range_to_velocity: f64, unwrap_or;
    #[serde(alias = "resolution")]
    azimuth_resolution: f64, unwrap_or;
    range_resolution: f64, or;
    window: Window, or;
    azimuth_window: Window, or;
    looks: u32, unwrap_or;
    look_overlap: f64, or;
    #[serde(alias = "noise_floor")]
    nesz: f64, or;
    #[serde(alias = "ambiguity")]
    azimuth_ambiguity: f64, or;
    #[serde(alias = "pulse_rate")]
    prf: f64, or;
    paired_echoes: f64, or;
}

/// Keys of the radar in a scene file, and their names in serialized scenes.
pub(super) const STORED: [(&str, &str); 4] = [
    ("azimuth_resolution", "resolution"),
    ("nesz", "noise_floor"),
    ("azimuth_ambiguity", "ambiguity"),
    ("prf", "pulse_rate"),
];

/// Path of a key in a serialized scene, such as `radar.noise_floor` for `radar.nesz`; most paths are the same.
#[must_use]
pub fn stored_key(path: &str) -> String {
    let key = path.strip_prefix("radar.");
    match STORED.iter().find(|(name, _)| key == Some(*name)) {
        Some((_, stored)) => format!("radar.{stored}"),
        None => path.to_owned(),
    }
}

/// The one key of the radar that is kept when a sensor is assigned.
pub(super) const NOT_SET_BY_SENSOR: &str = "relaxation_rate";

impl From<SceneKeys> for Scene {
    fn from(keys: SceneKeys) -> Self {
        let grid = Grid::default();
        let spacing = keys.radar.sensor.map(|s| s.mode().spacing);
        Self {
            seed: keys.seed,
            grid: Grid {
                rows: keys.grid.rows.unwrap_or(grid.rows),
                columns: keys.grid.columns.unwrap_or(grid.columns),
                spacing: keys.grid.spacing.or(spacing).unwrap_or(grid.spacing),
                oversampling: keys.grid.oversampling,
            },
            sea: keys.sea,
            ships: keys.ships,
            radar: match keys.radar.sensor {
                Some(sensor) => {
                    let incidence = keys.radar.incidence;
                    keys.radar.over(of_sensor(sensor, incidence))
                }
                None => keys.radar.over(Radar::default()),
            },
            model: keys.model,
        }
    }
}

/// The radar of a sensor at an incidence \[deg\].
fn of_sensor(sensor: Sensor, incidence: Option<f64>) -> Radar {
    let mode = sensor.mode();
    let incidence = incidence.unwrap_or(mode.incidence);
    Radar {
        sensor: Some(sensor),
        frequency: mode.frequency,
        polarization: mode.polarization,
        incidence,
        range_to_velocity: mode.range_to_velocity_at(incidence),
        azimuth_resolution: mode.azimuth_resolution,
        range_resolution: Some(mode.range_resolution_at(incidence)),
        window: Some(mode.windows[0]),
        azimuth_window: Some(mode.windows[1]),
        looks: mode.looks.0,
        look_overlap: Some(mode.looks.1),
        nesz: Some(mode.nesz),
        azimuth_ambiguity: Some(AMBIGUITY),
        prf: Some(mode.prf),
        paired_echoes: None,
        relaxation_rate: None,
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "values that must be the same bits")]
mod tests {
    use super::*;

    #[test]
    fn a_sensor_sets_what_no_key_does() {
        let scene = Scene::from_toml("[radar]\nsensor = \"sentinel-1-iw\"").unwrap();
        assert_eq!(scene.grid.spacing, 10.0);
        assert_eq!(scene.radar.frequency, 5.405e9);
        assert_eq!(scene.radar.window, Some(Window::Hamming(0.7)));
        let mode = Sensor::Sentinel1Iw.mode();
        assert_eq!(
            scene.radar.range_to_velocity,
            mode.range_to_velocity_at(38.7)
        );
        let text =
            "[grid]\nspacing = 5\n[radar]\nsensor = \"sentinel-1-iw\"\nincidence = 33\nlooks = 9";
        let other = Scene::from_toml(text).unwrap();
        assert_eq!((other.grid.spacing, other.radar.looks), (5.0, 9));
        assert_eq!(
            other.radar.range_to_velocity,
            mode.range_to_velocity_at(33.0)
        );
        assert_eq!(other.radar.range_resolution, Some(20.3));
    }

    #[test]
    fn every_sensor_is_a_valid_scene_that_reads_back() {
        for sensor in Sensor::ALL {
            let name = serde_json::to_string(&sensor).unwrap();
            let scene = Scene::from_toml(&format!("[radar]\nsensor = {name}")).unwrap();
            assert_eq!(scene.radar.sensor, Some(sensor));
            assert_eq!(Scene::from_toml(&scene.to_toml().unwrap()).unwrap(), scene);
        }
    }

    /// Assignments apply in order: a sensor replaces the radar keys set before it, and keys set after it override the sensor.
    #[test]
    fn assigning_a_sensor_replaces_the_radar() {
        let scene = Scene::default()
            .with_assignments(&[
                "radar.looks=9",
                "radar.sensor=ers-2-pri",
                "radar.frequency=6e9",
            ])
            .unwrap();
        assert_eq!((scene.radar.looks, scene.radar.frequency), (3, 6e9));
        assert_eq!(scene.grid.spacing, 12.5);
        // The key that no sensor sets is kept.
        let kept = Scene::default()
            .with_assignments(&["radar.relaxation_rate=2", "radar.sensor=ers-2-pri"])
            .unwrap();
        assert_eq!(kept.radar.relaxation_rate, Some(2.0));
    }

    /// Older names of keys and terms can be read; scene files are written with the new names, JSON with the older ones.
    #[test]
    fn keys_of_two_names_are_one() {
        let [first, new] = [
            "range_resolution = 9\nresolution = 7\nnoise_floor = -20\nambiguity = -25\npulse_rate = 1700",
            "range_resolution = 9\nazimuth_resolution = 7\nnesz = -20\nazimuth_ambiguity = -25\nprf = 1700",
        ]
        .map(|keys| Scene::from_toml(&format!("[radar]\n{keys}")).unwrap());
        assert_eq!(first, new);
        let radar = &new.radar;
        assert_eq!((radar.azimuth_resolution, radar.nesz), (7.0, Some(-20.0)));
        assert_eq!(
            (radar.azimuth_ambiguity, radar.prf),
            (Some(-25.0), Some(1700.0))
        );
        let text = new.to_toml().unwrap();
        let json = serde_json::to_string(&new).unwrap();
        for (key, stored) in STORED {
            assert!(text.contains(&format!("\n{key} = ")), "{text}");
            assert!(!text.contains(&format!("\n{stored} = ")), "{text}");
            assert!(json.contains(&format!("\"{stored}\":")), "{json}");
            assert!(!json.contains(&format!("\"{key}\":")), "{json}");
            assert_eq!(
                stored_key(&format!("radar.{key}")),
                format!("radar.{stored}")
            );
            assert_eq!(stored_key(key), key);
            // An assignment to either name replaces the value.
            let value = match key {
                "azimuth_resolution" => 8,
                "prf" => 2000,
                _ => -10,
            };
            let [a, b] = [key, stored].map(|name| {
                new.with_assignments(&[format!("radar.{name}={value}")])
                    .unwrap()
            });
            assert!(a == b && a != new, "{key}");
            let both = format!("[radar]\n{key} = 1\n{stored} = 1");
            let message = Scene::from_toml(&both).unwrap_err().to_string();
            assert!(message.contains("duplicate"), "{message}");
        }
        let terms = |words: &str| {
            Scene::default()
                .with_assignments(&[format!("model.terms=[{words}]")])
                .unwrap()
                .model
        };
        assert_eq!(
            terms("\"unresolved\", \"edge\", \"bunching\", \"coherence\", \"response\""),
            terms(
                "\"subpixel_wake\", \"bright_edge\", \"velocity_bunching\", \"azimuth_smear\", \"impulse_response\""
            )
        );
    }

    /// A sensor sets every optional field named here, and not the relaxation rate.
    #[test]
    fn a_sensor_sets_all_but_one_key() {
        let mut radar = of_sensor(Sensor::Sentinel1Iw, None);
        let set = toml::Table::try_from(&radar).unwrap();
        assert!(!set.contains_key(NOT_SET_BY_SENSOR));
        radar.relaxation_rate = Some(1.0);
        let all = toml::Table::try_from(&radar).unwrap();
        assert!(all.contains_key(NOT_SET_BY_SENSOR) && all.len() == set.len() + 1);
        let Radar {
            sensor: Some(_),
            range_resolution: Some(_),
            window: Some(_),
            azimuth_window: Some(_),
            look_overlap: Some(_),
            nesz: Some(_),
            azimuth_ambiguity: Some(_),
            prf: Some(_),
            ..
        } = radar
        else {
            panic!("a key that no sensor sets")
        };
    }
}
