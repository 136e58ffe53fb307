//! What shapes a small wake model, and how it is written down.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::conditioning::{FEATURES, Vocabulary};
use crate::error::{Error, Result, check_range};
use crate::nn::activation::Activation;
use crate::text::ClipTextConfig;
use crate::unet::UNetConfig;

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
    /// Whether a level attends to words and to itself.
    pub attention: Vec<bool>,
    /// Channels of a token.
    pub text_width: usize,
    /// Layers of the text transformer.
    pub text_layers: usize,
    /// Channels of the maps before they join the latents.
    pub map_channels: usize,
    /// Groups of every group normalisation.
    pub norm_groups: usize,
    /// CLIP's ids that the text transformer knows.
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
            widths: vec![64, 96],
            attention: vec![false, true],
            text_width: 64,
            text_layers: 2,
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
        self.text().validate()?;
        self.unet().validate()
    }

    /// Rows and columns of the latent image.
    pub fn latent_size(&self) -> usize {
        self.image_size / crate::conditioning::PATCH
    }

    /// The text transformer.
    pub(super) fn text(&self) -> ClipTextConfig {
        ClipTextConfig::new()
            .with_vocab_size(self.vocabulary.len() + 1)
            .with_hidden_size(self.text_width)
            .with_intermediate_size(4 * self.text_width)
            .with_layers(self.text_layers)
            .with_heads((self.text_width / 32).max(1))
            .with_activation(Activation::Gelu)
            .with_end_token(self.end_token())
    }

    /// The compact id of CLIP's end mark.
    fn end_token(&self) -> i64 {
        const END: u32 = 49407;
        Vocabulary::new(self.vocabulary.iter().copied()).compact(END) as i64
    }

    /// The U-Net, which also sees the maps.
    pub(super) fn unet(&self) -> UNetConfig {
        let condition = FEATURES + self.text_width;
        let folded = self.latent_channels * self.fold * self.fold;
        let upward = self.attention.iter().rev().copied().collect();
        UNetConfig::small(folded, self.text_width, Some(condition))
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
