//! What shapes a small wake model, and how it is written down.

use std::path::Path;

use serde::{Deserialize, Serialize};
use wake_physics::Scene;

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
    /// Whether a level attends to itself and to the numbers.
    pub attention: Vec<bool>,
    /// Channels of a token in the reader.
    pub text_width: usize,
    /// Channels of the network of mean and spread.
    pub prior_width: usize,
    /// Channels of the maps that join the noisy latents.
    pub map_channels: usize,
    /// Groups of every group normalisation.
    pub norm_groups: usize,
    /// CLIP's ids that the reader knows.
    pub vocabulary: Vec<u32>,
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

    /// The default scene on the pixels of the model: what the model knows nothing of has its values.
    pub fn base_scene(&self) -> Scene {
        let mut scene = Scene::default();
        (scene.grid.rows, scene.grid.columns) = (self.image_size, self.image_size);
        scene.grid.spacing = self.spacing;
        scene
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
        UNetConfig::small(folded, FEATURES, Some(FEATURES))
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
