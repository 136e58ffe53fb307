//! Convolution of images with square kernels, and its gradients, as matrix products.
//!
//! Each image is first laid out so that every tap of the kernel reads consecutive pixels: with its
//! border, and split by the phase of a stride. All three products then run over that layout without
//! ever writing the matrix of patches.

mod direct;
mod image;
mod layout;
mod tiles;
mod weights;

pub(in crate::nn) use image::image_gradient;
pub(in crate::nn) use weights::bias_gradient;

/// Convolves a batch of images, by tiles where that saves products and directly elsewhere.
///
/// ```text
/// y[o, p] = bias[o] + Σ_{c, t} weight[o, c, t] · x[c, p · stride + t − border]
/// ```
///
/// Tiles round more often than the direct sum: windows and kernels are sums before they are multiplied.
///
/// # Shapes
///
/// - `x`: `[batch, channels in, rows, columns]`
/// - `weight`: `[channels out, channels in, kernel, kernel]`
/// - `bias`: `[channels out]`
/// - result: `[batch, channels out, rows out, columns out]`
pub(in crate::nn) fn convolve(
    x: &[f32],
    weight: &[f32],
    bias: Option<&[f32]>,
    geometry: &Geometry,
) -> Vec<f32> {
    if tiles::win(geometry) {
        tiles::convolve(x, weight, bias, geometry)
    } else {
        direct::convolve(x, weight, bias, geometry)
    }
}

/// Gradient to the weights, by tiles where that saves products and directly elsewhere.
///
/// ```text
/// ∂L/∂weight[o, c, t] = Σ_{n, p} dy[n, o, p] · x[n, c, p · stride + t − border]
/// ```
///
/// # Shapes
///
/// - `x`: `[batch, channels in, rows, columns]`
/// - `dy`: `[batch, channels out, rows out, columns out]`
/// - result: `[channels out, channels in, kernel, kernel]`
pub(in crate::nn) fn weight_gradient(x: &[f32], dy: &[f32], geometry: &Geometry) -> Vec<f32> {
    if tiles::win_for_weights(geometry) {
        tiles::weight_gradient(x, dy, geometry)
    } else {
        weights::weight_gradient(x, dy, geometry)
    }
}

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
