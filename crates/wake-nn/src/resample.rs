//! Halving and doubling the size of an image.

use burn::module::Module;
use burn::nn::PaddingConfig2d;
use burn::nn::conv::{Conv2d, Conv2dConfig};
use burn::tensor::module::interpolate;
use burn::tensor::ops::{InterpolateMode, InterpolateOptions};
use burn::tensor::{Device, Tensor};

use super::conv::{conv3x3, convolve};

/// Halves the size with a 3 × 3 convolution of stride 2.
#[derive(Module, Debug)]
pub struct Downsample {
    conv: Conv2d,
}

impl Downsample {
    /// Downsampling of the U-Net: one zero around the image; n pixels become ⌈n/2⌉.
    pub fn padded(channels: usize, device: &Device) -> Self {
        Self::new(channels, PaddingConfig2d::Explicit(1, 1, 1, 1), device)
    }

    /// Downsampling of the autoencoder: one zero to the right and below; n pixels become ⌊n/2⌋.
    pub fn padded_at_end(channels: usize, device: &Device) -> Self {
        Self::new(channels, PaddingConfig2d::Explicit(0, 0, 1, 1), device)
    }

    fn new(channels: usize, padding: PaddingConfig2d, device: &Device) -> Self {
        let conv = Conv2dConfig::new([channels, channels], [3, 3]).with_stride([2, 2]);
        Self {
            conv: conv.with_padding(padding).init(device),
        }
    }

    /// Halves the image.
    ///
    /// # Shapes
    ///
    /// `[batch, channels, rows, columns]` to about half of rows and columns.
    pub fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        convolve(&self.conv, x)
    }
}

/// Repeats pixels, then smooths with a 3 × 3 convolution.
#[derive(Module, Debug)]
pub struct Upsample {
    conv: Conv2d,
}

impl Upsample {
    /// A layer with random weights.
    pub fn new(channels: usize, device: &Device) -> Self {
        Self {
            conv: conv3x3(channels, channels, device),
        }
    }

    /// Enlarges the image to `size` (rows, columns), by default to twice its own.
    ///
    /// # Shapes
    ///
    /// `[batch, channels, rows, columns]` to `[batch, channels, size[0], size[1]]`.
    pub fn forward(&self, x: Tensor<4>, size: Option<[usize; 2]>) -> Tensor<4> {
        let [_, _, rows, columns] = x.dims();
        let x = nearest(x, size.unwrap_or([2 * rows, 2 * columns]));
        convolve(&self.conv, x)
    }
}

/// Resizes to the nearest pixel: output i is pixel ⌊i · old / new⌋.
///
/// # Shapes
///
/// `[batch, channels, rows, columns]` to `[batch, channels, size[0], size[1]]`.
pub fn nearest(x: Tensor<4>, size: [usize; 2]) -> Tensor<4> {
    interpolate(
        x,
        InterpolateOptions::new(InterpolateMode::Nearest).with_output_size(size),
    )
}
