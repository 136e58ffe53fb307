//! Configuration of an autoencoder, and its `config.json`.

use std::path::Path;

use burn::config::Config;
use serde_json::{Value, json};

use crate::options::Options;
use wake_nn::{Error, Result, check_range};

/// Widths and options of an [`AutoencoderKl`](super::AutoencoderKl), by default as in Stable Diffusion v1.4.
#[derive(Config, Debug, PartialEq)]
pub struct AutoencoderKlConfig {
    /// Channels of the input image.
    #[config(default = 3)]
    pub in_channels: usize,
    /// Channels of the output image.
    #[config(default = 3)]
    pub out_channels: usize,
    /// Side of the squares of pixels that become channels before the first convolution, and become
    /// pixels again after the last; 1 in Stable Diffusion.
    #[config(default = 1)]
    pub patch_size: usize,
    /// Width of each level, from full size down; each level but the last halves the image. Empty for a linear model.
    #[config(default = "vec![128, 256, 512, 512]")]
    pub block_out_channels: Vec<usize>,
    /// Residual blocks per level of the encoder; the decoder has one more.
    #[config(default = 2)]
    pub layers_per_block: usize,
    /// Channels of the latent image.
    #[config(default = 4)]
    pub latent_channels: usize,
    /// Groups of every group normalisation.
    #[config(default = 32)]
    pub norm_groups: usize,
    /// Whether the middle blocks have attention.
    #[config(default = true)]
    pub mid_attention: bool,
    /// Whether a 1 × 1 convolution follows the encoder.
    #[config(default = true)]
    pub quant_conv: bool,
    /// True for a convolution before the decoder, of 1 × 1 latent pixels. In a linear model it has 3 × 3 and is the whole decoder.
    #[config(default = true)]
    pub post_quant_conv: bool,
    /// Factor on latents before diffusion, for variance 1.
    #[config(default = 0.18215)]
    pub scaling_factor: f64,
    /// Shift that is subtracted from latents before the scaling.
    #[config(default = 0.0)]
    pub shift_factor: f64,
    /// Rows and columns of the images that the model was trained on, and of the tiles of
    /// [`Tiling`](super::Tiling).
    #[config(default = 512)]
    pub sample_size: usize,
}

const COMPONENT: &str = "AutoencoderKL";

impl AutoencoderKlConfig {
    /// Configuration of the small model for grey images.
    ///
    /// Squares of 4 × 4 pixels become channels, so that no convolution with few channels runs at full size.
    ///
    /// - `latent_channels`: 4…16
    /// - `levels`: 2 or 3, for a latent image 8 or 16 times smaller
    pub fn small(latent_channels: usize, levels: usize) -> Self {
        let widths = [64, 128, 128];
        Self::new()
            .with_in_channels(1)
            .with_out_channels(1)
            .with_patch_size(4)
            .with_block_out_channels(widths[..levels.clamp(1, widths.len())].to_vec())
            .with_layers_per_block(1)
            .with_latent_channels(latent_channels)
            .with_norm_groups(16)
            .with_mid_attention(false)
            .with_scaling_factor(1.0)
            .with_sample_size(256)
    }

    /// Configuration of a linear model of grey images, see [`fit`](Self::fit).
    ///
    /// - `latent_channels`: at most `side²`
    /// - `side`: rows and columns of the squares of pixels, 1 to 64; the time of a fit grows as `side⁶` (seconds at 16)
    pub fn linear(latent_channels: usize, side: usize) -> Self {
        Self::small(latent_channels, 1)
            .with_block_out_channels(Vec::new())
            .with_patch_size(side)
    }

    /// True for a model without levels: two convolutions between squares of pixels and latents.
    pub(super) fn is_linear(&self) -> bool {
        self.block_out_channels.is_empty()
    }

    /// Pixels per latent pixel along each axis.
    ///
    /// ```text
    /// patch_size · 2^(levels − 1)        patch_size without levels
    /// ```
    pub fn downsampling(&self) -> usize {
        self.patch_size << self.block_out_channels.len().saturating_sub(1)
    }

    /// Reads the `config.json` of a diffusers `AutoencoderKL`.
    ///
    /// # Errors
    ///
    /// [`Error::Unsupported`] for an option that would change the result and is not implemented, and the errors of
    /// [`validate`](Self::validate); [`Error::Io`], [`Error::Json`] for a bad file.
    pub fn read(path: &Path) -> Result<Self> {
        Self::from_json(&whole_files::read_text(path)?, path)
    }

    /// Reads the text of a `config.json`; `path` is used only in messages.
    ///
    /// # Errors
    ///
    /// As [`read`](Self::read).
    pub fn from_json(text: &str, path: &Path) -> Result<Self> {
        let mut options = Options::parse(COMPONENT, text, path)?;
        options.only("_class_name", &[COMPONENT])?;
        options.only("act_fn", &["silu", "swish"])?;
        // Only sets the precision in which diffusers should run.
        options.ignore(&["force_upcast"]);
        let config = Self::take(&mut options)?;
        options.finish()?;
        config.validate()?;
        Ok(config)
    }

    fn take(options: &mut Options) -> Result<Self> {
        let patch_size = options.usize("patch_size", 1)?;
        let widths = options.required_usizes("block_out_channels")?;
        same_blocks(
            options,
            "down_block_types",
            "DownEncoderBlock2D",
            widths.len(),
        )?;
        same_blocks(options, "up_block_types", "UpDecoderBlock2D", widths.len())?;
        Ok(Self {
            in_channels: unpatched("in_channels", options.usize("in_channels", 3)?, patch_size)?,
            out_channels: unpatched(
                "out_channels",
                options.usize("out_channels", 3)?,
                patch_size,
            )?,
            patch_size,
            block_out_channels: widths,
            layers_per_block: options.usize("layers_per_block", 1)?,
            latent_channels: options.usize("latent_channels", 4)?,
            norm_groups: options.usize("norm_num_groups", 32)?,
            mid_attention: options.bool("mid_block_add_attention", true)?,
            quant_conv: options.bool("use_quant_conv", true)?,
            post_quant_conv: options.bool("use_post_quant_conv", true)?,
            scaling_factor: options.f64("scaling_factor", 0.18215)?,
            shift_factor: options.f64("shift_factor", 0.0)?,
            sample_size: options.usize("sample_size", 32)?,
        })
    }

    /// `config.json` from which diffusers reads this model.
    ///
    /// With a `patch_size` above 1 diffusers reads the network between the rearrangements of pixels
    /// (torch's `PixelUnshuffle` and `PixelShuffle`). It has no linear model: without levels, its two convolutions are the
    /// whole network.
    pub fn to_json(&self) -> Value {
        let levels = self.block_out_channels.len();
        let patch = self.patch_size * self.patch_size;
        let mut json = json!({
            "_class_name": COMPONENT,
            "act_fn": "silu",
            "block_out_channels": self.block_out_channels,
            "down_block_types": vec!["DownEncoderBlock2D"; levels],
            "in_channels": self.in_channels * patch,
            "latent_channels": self.latent_channels,
            "layers_per_block": self.layers_per_block,
            "mid_block_add_attention": self.mid_attention,
            "norm_num_groups": self.norm_groups,
            "out_channels": self.out_channels * patch,
            "sample_size": self.sample_size,
            "scaling_factor": self.scaling_factor,
            "up_block_types": vec!["UpDecoderBlock2D"; levels],
            "use_post_quant_conv": self.post_quant_conv,
            "use_quant_conv": self.quant_conv,
        });
        if self.patch_size > 1 {
            json["patch_size"] = self.patch_size.into();
        }
        if self.shift_factor.abs() > 0.0 {
            json["shift_factor"] = self.shift_factor.into();
        }
        json
    }

    /// Checks that a model of these widths can be built.
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`] for a number outside its range, [`Error::InvalidOption`] for a width
    /// that the groups do not divide, and for a linear model without one of its convolutions.
    pub fn validate(&self) -> Result<()> {
        let counts = [
            ("in_channels", self.in_channels, 4096.0),
            ("out_channels", self.out_channels, 4096.0),
            ("patch_size", self.patch_size, 64.0),
            ("layers_per_block", self.layers_per_block, 64.0),
            ("latent_channels", self.latent_channels, 4096.0),
            ("norm_num_groups", self.norm_groups, 65536.0),
            ("sample_size", self.sample_size, 65536.0),
        ];
        for (name, value, max) in counts {
            check_range(name, value as f64, 1.0, max)?;
        }
        check_range(
            "number of levels",
            self.block_out_channels.len() as f64,
            0.0,
            16.0,
        )?;
        if self.is_linear() && !(self.quant_conv && self.post_quant_conv) {
            return Err(Error::InvalidOption {
                option: "block_out_channels".to_owned(),
                value: "empty".to_owned(),
                expected: "a width for each level, or use_quant_conv and use_post_quant_conv true"
                    .to_owned(),
            });
        }
        check_range("scaling_factor", self.scaling_factor, 1e-6, 1e6)?;
        check_range("shift_factor", self.shift_factor, -1e6, 1e6)?;
        self.block_out_channels
            .iter()
            .try_for_each(|&width| self.validate_width(width))
    }

    fn validate_width(&self, width: usize) -> Result<()> {
        check_range("block_out_channels", width as f64, 1.0, 65536.0)?;
        if width.is_multiple_of(self.norm_groups) {
            return Ok(());
        }
        Err(Error::InvalidOption {
            option: "norm_num_groups".to_owned(),
            value: self.norm_groups.to_string(),
            expected: format!("a divisor of the width {width}"),
        })
    }
}

/// Channels of the image, from the channels of the first or last convolution.
fn unpatched(name: &str, channels: usize, patch_size: usize) -> Result<usize> {
    check_range("patch_size", patch_size as f64, 1.0, 64.0)?;
    let patch = patch_size * patch_size;
    if channels.is_multiple_of(patch) {
        return Ok(channels / patch);
    }
    Err(Error::InvalidOption {
        option: name.to_owned(),
        value: channels.to_string(),
        expected: format!("a multiple of patch_size² = {patch}"),
    })
}

/// Requires a list that holds one kind of block, once per level.
fn same_blocks(options: &mut Options, key: &str, kind: &str, levels: usize) -> Result<()> {
    let kinds = options.required_strings(key)?;
    if let Some(other) = kinds.iter().find(|&name| name != kind) {
        return Err(options.unsupported(key, &other.as_str().into(), kind));
    }
    if kinds.len() == levels {
        return Ok(());
    }
    Err(Error::InvalidOption {
        option: key.to_owned(),
        value: format!("a list of {}", kinds.len()),
        expected: format!("{levels} entries, one per level of block_out_channels"),
    })
}
