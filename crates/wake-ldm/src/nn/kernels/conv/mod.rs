//! Convolution of images with square kernels, and its gradients, as matrix products.
//!
//! Each image is first laid out so that every tap of the kernel reads consecutive pixels: with its
//! border, and split by the phase of a stride. All three products then run over that layout without
//! ever writing the matrix of patches.

mod forward;
mod image;
mod layout;
mod tiles;
mod weights;

pub(in crate::nn) use forward::convolve;
pub(in crate::nn) use image::image_gradient;
pub(in crate::nn) use tiles::convolve_by_tiles;
pub(in crate::nn) use weights::{bias_gradient, weight_gradient};

/// Sizes of a convolution with a square kernel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::nn) struct Geometry {
    /// Images.
    pub(in crate::nn) batch: usize,
    /// Channels in and out.
    pub(in crate::nn) channels: [usize; 2],
    /// Rows and columns of the image that comes in.
    pub(in crate::nn) size: [usize; 2],
    /// Rows and columns of the kernel.
    pub(in crate::nn) kernel: usize,
    /// Pixels between two outputs.
    pub(in crate::nn) stride: usize,
    /// Zeros above, left, below and right of the image.
    pub(in crate::nn) border: [usize; 4],
}

impl Geometry {
    /// Rows and columns of the image that goes out.
    pub(in crate::nn) fn size_out(&self) -> [usize; 2] {
        let [top, left, bottom, right] = self.border;
        let out = |size, border| (size + border - self.kernel) / self.stride + 1;
        [
            out(self.size[0], top + bottom),
            out(self.size[1], left + right),
        ]
    }

    fn pixels_out(&self) -> usize {
        let [rows, columns] = self.size_out();
        rows * columns
    }

    /// Length of a row of the weight matrix: `channels in · kernel · kernel`.
    fn patch(&self) -> usize {
        self.channels[0] * self.kernel * self.kernel
    }
}

#[cfg(test)]
mod tests;
