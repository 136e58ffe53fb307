//! Autoencoder between images and latent images a few times smaller.

mod blocks;
mod config;
mod gaussian;
mod principal;
mod tiling;

use std::path::Path;

use burn::module::Module;
use burn::nn::conv::Conv2d;
use burn::tensor::{DType, Device, Tensor};

use blocks::{Decoder, Encoder};
use wake_nn::Result;
use wake_nn::cast_to;
use wake_nn::conv::{conv1x1, conv3x3, convolve};
use wake_nn::patch::{depth_to_space, space_to_depth};
use wake_nn::weights::{Layout, load};

pub use config::AutoencoderKlConfig;
pub use gaussian::GaussianPosterior;
pub use tiling::Tiling;

/// A variational autoencoder of images.
///
/// ```text
/// image ─► encoder ─► μ, ln σ² ─► z = μ + σ n          latent = (z − shift) · scale
/// image ◄─ decoder ◄─ z                                z = latent / scale + shift
/// ```
///
/// Images lie in [−1, 1]. `encode` and `decode` work on z; [`to_latents`](Self::to_latents) and
/// [`from_latents`](Self::from_latents) convert to and from the latents of the diffusion model.
/// Without levels in its configuration, the network is linear: squares of pixels become latents through one convolution, of 1 × 1
/// latent pixels, and pixels again through another, of 3 × 3, see [`AutoencoderKlConfig::fit`].
///
/// # References
///
/// Rombach et al. (2022), "High-Resolution Image Synthesis with Latent Diffusion Models", section
/// 3.1 and appendix G.
#[derive(Module, Debug)]
pub struct AutoencoderKl {
    encoder: Option<Encoder>,
    quant_conv: Option<Conv2d>,
    post_quant_conv: Option<Conv2d>,
    decoder: Option<Decoder>,
    #[module(skip)]
    config: AutoencoderKlConfig,
}

impl AutoencoderKlConfig {
    /// Makes an autoencoder with random weights, which are drawn on first use.
    ///
    /// # Panics
    ///
    /// When [`validate`](Self::validate) fails.
    pub fn init(&self, device: &Device) -> AutoencoderKl {
        if let Err(error) = self.validate() {
            panic!("{error}");
        }
        let latent = self.latent_channels;
        let square = self.patch_size * self.patch_size;
        let (encoded, decoder_input) = match self.is_linear() {
            true => (self.in_channels * square, self.out_channels * square),
            false => (2 * latent, latent),
        };
        AutoencoderKl {
            encoder: (!self.is_linear()).then(|| Encoder::new(self, device)),
            quant_conv: self
                .quant_conv
                .then(|| conv1x1(encoded, 2 * latent, device)),
            post_quant_conv: self.post_quant_conv.then(|| match self.is_linear() {
                true => conv3x3(latent, decoder_input, device),
                false => conv1x1(latent, decoder_input, device),
            }),
            decoder: (!self.is_linear()).then(|| Decoder::new(self, device)),
            config: self.clone(),
        }
    }
}

impl AutoencoderKl {
    /// Reads a folder with `config.json` and weights, as f32.
    ///
    /// # Errors
    ///
    /// The errors of [`load`] and of [`AutoencoderKlConfig::read`].
    pub fn from_folder(folder: &Path, device: &Device) -> Result<Self> {
        let config = AutoencoderKlConfig::read(&folder.join("config.json"))?;
        load(config.init(device), Layout::Diffusers, folder)
    }

    /// The configuration of the model.
    pub fn config(&self) -> &AutoencoderKlConfig {
        &self.config
    }

    /// Scales grey in 0…1, or colours, to −1…1 as [`encode`](Self::encode) needs it, and repeats a single grey channel.
    ///
    /// # Shapes
    ///
    /// `grey`: `[batch, 1 or in_channels, rows, columns]`; result: `[batch, in_channels, rows, columns]`
    pub fn scaled(&self, grey: Tensor<4>) -> Tensor<4> {
        let images = grey * 2.0 - 1.0;
        match images.dims()[1] {
            1 => images.repeat_dim(1, self.image_channels()),
            _ => images,
        }
    }

    /// Encodes images in [−1, 1].
    ///
    /// # Shapes
    ///
    /// - `image`: `[batch, in_channels, rows, columns]`; rows and columns should be multiples of
    ///   [`downsampling`](Self::downsampling), otherwise the last ones are lost
    /// - posterior: `[batch, latent_channels, rows / downsampling, columns / downsampling]`
    pub fn encode(&self, image: Tensor<4>) -> GaussianPosterior {
        GaussianPosterior::from_moments(self.moments(image))
    }

    /// Encodes one tile at a time.
    ///
    /// # Shapes
    ///
    /// As [`encode`](Self::encode).
    ///
    /// # Panics
    ///
    /// When the tile is not a multiple of the downsampling, or the overlap is outside 0…0.5.
    pub fn encode_tiled(&self, image: Tensor<4>, tiling: Tiling) -> GaussianPosterior {
        let [pixels, latents] = tiling.cuts(self.downsampling());
        if fits(&image, pixels.tile) {
            return self.encode(image);
        }
        let moments = tiling::in_tiles(image, pixels, latents, |tile| self.moments(tile));
        GaussianPosterior::from_moments(moments)
    }

    /// Means and log-variances from the network, concatenated along the channels.
    ///
    /// # Shapes
    ///
    /// As [`encode`](Self::encode), with `2 · latent_channels` channels.
    pub fn moments(&self, image: Tensor<4>) -> Tensor<4> {
        let dtype = image.dtype();
        let image = cast_to(image, self.dtype());
        let squares = space_to_depth(image, self.config.patch_size);
        let encoded = match &self.encoder {
            Some(encoder) => encoder.forward(squares),
            None => squares,
        };
        let moments = match &self.quant_conv {
            Some(conv) => convolve(conv, encoded),
            None => encoded,
        };
        cast_to(moments, dtype)
    }

    /// Decodes z to images approximately in [−1, 1].
    ///
    /// # Shapes
    ///
    /// - `z`: `[batch, latent_channels, rows, columns]`
    /// - result: `[batch, out_channels, rows · downsampling, columns · downsampling]`
    pub fn decode(&self, z: Tensor<4>) -> Tensor<4> {
        let dtype = z.dtype();
        let z = cast_to(z, self.dtype());
        let z = match &self.post_quant_conv {
            Some(conv) => convolve(conv, z),
            None => z,
        };
        let squares = match &self.decoder {
            Some(decoder) => decoder.forward(z),
            None => z,
        };
        cast_to(depth_to_space(squares, self.config.patch_size), dtype)
    }

    /// Floating-point type of the weights.
    fn dtype(&self) -> DType {
        match (&self.decoder, &self.post_quant_conv) {
            (Some(decoder), _) => decoder.dtype(),
            (None, Some(conv)) => conv.weight.val().dtype(),
            (None, None) => DType::F32,
        }
    }

    /// Decodes the images of a batch one at a time, with the memory of one.
    ///
    /// # Shapes
    ///
    /// As [`decode`](Self::decode).
    pub fn decode_sliced(&self, z: Tensor<4>) -> Tensor<4> {
        Tensor::cat(
            z.clone()
                .chunk(z.dims()[0], 0)
                .into_iter()
                .map(|z| self.decode(z))
                .collect(),
            0,
        )
    }

    /// Decodes one tile at a time, with the memory of one.
    ///
    /// # Shapes
    ///
    /// As [`decode`](Self::decode).
    ///
    /// # Panics
    ///
    /// As [`encode_tiled`](Self::encode_tiled).
    pub fn decode_tiled(&self, z: Tensor<4>, tiling: Tiling) -> Tensor<4> {
        let [pixels, latents] = tiling.cuts(self.downsampling());
        if fits(&z, latents.tile) {
            return self.decode(z);
        }
        tiling::in_tiles(z, latents, pixels, |tile| self.decode(tile))
    }

    /// Latents of the diffusion model: z shifted and scaled to variance 1.
    pub fn to_latents(&self, z: Tensor<4>) -> Tensor<4> {
        (z - self.config.shift_factor) * self.config.scaling_factor
    }

    /// Latents of the decoder: the inverse of [`to_latents`](Self::to_latents).
    pub fn from_latents(&self, latents: Tensor<4>) -> Tensor<4> {
        latents / self.config.scaling_factor + self.config.shift_factor
    }

    /// Factor on latents before diffusion.
    pub fn scaling_factor(&self) -> f64 {
        self.config.scaling_factor
    }

    /// Pixels per latent pixel along each axis.
    pub fn downsampling(&self) -> usize {
        self.config.downsampling()
    }

    /// Channels of the image.
    pub fn image_channels(&self) -> usize {
        self.config.in_channels
    }

    /// Channels of the latent image.
    pub fn latent_channels(&self) -> usize {
        self.config.latent_channels
    }
}

fn fits(x: &Tensor<4>, size: usize) -> bool {
    let [_, _, rows, columns] = x.dims();
    rows <= size && columns <= size
}
