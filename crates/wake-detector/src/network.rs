//! The network: from a grey image to maps of tips, lines and directions at a quarter of its size.

use burn::module::{Module, Param};
use burn::nn::conv::Conv2d;
use burn::tensor::{Device, Tensor};
use wake_nn::cast_to;
use wake_nn::conv::{conv1x1, conv3x3, convolve};
use wake_nn::norm::GroupNorm;
use wake_nn::patch::space_to_depth;
use wake_nn::resample::{Downsample, Upsample};
use wake_nn::weights::{Layout, load_bytes};

/// Image pixels per cell of the maps, in each direction.
pub const STRIDE: usize = 4;
/// Both sizes of an input are multiples of this: 16 pixels for a cell of the coarsest level, times the largest dilation.
pub const MULTIPLE: usize = 64;
/// Input channels: bounded contrast and logarithm of brightness.
pub const INPUTS: usize = 2;
/// Output channels; see [`Map`].
pub const OUTPUTS: usize = 8;

/// Output channels of the network.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Map {
    /// Logit: a wake begins here.
    Tip = 0,
    /// Logit: the line of a wake passes here.
    Line = 1,
    /// Direction of that line from the tip along the wake: component to the right.
    LineRight = 2,
    /// Direction of that line from the tip along the wake: downward component.
    LineDown = 3,
    /// Direction of the wake whose tip is here: component to the right.
    TipRight = 4,
    /// Direction of the wake whose tip is here: downward component.
    TipDown = 5,
    /// Logarithm of the visible length over [`LENGTH_UNIT`].
    Length = 6,
    /// Half the angle between the outer edges over [`ANGLE_UNIT`].
    HalfAngle = 7,
}

/// Unit of the visible length \[pixels\].
pub const LENGTH_UNIT: f32 = 150.0;
/// Unit of the half-angle \[deg\].
pub const ANGLE_UNIT: f32 = 10.0;

/// Channels at a quarter, an eighth and a sixteenth of the image's size.
const WIDTHS: [usize; 3] = [24, 48, 96];
const GROUPS: usize = 8;
const EPSILON: f64 = 1e-5;
/// Dilations of the blocks at a sixteenth; their receptive field is 16 · 2 · (1 + 2 + 4 + 2) pixels to each side.
const DILATIONS: [usize; 4] = [1, 2, 4, 2];
/// Initial probability of a tip, and of a line, from the bias of the output layer.
const RARE: f32 = 0.02;

/// Residual block of two dilated convolutions.
///
/// ```text
/// y = x + conv(silu(norm(conv(silu(norm(x))))))
/// ```
///
/// # References
///
/// He et al. (2016), "Identity Mappings in Deep Residual Networks"; Yu & Koltun (2016), "Multi-Scale Context
/// Aggregation by Dilated Convolutions".
#[derive(Module, Debug)]
struct Block {
    norm1: GroupNorm,
    conv1: Conv2d,
    norm2: GroupNorm,
    conv2: Conv2d,
    dilation: usize,
}

impl Block {
    fn new(channels: usize, dilation: usize, device: &Device) -> Self {
        Self {
            norm1: GroupNorm::new(GROUPS, channels, EPSILON, device),
            conv1: conv3x3(channels, channels, device),
            norm2: GroupNorm::new(GROUPS, channels, EPSILON, device),
            conv2: conv3x3(channels, channels, device),
            dilation,
        }
    }

    fn forward(&self, x: Tensor<4>) -> Tensor<4> {
        let h = dilated(
            &self.conv1,
            self.norm1.forward_silu(x.clone()),
            self.dilation,
        );
        x + dilated(&self.conv2, self.norm2.forward_silu(h), self.dilation)
    }
}

/// Dilated convolution, computed by splitting the image into `dilation²` independent images.
fn dilated(conv: &Conv2d, x: Tensor<4>, dilation: usize) -> Tensor<4> {
    if dilation == 1 {
        return convolve(conv, x);
    }
    let [batch, channels, rows, columns] = x.dims();
    let (d, r, c) = (dilation, rows / dilation, columns / dilation);
    let parts = x
        .reshape([batch, channels, r, d, c, d])
        .permute([0, 3, 5, 1, 2, 4])
        .reshape([batch * d * d, channels, r, c]);
    let parts = convolve(conv, parts);
    let channels = parts.dims()[1];
    parts
        .reshape([batch, d, d, channels, r, c])
        .permute([0, 3, 4, 1, 5, 2])
        .reshape([batch, channels, rows, columns])
}

/// U-Net at strides 4, 8 and 16.
///
/// # References
///
/// Ronneberger, Fischer & Brox (2015), "U-Net"; Zhou, Wang & Krähenbühl (2019), "Objects as Points" (maps of centres).
#[derive(Module, Debug)]
pub struct Network {
    stem: Conv2d,
    fine: Block,
    down1: Downsample,
    widen1: Conv2d,
    middle: Block,
    down2: Downsample,
    widen2: Conv2d,
    coarse: Vec<Block>,
    narrow2: Conv2d,
    up2: Upsample,
    middle_up: Block,
    narrow1: Conv2d,
    up1: Upsample,
    fine_up: Block,
    norm: GroupNorm,
    head: Conv2d,
}

impl Network {
    /// Makes a network with random weights.
    pub fn new(device: &Device) -> Self {
        let [fine, middle, coarse] = WIDTHS;
        let mut head = conv3x3(fine, OUTPUTS, device);
        let rare = (RARE / (1.0 - RARE)).ln();
        let mut start = [0.0; OUTPUTS];
        (start[Map::Tip as usize], start[Map::Line as usize]) = (rare, rare);
        head.bias = Some(Param::from_tensor(Tensor::from_floats(start, device)));
        Self {
            stem: conv3x3(INPUTS * STRIDE * STRIDE, fine, device),
            fine: Block::new(fine, 1, device),
            down1: Downsample::padded(fine, device),
            widen1: conv1x1(fine, middle, device),
            middle: Block::new(middle, 1, device),
            down2: Downsample::padded(middle, device),
            widen2: conv1x1(middle, coarse, device),
            coarse: DILATIONS.map(|d| Block::new(coarse, d, device)).into(),
            narrow2: conv1x1(coarse, middle, device),
            up2: Upsample::new(middle, device),
            middle_up: Block::new(middle, 1, device),
            narrow1: conv1x1(middle, fine, device),
            up1: Upsample::new(fine, device),
            fine_up: Block::new(fine, 1, device),
            norm: GroupNorm::new(GROUPS, fine, EPSILON, device),
            head,
        }
    }

    /// Makes the network with the shipped weights.
    ///
    /// # Errors
    ///
    /// None in a build from unchanged files.
    pub fn pretrained(device: &Device) -> wake_nn::Result<Self> {
        let bytes = include_bytes!("../assets/detector.safetensors");
        load_bytes(
            Self::new(device),
            Layout::Diffusers,
            "detector.safetensors",
            bytes,
        )
    }

    /// Computes the maps of a batch of images, in the images' number type; layers compute in the number type of the weights.
    ///
    /// # Shapes
    ///
    /// `[batch, INPUTS, rows, columns]` to `[batch, OUTPUTS, rows / STRIDE, columns / STRIDE]`; rows and columns are
    /// multiples of [`MULTIPLE`].
    pub fn forward(&self, images: Tensor<4>) -> Tensor<4> {
        let wide = images.dtype();
        let [fine, middle, coarse] = self.features(images);
        let up = self.up2.forward(convolve(&self.narrow2, coarse), None);
        let middle = self.middle_up.forward(middle + up);
        let up = self.up1.forward(convolve(&self.narrow1, middle), None);
        let fine = self.fine_up.forward(fine + up);
        cast_to(convolve(&self.head, self.norm.forward_silu(fine)), wide)
    }

    /// Computes the encoder's features of a batch of images at strides 4, 8 and 16, in the type of numbers of the weights.
    ///
    /// # Shapes
    ///
    /// `[batch, INPUTS, rows, columns]` to `[batch, 24, rows / 4, columns / 4]`, `[batch, 48, rows / 8, columns / 8]` and
    /// `[batch, 96, rows / 16, columns / 16]`; rows and columns are multiples of [`MULTIPLE`].
    pub fn features(&self, images: Tensor<4>) -> [Tensor<4>; 3] {
        let images = cast_to(images, self.stem.weight.val().dtype());
        let fine = self
            .fine
            .forward(convolve(&self.stem, space_to_depth(images, STRIDE)));
        let middle = convolve(&self.widen1, self.down1.forward(fine.clone()));
        let middle = self.middle.forward(middle);
        let mut coarse = convolve(&self.widen2, self.down2.forward(middle.clone()));
        for block in &self.coarse {
            coarse = block.forward(coarse);
        }
        [fine, middle, coarse]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use burn::nn::PaddingConfig2d;
    use burn::nn::conv::Conv2dConfig;
    use burn::tensor::Distribution;

    /// The split into independent images gives the same result as burn's dilated convolution.
    #[test]
    fn a_dilated_convolution_is_that_of_burn() {
        let device = Device::flex();
        for dilation in [2, 4] {
            let ours = conv3x3(3, 5, &device);
            let mut theirs = Conv2dConfig::new([3, 5], [3, 3])
                .with_padding(PaddingConfig2d::Explicit(
                    dilation, dilation, dilation, dilation,
                ))
                .with_dilation([dilation, dilation])
                .init(&device);
            (theirs.weight, theirs.bias) = (ours.weight.clone(), ours.bias.clone());
            let x = Tensor::random([2, 3, 8, 12], Distribution::Default, &device);
            let difference = dilated(&ours, x.clone(), dilation) - theirs.forward(x);
            // Sums of 27 products below 1, in another order.
            let largest = difference.abs().max().into_scalar::<f32>();
            assert!(largest < 27.0 * f32::EPSILON, "{largest}");
        }
    }

    /// The network takes less than four megabytes in 32 bits and starts with rare tips.
    #[test]
    fn the_network_is_small_and_begins_with_rare_tips() {
        let device = Device::flex();
        let network = Network::new(&device);
        assert!(network.num_params() < 1_000_000, "{}", network.num_params());
        let maps = network.forward(Tensor::zeros([1, INPUTS, 64, 128], &device));
        assert_eq!(maps.dims(), [1, OUTPUTS, 16, 32]);
        // An input of zeros leaves only the biases and the zero padding.
        let tips = maps.slice([0..1, 0..1, 8..9, 16..17]).into_scalar::<f32>();
        assert!(tips < -2.0, "{tips}");
    }
}
