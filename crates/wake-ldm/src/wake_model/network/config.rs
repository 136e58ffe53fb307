//! What shapes a small wake model, and how it is written down.

use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;
use wake_physics::Scene;
use wake_physics::grey::GreyScale;
use wake_physics::scene::Ship;

use crate::error::{Error, Result, check_range};
use crate::unet::UNetConfig;
use crate::wake_model::conditioning::{FEATURES, MapGrid, Vocabulary};

/// Widths of a [`WakeModel`](super::WakeModel), its image, and the tokens it knows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WakeModelConfig {
    /// Rows and columns of an image, a multiple of 32.
    pub image_size: usize,
    /// Side of a pixel \[m\].
    pub spacing: f64,
    /// Channels of the latent image, at an eighth of the size.
    pub latent_channels: usize,
    /// Squares of latent pixels that the U-Net sees as one pixel: their side.
    pub fold: usize,
    /// Width of each level of the U-Net; each but the last halves the image.
    pub widths: Vec<usize>,
    /// Whether the pixels of a level attend to each other.
    pub attention: Vec<bool>,
    /// Channels of a token in the reader.
    pub text_width: usize,
    /// Channels of the network of mean and spread.
    pub prior_width: usize,
    /// Channels of the maps that join the noisy latents.
    pub map_channels: usize,
    /// Groups of every group normalisation.
    pub norm_groups: usize,
    /// CLIP's ids that the parser knows.
    pub vocabulary: Vec<u32>,
    /// The scene of all training images but for what the model is told: radar, hull, depth, spectrum. Its grid is not
    /// looked at.
    #[serde(default)]
    pub scene: Scene,
    /// The mapping from σ⁰ to the grey of all training images.
    #[serde(default)]
    pub grey: GreyScale,
}

impl WakeModelConfig {
    /// The shape that ships: 256 × 256 pixels of 4 m, 16 latent channels, few enough sums for two cores to learn.
    pub fn standard(vocabulary: &Vocabulary) -> Self {
        Self {
            image_size: 256,
            spacing: 4.0,
            latent_channels: 16,
            fold: 2,
            widths: vec![96, 96],
            attention: vec![false, true],
            text_width: 64,
            prior_width: 128,
            map_channels: 32,
            norm_groups: 16,
            vocabulary: vocabulary.known().to_vec(),
            scene: Scene::default(),
            grey: GreyScale::default(),
        }
    }

    /// Reads the JSON that serde writes.
    ///
    /// # Errors
    ///
    /// [`Error::Json`] with `path` for text that is no such configuration, and what
    /// [`validate`](Self::validate) finds.
    pub fn from_json(text: &str, path: &Path) -> Result<Self> {
        let config: Self = serde_json::from_str(text).map_err(|source| Error::Json {
            path: path.to_owned(),
            source,
        })?;
        config.validate()?;
        Ok(config)
    }

    /// Reads a file of the JSON that serde writes.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] if it cannot be read, else as [`from_json`](Self::from_json).
    pub fn read(path: &Path) -> Result<Self> {
        Self::from_json(&crate::files::read_text(path)?, path)
    }

    /// Checks that a model of this shape can be built.
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`] or [`Error::InvalidOption`] with the option at fault.
    pub fn validate(&self) -> Result<()> {
        check_range("image_size", self.image_size as f64, 32.0, 4096.0)?;
        if !self.image_size.is_multiple_of(32)
            || !self.latent_size().is_multiple_of(self.fold.max(1))
        {
            return Err(Error::InvalidOption {
                option: "image_size".to_owned(),
                value: self.image_size.to_string(),
                expected: "a multiple of 32 and of 8 fold".to_owned(),
            });
        }
        self.grey.validate()?;
        check_range("fold", self.fold as f64, 1.0, 4.0)?;
        check_range("spacing", self.spacing, 0.1, 100.0)?;
        check_range("latent_channels", self.latent_channels as f64, 1.0, 64.0)?;
        check_range("map_channels", self.map_channels as f64, 1.0, 4096.0)?;
        check_range("text_width", self.text_width as f64, 2.0, 4096.0)?;
        check_range("prior_width", self.prior_width as f64, 1.0, 4096.0)?;
        check_range("vocabulary", self.vocabulary.len() as f64, 1.0, 65536.0)?;
        if !self.text_width.is_multiple_of(2) {
            return Err(Error::InvalidOption {
                option: "text_width".to_owned(),
                value: self.text_width.to_string(),
                expected: "an even number".to_owned(),
            });
        }
        self.unet().validate()
    }

    /// The training scene on the pixels of the model: what the model knows nothing of has its values.
    pub fn base_scene(&self) -> Scene {
        let mut scene = self.scene.clone();
        (scene.grid.rows, scene.grid.columns) = (self.image_size, self.image_size);
        scene.grid.spacing = self.spacing;
        scene
    }

    /// Checks that a scene is one that the model was trained for: all that the model is not told is as in training.
    ///
    /// It is told of the ship, its speed, heading and place, of wind, fetch and incidence; seed, time, number of looks and
    /// the simulation's own accuracy may be any.
    ///
    /// # Errors
    ///
    /// [`Error::InvalidOption`] with the first value that differs, named as in a scene file.
    pub fn check_scene(&self, scene: &Scene) -> Result<()> {
        let (grid, size, spacing) = (&scene.grid, self.image_size, self.spacing);
        if [grid.rows, grid.columns] != [size, size] || (grid.spacing - spacing).abs() > 1e-9 {
            let [rows, columns] = [grid.rows, grid.columns];
            return Err(Error::InvalidOption {
                option: "grid".to_owned(),
                value: format!("{rows} × {columns} pixels of {} m", grid.spacing),
                expected: format!("{size} × {size} pixels of {spacing} m, as the model draws them"),
            });
        }
        if scene.ships.len() > 1 {
            return Err(Error::InvalidOption {
                option: "ship".to_owned(),
                value: format!("a list of {} ships", scene.ships.len()),
                expected: "one ship or none, as in all images that the model was trained with"
                    .to_owned(),
            });
        }
        let expected = as_json(&self.as_trained(scene))?;
        match first_difference("", &as_json(scene)?, &expected) {
            None => Ok(()),
            Some((option, value, trained)) => Err(Error::InvalidOption {
                option,
                value,
                expected: format!("{trained}, as in all images that the model was trained with"),
            }),
        }
    }

    /// The training scene with what the model is told of a scene, or need not know.
    fn as_trained(&self, scene: &Scene) -> Scene {
        let mut same = self.base_scene();
        let ship = same.ships.first().cloned().unwrap_or_default();
        let told = |told: &Ship| Ship {
            speed: told.speed,
            heading: told.heading,
            position: told.position,
            ..ship.clone()
        };
        same.ships = scene.ships.iter().map(told).collect();
        (same.seed, same.grid, same.model) = (scene.seed, scene.grid.clone(), scene.model.clone());
        (same.sea.wind_speed, same.sea.wind_toward) = (scene.sea.wind_speed, scene.sea.wind_toward);
        (same.sea.fetch, same.sea.time) = (scene.sea.fetch, scene.sea.time);
        (same.radar.incidence, same.radar.looks) = (scene.radar.incidence, scene.radar.looks);
        same
    }

    /// The pixels of an image.
    pub fn grid(&self) -> MapGrid {
        MapGrid {
            size: self.image_size,
            spacing: self.spacing,
        }
    }

    /// Rows and columns of the latent image.
    pub fn latent_size(&self) -> usize {
        self.image_size / crate::wake_model::conditioning::PATCH
    }

    /// The U-Net, which also sees the maps.
    pub(super) fn unet(&self) -> UNetConfig {
        let folded = self.latent_channels * self.fold * self.fold;
        let upward = self.attention.iter().rev().copied().collect();
        UNetConfig::small(folded, None, Some(FEATURES))
            .with_in_channels(folded + self.map_channels)
            .with_block_out_channels(self.widths.clone())
            .with_down_attention(self.attention.clone())
            .with_up_attention(upward)
            .with_heads(
                self.widths
                    .iter()
                    .map(|&width| (width / 32).max(1))
                    .collect(),
            )
            .with_norm_groups(self.norm_groups)
            .with_sample_size(self.latent_size() / self.fold)
    }
}

fn as_json(scene: &Scene) -> Result<Value> {
    serde_json::to_value(scene).map_err(|source| Error::Json {
        path: "scene".into(),
        source,
    })
}

/// Where two scenes differ first, and what each has there.
fn first_difference(name: &str, a: &Value, b: &Value) -> Option<(String, String, String)> {
    let (Value::Object(entries), Value::Object(others)) = (a, b) else {
        return (a != b).then(|| (name.to_owned(), a.to_string(), b.to_string()));
    };
    let keys = entries.keys().chain(others.keys());
    keys.into_iter().find_map(|key| {
        let name = match name {
            "" => key.clone(),
            _ => format!("{name}.{key}"),
        };
        let at = |map: &serde_json::Map<String, Value>| map.get(key).cloned().unwrap_or_default();
        first_difference(&name, &at(entries), &at(others))
    })
}

#[cfg(test)]
mod tests {
    use wake_physics::scene::Polarization;

    use super::*;

    #[test]
    fn what_the_model_was_not_trained_for_is_refused_by_name() {
        let config = WakeModelConfig::standard(&Vocabulary::new([1]));
        let base = config.base_scene();
        let refused = |change: &dyn Fn(&mut Scene)| {
            let mut scene = base.clone();
            change(&mut scene);
            config.check_scene(&scene).err().map(|e| e.to_string())
        };
        let told = refused(&|scene| {
            let ship = &mut scene.ships[0];
            (ship.speed, ship.heading, ship.position) = (7.0, 200.0, [50.0, -20.0]);
            (scene.sea.wind_speed, scene.sea.fetch) = (7.0, 2e4);
            (scene.radar.incidence, scene.radar.looks, scene.seed) = (25.0, 9, 77);
            scene.model.tolerance = 1e-2;
        });
        assert_eq!(told, None);
        assert_eq!(refused(&|scene| scene.ships.clear()), None);
        let named = |name: &str, change: &dyn Fn(&mut Scene)| {
            let message = refused(change).unwrap_or_default();
            let start = format!("{name} is ");
            assert!(message.starts_with(&start), "{name}: {message}");
        };
        named("grid", &|scene| scene.grid.rows = 128);
        named("radar.polarization", &|scene| {
            scene.radar.polarization = match scene.radar.polarization {
                Polarization::VV => Polarization::HH,
                _ => Polarization::VV,
            };
        });
        named("radar.frequency", &|scene| scene.radar.frequency = 1.27e9);
        named("sea.depth", &|scene| scene.sea.depth = 10.0);
        named("ship", &|scene| scene.ships.push(Ship::default()));
        named("ship.length", &|scene| {
            scene.ships[0].length = 80.0;
        });
    }

    #[test]
    fn a_configuration_without_a_scene_is_one_of_the_default_scene() {
        let config = WakeModelConfig::standard(&Vocabulary::new([1]));
        let mut json = serde_json::to_value(&config).unwrap();
        let again = WakeModelConfig::from_json(&json.to_string(), Path::new("a")).unwrap();
        assert_eq!(again, config);
        json.as_object_mut().unwrap().remove("scene");
        let old = WakeModelConfig::from_json(&json.to_string(), Path::new("a")).unwrap();
        assert_eq!(old, config);
    }
}
