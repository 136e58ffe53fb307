//! Convolution of images with square kernels, and its gradients, as matrix products.
//!
//! Each image is first laid out with its border and split by the phase of the stride, so that every
//! tap of the kernel reads consecutive pixels. All three products then run over that layout without
//! ever storing the matrix of patches.

mod direct;
mod geometry;
mod image;
mod layout;
mod scatter;
mod tiles;
mod weights;

pub(crate) use geometry::Geometry;
pub(crate) use image::image_gradient;
pub(crate) use weights::bias_gradient;

/// Convolves a batch of images, by tiles where that saves products and directly otherwise.
///
/// ```text
/// y[o, p] = bias[o] + Σ_{c, t} weight[o, c, t] · x[c, p · stride + t − border]
/// ```
///
/// Tiles round more often than the direct sum, because windows and kernels are summed before they are multiplied.
///
/// # Shapes
///
/// - `x`: `[batch, channels in, rows, columns]`
/// - `weight`: `[channels out, channels in, kernel, kernel]`
/// - `bias`: `[channels out]`
/// - result: `[batch, channels out, rows out, columns out]`
pub(crate) fn convolve(
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

/// Gradient with respect to the weights, by tiles where that saves products and directly otherwise.
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
pub(crate) fn weight_gradient(x: &[f32], dy: &[f32], geometry: &Geometry) -> Vec<f32> {
    if tiles::win_for_weights(geometry) {
        tiles::weight_gradient(x, dy, geometry)
    } else {
        weights::weight_gradient(x, dy, geometry)
    }
}

#[cfg(test)]
mod tests;
