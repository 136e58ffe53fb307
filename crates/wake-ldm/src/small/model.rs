//! From noisy latents, numbers and words to the velocity of the flow.

use burn::module::Module;
use burn::nn::conv::Conv2d;
use burn::nn::{Linear, LinearConfig};
use burn::tensor::activation::silu;
use burn::tensor::{Device, Tensor};

use super::config::WakeModelConfig;
use super::input::{Known, ModelInput, Words};
use crate::autoencoder::patch::{depth_to_space, space_to_depth};
use crate::conditioning::{FEATURES, PATCH, PLACES, WAVES};
use crate::nn::cast_to;
use crate::nn::conv::{conv1x1, conv3x3, convolve};
use crate::text::ClipText;
use crate::unet::{UNet, UNetInput};

/// The steps that σ = 1 stands for in the embedding of the step.
const STEPS: f64 = 1000.0;

/// A latent diffusion model of radar images of wakes.
///
/// ```text
/// words ─► transformer ─► tokens, summary ─┐
/// numbers ─────────────────────────────────┼─► U-Net ─► velocity n − x₀
/// phase maps ─► two convolutions ──────────┤     │
/// noisy latents ───────────────────────────┘     numbers, summary ─► mean grey
/// ```
#[derive(Module, Debug)]
pub struct WakeModel {
    text: ClipText,
    reader: Linear,
    map_in: Conv2d,
    map_out: Conv2d,
    grey_in: Linear,
    grey_out: Linear,
    unet: UNet,
    fold: usize,
}

/// What a model has made of the conditions: the same for every step.
#[derive(Debug, Clone)]
pub struct Encoded {
    /// Tokens `[batch, tokens, text_width]`.
    pub context: Tensor<3>,
    /// Numbers and summary of the words, `[batch, FEATURES + text_width]`.
    pub condition: Tensor<2>,
    /// `[batch, map_channels, rows, columns]` of what the U-Net sees.
    pub maps: Tensor<4>,
}

impl WakeModelConfig {
    /// A model with random weights; they are drawn when they are first used.
    ///
    /// # Panics
    ///
    /// When [`validate`](Self::validate) fails.
    pub fn init(&self, device: &Device) -> WakeModel {
        if let Err(error) = self.validate() {
            panic!("{error}");
        }
        let linear = |from, to| LinearConfig::new(from, to).init(device);
        let condition = FEATURES + self.text_width;
        WakeModel {
            text: self.text().init(device),
            reader: linear(self.text_width, FEATURES),
            map_in: conv1x1(WAVES * PATCH * PATCH + PLACES, self.map_channels, device),
            map_out: conv3x3(
                self.map_channels * self.fold * self.fold,
                self.map_channels,
                device,
            ),
            grey_in: linear(condition, 128),
            grey_out: linear(128, 1),
            unet: self.unet().init(device),
            fold: self.fold,
        }
    }
}

impl WakeModel {
    /// Tokens and summary of prompts.
    ///
    /// # Shapes
    ///
    /// `[batch, tokens, text_width]` and `[batch, text_width]`.
    pub fn read(&self, words: &Words) -> (Tensor<3>, Tensor<2>) {
        let out = self.text.forward(words.ids.clone());
        (out.last_hidden_state, out.pooled)
    }

    /// The numbers that a summary of words speaks of, as [`features`](crate::conditioning::features).
    ///
    /// # Shapes
    ///
    /// `[batch, text_width]` to `[batch, FEATURES]`.
    pub fn numbers(&self, summary: Tensor<2>) -> Tensor<2> {
        self.reader.forward(summary)
    }

    /// Puts numbers, words and maps in the form that every step uses.
    ///
    /// # Shapes
    ///
    /// `context`, `summary`: as [`read`](Self::read) gives them.
    pub fn encode(&self, known: Known, context: Tensor<3>, summary: Tensor<2>) -> Encoded {
        let dtype = self.map_in.weight.val().dtype();
        let maps = cast_to(Tensor::cat(vec![known.waves, known.places], 1), dtype);
        let maps = space_to_depth(silu(convolve(&self.map_in, maps)), self.fold);
        let maps = convolve(&self.map_out, maps);
        Encoded {
            context,
            condition: Tensor::cat(vec![cast_to(known.numbers, dtype), summary], 1),
            maps: silu(maps),
        }
    }

    /// Mean grey of the image, `[batch, 1]`.
    pub fn mean_grey(&self, encoded: &Encoded) -> Tensor<2> {
        let hidden = silu(self.grey_in.forward(encoded.condition.clone()));
        self.grey_out.forward(hidden)
    }

    /// The velocity n − x₀ of the flow at x = (1 − σ) x₀ + σ n.
    ///
    /// # Shapes
    ///
    /// `[batch, latent_channels, rows, columns]`, as the latents.
    pub fn velocity(&self, input: ModelInput, encoded: &Encoded) -> Tensor<4> {
        let dtype = input.latents.dtype();
        let maps = cast_to(encoded.maps.clone(), dtype);
        let folded = space_to_depth(input.latents, self.fold);
        let velocity = self.unet.forward(UNetInput {
            sample: Tensor::cat(vec![folded, maps], 1),
            timesteps: input.sigma * STEPS,
            context: encoded.context.clone(),
            condition: Some(encoded.condition.clone()),
        });
        depth_to_space(velocity, self.fold)
    }
}
