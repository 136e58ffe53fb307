//! Configuration of a small wake model, and its file.

use std::path::Path;

use serde::{Deserialize, Serialize};
use wake_physics::Scene;
use wake_physics::grey::GreyScale;

use super::training_ranges::TrainingRanges;
use crate::error::{Error, Result};
use crate::unet::UNetConfig;
use crate::wake_model::conditioning::{FEATURES, Vocabulary};
use wake_nn::check_range;

/// Widths, image and vocabulary of a [`WakeModel`](super::WakeModel).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WakeModelConfig {
    /// Rows and columns of an image, a multiple of 32.
    pub image_size: usize,
    /// Side of a pixel of [`base_scene`](Self::base_scene) \[m\].
    pub spacing: f64,
    /// Channels of the latent image, which has an eighth of the image's size.
    pub latent_channels: usize,
    /// Side of the squares of latent pixels that form one pixel of the U-Net.
    pub fold: usize,
    /// Width of each level of the U-Net; each but the last halves the image.
    pub widths: Vec<usize>,
    /// Whether a level has self-attention.
    pub attention: Vec<bool>,
    /// Channels of a token in the parser.
    pub text_width: usize,
    /// Width of the network of mean and spread.
    pub prior_width: usize,
    /// Channels of the maps that are concatenated to the noisy latents.
    pub map_channels: usize,
    /// Groups of every group normalisation.
    pub norm_groups: usize,
    /// CLIP's ids in the parser's vocabulary.
    pub vocabulary: Vec<u32>,
    /// Scene with the values that a prompt leaves open; its grid is ignored.
    #[serde(default)]
    pub scene: Scene,
    /// Ranges of the scenes of all training images.
    #[serde(default, rename = "domain")]
    pub training_ranges: TrainingRanges,
    /// Mapping from σ⁰ to the grey of all training images.
    #[serde(default)]
    pub grey: GreyScale,
}

impl WakeModelConfig {
    /// File name of the configuration in the folder of a model.
    pub const FILE: &'static str = "config.json";

    /// Configuration of the embedded model: 256 × 256 pixels of 4 m and 16 latent channels, small enough to train on two cores.
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
            training_ranges: TrainingRanges::default(),
            grey: GreyScale::default(),
        }
    }

    /// Reads the configuration from the JSON that serde writes.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::Json`] with `path` for text that is not such a configuration, and the errors of
    /// [`validate`](Self::validate).
    pub fn from_json(text: &str, path: &Path) -> Result<Self> {
        let config: Self = serde_json::from_str(text).map_err(|source| {
            Error::Model(wake_nn::Error::Json {
                path: path.to_owned(),
                source,
            })
        })?;
        config.validate()?;
        Ok(config)
    }

    /// Reads a file with the JSON that serde writes.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::Io`] if the file cannot be read, otherwise as [`from_json`](Self::from_json).
    pub fn read(path: &Path) -> Result<Self> {
        Self::from_json(&whole_files::read_text(path)?, path)
    }

    /// Checks that a model of this shape can be built.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::OutOfRange`] or [`wake_nn::Error::InvalidOption`] with the invalid option.
    pub fn validate(&self) -> Result<()> {
        check_range("image_size", self.image_size as f64, 32.0, 4096.0)?;
        if !self.image_size.is_multiple_of(32)
            || !self.latent_size().is_multiple_of(self.fold.max(1))
        {
            return Err(Error::Model(wake_nn::Error::InvalidOption {
                option: "image_size".to_owned(),
                value: self.image_size.to_string(),
                expected: "a multiple of 32 and of 8 × fold".to_owned(),
            }));
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
            return Err(Error::Model(wake_nn::Error::InvalidOption {
                option: "text_width".to_owned(),
                value: self.text_width.to_string(),
                expected: "an even number".to_owned(),
            }));
        }
        Ok(self.unet().validate()?)
    }

    /// Scene with the values that a prompt leaves open, on the model's grid.
    pub fn base_scene(&self) -> Scene {
        let mut scene = self.scene.clone();
        (scene.grid.rows, scene.grid.columns) = (self.image_size, self.image_size);
        scene.grid.spacing = self.spacing;
        scene
    }

    /// Checks that a scene is within the model's training ranges.
    ///
    /// Seed, time, directions, number of looks and the accuracy of the simulation are arbitrary.
    ///
    /// # Errors
    ///
    /// [`wake_nn::Error::InvalidOption`] for another number of pixels, or with the first value outside the training ranges,
    /// named as in a scene file.
    pub fn check_scene(&self, scene: &Scene) -> Result<()> {
        let (grid, size) = (&scene.grid, self.image_size);
        if [grid.rows, grid.columns] != [size, size] {
            let [rows, columns] = [grid.rows, grid.columns];
            return Err(Error::Model(wake_nn::Error::InvalidOption {
                option: "grid".to_owned(),
                value: format!("{rows} × {columns} pixels of {} m", grid.spacing),
                expected: format!("{size} × {size} pixels, the model's image size"),
            }));
        }
        self.training_ranges.check(scene)
    }

    /// Rows and columns of the latent image.
    pub fn latent_size(&self) -> usize {
        self.image_size / crate::wake_model::conditioning::PATCH_SIZE
    }

    /// Configuration of the U-Net, with the maps as further input channels.
    pub(super) fn unet(&self) -> UNetConfig {
        let folded = self.latent_channels * self.fold * self.fold;
        let upward = self.attention.iter().rev().copied().collect();
        UNetConfig::small(folded, None, Some(FEATURES + self.latent_channels))
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

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;

    #[test]
    fn what_the_model_was_not_trained_for_is_refused_by_name() {
        let standard = WakeModelConfig::standard(&Vocabulary::new([1]));
        let base = standard.base_scene();
        let faster = base.with_assignments(&["ship.speed=14.0"]).unwrap();
        let config = WakeModelConfig {
            training_ranges: TrainingRanges::of([&base, &faster]).unwrap(),
            ..standard
        };
        let refused = |assignment: &str| {
            let scene = base.with_assignments(&[assignment]).unwrap();
            config.check_scene(&scene).err().map(|e| e.to_string())
        };
        for held in [
            "ship.speed=12.0",
            "ship.heading=200.0",
            "radar.looks=9",
            "seed=77",
        ] {
            assert_eq!(refused(held), None, "{held}");
        }
        for (assignment, name) in [
            ("grid.rows=128", "grid is 128 × 256"),
            ("grid.spacing=5.0", "grid.spacing is 5.0"),
            ("radar.polarization=HH", "radar.polarization is "),
            ("ship.speed=15.0", "ship.speed is 15.0, expected 10 to 14"),
        ] {
            let message = refused(assignment).unwrap_or_default();
            assert!(message.contains(name), "{assignment}: {message}");
        }
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
