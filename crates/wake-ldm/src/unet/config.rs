//! Configuration of a U-Net, and its `config.json`.

use std::path::Path;

use burn::config::Config;
use serde_json::{Value, json};

use crate::options::Options;
use wake_nn::{Error, Result, check_range};

/// Widths and options of a [`UNet`](super::UNet), by default as in Stable Diffusion v1.4.
///
/// Levels are counted from the full size of the latent image down; each level but the last halves it.
#[derive(Config, Debug, PartialEq)]
pub struct UNetConfig {
    /// Channels of the noisy image and of any maps concatenated to it.
    #[config(default = 4)]
    pub in_channels: usize,
    /// Channels of the prediction.
    #[config(default = 4)]
    pub out_channels: usize,
    /// Width of each level.
    #[config(default = "vec![320, 640, 1280, 1280]")]
    pub block_out_channels: Vec<usize>,
    /// Whether a level attends to the prompt on the way down.
    #[config(default = "vec![true, true, true, false]")]
    pub down_attention: Vec<bool>,
    /// Whether a level attends to the prompt on the way up, **lowest level first**.
    #[config(default = "vec![false, true, true, true]")]
    pub up_attention: Vec<bool>,
    /// Residual blocks per level on the way down; there is one more on the way up.
    #[config(default = 2)]
    pub layers_per_block: usize,
    /// Transformer blocks per attention.
    #[config(default = 1)]
    pub transformer_layers: usize,
    /// Attention heads of each level.
    #[config(default = "vec![8, 8, 8, 8]")]
    pub heads: Vec<usize>,
    /// Channels of the prompt's tokens; `None` for a model with self-attention alone.
    #[config(default = "Some(768)")]
    pub cross_attention_dim: Option<usize>,
    /// Length of a vector of numbers that conditions the image in addition to the prompt, if any.
    pub condition_channels: Option<usize>,
    /// Groups of every group normalisation.
    #[config(default = 32)]
    pub norm_groups: usize,
    /// ε of the normalisations outside the transformers.
    #[config(default = 1e-5)]
    pub norm_epsilon: f64,
    /// Whether the maps around the transformers are matrices (v2) instead of 1 × 1 convolutions (v1).
    #[config(default = false)]
    pub linear_projection: bool,
    /// Whether the cosines come first in the embedding of the step.
    #[config(default = true)]
    pub cos_first: bool,
    /// Shift of the frequencies in the embedding of the step.
    #[config(default = 0.0)]
    pub frequency_shift: f64,
    /// Rows and columns of the latent image that the model was trained on.
    #[config(default = 64)]
    pub sample_size: usize,
}

const COMPONENT: &str = "UNet2DConditionModel";
const DOWN: [&str; 2] = ["DownBlock2D", "CrossAttnDownBlock2D"];
const UP: [&str; 2] = ["UpBlock2D", "CrossAttnUpBlock2D"];

impl UNetConfig {
    /// Configuration of the small model for wake images: 32 × 32 latents, three levels, attention at 16 and 8 only.
    ///
    /// It has `latent_channels` of noise and, if given, `context_channels` of the prompt's tokens and a vector of
    /// `condition_channels` numbers.
    pub fn small(
        latent_channels: usize,
        context_channels: Option<usize>,
        condition_channels: Option<usize>,
    ) -> Self {
        Self::new()
            .with_in_channels(latent_channels)
            .with_out_channels(latent_channels)
            .with_block_out_channels(vec![64, 128, 192])
            .with_down_attention(vec![false, true, true])
            .with_up_attention(vec![true, true, false])
            .with_layers_per_block(1)
            .with_heads(vec![4, 4, 6])
            .with_cross_attention_dim(context_channels)
            .with_condition_channels(condition_channels)
            .with_norm_groups(16)
            .with_sample_size(32)
    }

    /// Reads the `config.json` of a diffusers `UNet2DConditionModel`.
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
        refuse_other_architectures(&mut options)?;
        let config = Self::take(&mut options)?;
        options.finish()?;
        config.validate()?;
        Ok(config)
    }

    fn take(options: &mut Options) -> Result<Self> {
        let widths = options.required_usizes("block_out_channels")?;
        let levels = widths.len();
        let down = options.required_strings("down_block_types")?;
        let up = options.required_strings("up_block_types")?;
        Ok(Self {
            in_channels: options.usize("in_channels", 4)?,
            out_channels: options.usize("out_channels", 4)?,
            block_out_channels: widths,
            down_attention: attention_flags(options, "down_block_types", &down, DOWN)?,
            up_attention: attention_flags(options, "up_block_types", &up, UP)?,
            layers_per_block: options.usize("layers_per_block", 2)?,
            transformer_layers: options.usize("transformer_layers_per_block", 1)?,
            heads: options.usizes("attention_head_dim", levels, 8)?,
            cross_attention_dim: Some(options.usize("cross_attention_dim", 1280)?)
                .filter(|&channels| channels > 0),
            condition_channels: take_condition(options)?,
            norm_groups: options.usize("norm_num_groups", 32)?,
            norm_epsilon: options.f64("norm_eps", 1e-5)?,
            linear_projection: options.bool("use_linear_projection", false)?,
            cos_first: options.bool("flip_sin_to_cos", true)?,
            frequency_shift: options.f64("freq_shift", 0.0)?,
            sample_size: options.usize("sample_size", 64)?,
        })
    }

    /// `config.json` from which diffusers reads this model.
    ///
    /// Without a context it has a `cross_attention_dim` of 0, which diffusers does not support.
    pub fn to_json(&self) -> Value {
        let names = |flags: &[bool], names: [&str; 2]| -> Vec<String> {
            flags
                .iter()
                .map(|&flag| names[usize::from(flag)].to_owned())
                .collect()
        };
        let condition = self.condition_channels.map(|_| "projection");
        json!({
            "_class_name": COMPONENT,
            "act_fn": "silu",
            "attention_head_dim": self.heads,
            "block_out_channels": self.block_out_channels,
            "center_input_sample": false,
            "class_embed_type": condition,
            "cross_attention_dim": self.cross_attention_dim.unwrap_or(0),
            "down_block_types": names(&self.down_attention, DOWN),
            "downsample_padding": 1,
            "flip_sin_to_cos": self.cos_first,
            "freq_shift": whole(self.frequency_shift),
            "in_channels": self.in_channels,
            "layers_per_block": self.layers_per_block,
            "mid_block_scale_factor": 1,
            "norm_eps": self.norm_epsilon,
            "norm_num_groups": self.norm_groups,
            "out_channels": self.out_channels,
            "projection_class_embeddings_input_dim": self.condition_channels,
            "sample_size": self.sample_size,
            "transformer_layers_per_block": self.transformer_layers,
            "up_block_types": names(&self.up_attention, UP),
            "use_linear_projection": self.linear_projection,
        })
    }

    /// Checks that a model of these widths can be built.
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`] for a number outside its range, [`Error::InvalidOption`] for lists of
    /// different lengths, or widths that groups or heads do not divide.
    pub fn validate(&self) -> Result<()> {
        self.validate_numbers()?;
        self.validate_lengths()?;
        for (level, (&width, &heads)) in self.block_out_channels.iter().zip(&self.heads).enumerate()
        {
            check_range("block_out_channels", width as f64, 1.0, 65536.0)?;
            check_range("attention_head_dim", heads as f64, 1.0, 65536.0)?;
            divides("norm_num_groups", self.norm_groups, width)?;
            if self.attends(level) {
                divides("attention_head_dim", heads, width)?;
            }
        }
        let width = self.block_out_channels[0];
        if width.is_multiple_of(2) {
            return Ok(());
        }
        Err(Error::InvalidOption {
            option: "first width of block_out_channels".to_owned(),
            value: width.to_string(),
            expected: "an even number".to_owned(),
        })
    }

    fn validate_numbers(&self) -> Result<()> {
        let counts = [
            ("in_channels", self.in_channels, 4096.0),
            ("out_channels", self.out_channels, 4096.0),
            ("layers_per_block", self.layers_per_block, 64.0),
            (
                "transformer_layers_per_block",
                self.transformer_layers,
                64.0,
            ),
            (
                "cross_attention_dim",
                self.cross_attention_dim.unwrap_or(1),
                65536.0,
            ),
            ("norm_num_groups", self.norm_groups, 65536.0),
            (
                "projection_class_embeddings_input_dim",
                self.condition_channels.unwrap_or(1),
                65536.0,
            ),
            ("number of levels", self.block_out_channels.len(), 16.0),
            ("sample_size", self.sample_size, 65536.0),
        ];
        for (name, value, max) in counts {
            check_range(name, value as f64, 1.0, max)?;
        }
        check_range("norm_eps", self.norm_epsilon, 1e-12, 1.0)?;
        check_range("freq_shift", self.frequency_shift, 0.0, 1.0)
    }

    fn validate_lengths(&self) -> Result<()> {
        let levels = self.block_out_channels.len();
        let lengths = [
            ("down_block_types", self.down_attention.len()),
            ("up_block_types", self.up_attention.len()),
            ("attention_head_dim", self.heads.len()),
        ];
        match lengths.into_iter().find(|&(_, length)| length != levels) {
            None => Ok(()),
            Some((name, length)) => Err(Error::InvalidOption {
                option: name.to_owned(),
                value: format!("a list of {length}"),
                expected: format!("{levels} entries, one per level of block_out_channels"),
            }),
        }
    }

    /// `true` for levels with attention; the last level always has some, in the middle block.
    fn attends(&self, level: usize) -> bool {
        let levels = self.block_out_channels.len();
        level + 1 == levels || self.down_attention[level] || self.up_attention[levels - 1 - level]
    }
}

/// Returns an error unless `divisor` divides `width`.
fn divides(name: &str, divisor: usize, width: usize) -> Result<()> {
    if divisor > 0 && width.is_multiple_of(divisor) {
        return Ok(());
    }
    Err(Error::InvalidOption {
        option: name.to_owned(),
        value: divisor.to_string(),
        expected: format!("a divisor of the width {width}"),
    })
}

/// Whether each block of a list attends to the prompt.
fn attention_flags(
    options: &Options,
    key: &str,
    kinds: &[String],
    [plain, attending]: [&str; 2],
) -> Result<Vec<bool>> {
    let flag = |kind: &String| match kind.as_str() {
        kind if kind == plain => Ok(false),
        kind if kind == attending => Ok(true),
        kind => Err(options.unsupported(key, &kind.into(), &format!("{plain}, {attending}"))),
    };
    kinds.iter().map(flag).collect()
}

/// Takes the length of the condition vector, which diffusers calls a projected class embedding.
fn take_condition(options: &mut Options) -> Result<Option<usize>> {
    let channels = options.usize("projection_class_embeddings_input_dim", 0)?;
    options.only("class_embed_type", &["projection"])?;
    Ok((channels > 0).then_some(channels))
}

/// Requires the implemented value of every option that would change the result.
fn refuse_other_architectures(options: &mut Options) -> Result<()> {
    options.only("_class_name", &[COMPONENT])?;
    options.only("act_fn", &["silu", "swish"])?;
    options.only("mid_block_type", &["UNetMidBlock2DCrossAttn"])?;
    options.only("resnet_time_scale_shift", &["default"])?;
    options.only("time_embedding_type", &["positional"])?;
    options.only("attention_type", &["default"])?;
    for (key, value) in [
        ("downsample_padding", 1.0),
        ("conv_in_kernel", 3.0),
        ("conv_out_kernel", 3.0),
        ("dropout", 0.0),
        ("mid_block_scale_factor", 1.0),
        ("resnet_out_scale_factor", 1.0),
    ] {
        options.only(key, &[value])?;
    }
    // Attention is always computed in at least f32 here, as upcasting requires; the embedding heads
    // matter only with an embedding type, which is rejected.
    options.ignore(&["upcast_attention", "addition_embed_type_num_heads"]);
    Ok(())
}

/// Writes whole numbers without a fraction, as diffusers does.
fn whole(number: f64) -> Value {
    if number.fract().abs() > 0.0 {
        json!(number)
    } else {
        json!(number.trunc() as i64)
    }
}

#[cfg(all(test, feature = "flex"))]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use burn::module::Module;
    use burn::tensor::{Device, Tensor};

    use super::*;
    use crate::unet::UNetInput;

    #[test]
    fn lists_have_an_entry_per_level() {
        let config = UNetConfig::small(2, Some(8), None);
        assert!(config.validate().is_ok());
        let other = vec![true; config.down_attention.len() + 1];
        for (name, config) in [
            (
                "down_block_types",
                config.clone().with_down_attention(other.clone()),
            ),
            ("up_block_types", config.clone().with_up_attention(other)),
            ("attention_head_dim", config.with_heads(vec![1])),
        ] {
            let error = config.validate().expect_err(name).to_string();
            assert!(error.contains(name), "{error}");
        }
    }

    /// A model without a context has no weights for it, needs none as input, and keeps this in its file.
    #[test]
    fn a_model_may_attend_to_pixels_alone() {
        let attending = UNetConfig::small(2, Some(8), Some(3))
            .with_block_out_channels(vec![16, 16])
            .with_down_attention(vec![false, true])
            .with_up_attention(vec![true, false])
            .with_heads(vec![1, 1]);
        let config = attending.clone().with_cross_attention_dim(None);
        for config in [&attending, &config] {
            let text = config.to_json().to_string();
            let again = UNetConfig::from_json(&text, Path::new("config.json")).unwrap();
            assert_eq!(again, *config);
        }
        let device = Device::flex();
        let unet = config.init(&device);
        assert_eq!(unet.condition_channels(), Some(3));
        let fewer = attending.init(&device).num_params() - unet.num_params();
        // Four transformers, each with a norm, maps from 16 and 8 channels to 16, and an output map with bias.
        assert_eq!(fewer, 4 * (2 * 16 + 16 * 16 + 2 * 8 * 16 + 16 * 16 + 16));
        let out = unet.forward(UNetInput {
            sample: Tensor::ones([1, 2, 8, 8], &device),
            timesteps: Tensor::ones([1], &device),
            context: None,
            condition: Some(Tensor::ones([1, 3], &device)),
        });
        assert_eq!(out.dims(), [1, 2, 8, 8]);
    }
}
