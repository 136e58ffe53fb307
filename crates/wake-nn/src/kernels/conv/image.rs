//! Gradient of a convolution with respect to its image: a convolution with rotated kernels, or the transposed product.

use rayon::prelude::*;

use super::geometry::Geometry;
use super::{convolve, scatter, tiles};

/// Below this many output channels, the terms of the transposed product take longer to write and read than to compute.
const FEW: usize = 16;

/// Gradient with respect to the image.
///
/// ```text
/// ∂L/∂x[c, q] = Σ_{o, t} weight[o, c, t] · dy[o, p],   p · stride + t − border = q
/// ```
///
/// # Shapes
///
/// - `dy`: `[batch, channels out, rows out, columns out]`
/// - `weight`: `[channels out, channels in, kernel, kernel]`
/// - result: `[batch, channels in, rows, columns]`
pub(crate) fn image_gradient(dy: &[f32], weight: &[f32], geometry: &Geometry) -> Vec<f32> {
    if geometry.stride == 1 {
        let back = turned(geometry);
        if geometry.channels[1] < FEW || tiles::win(&back) {
            return convolve(dy, &turn(weight, geometry), None, &back);
        }
    }
    scatter::image_gradient(dy, weight, geometry)
}

/// Geometry of the convolution that maps the output's gradient to the image's, for stride 1.
pub(super) fn turned(geometry: &Geometry) -> Geometry {
    let [top, left, ..] = geometry.border;
    let size_out = geometry.size_out();
    let last = geometry.kernel - 1;
    let after = |i: usize, before: usize| geometry.size[i] + before - size_out[i];
    Geometry {
        channels: [geometry.channels[1], geometry.channels[0]],
        size: size_out,
        border: [last - top, last - left, after(0, top), after(1, left)],
        ..*geometry
    }
}

/// Swaps input and output channels, and rotates every kernel by half a turn.
pub(super) fn turn(weight: &[f32], geometry: &Geometry) -> Vec<f32> {
    let [channels_in, channels_out] = geometry.channels;
    let taps = geometry.kernel * geometry.kernel;
    let mut turned = vec![0.0; weight.len()];
    turned
        .par_chunks_exact_mut(channels_out * taps)
        .enumerate()
        .with_min_len(8)
        .for_each(|(channel, turned)| {
            let kernels = weight.chunks_exact(taps).skip(channel).step_by(channels_in);
            for (turned, kernel) in turned.chunks_exact_mut(taps).zip(kernels) {
                turned
                    .iter_mut()
                    .rev()
                    .zip(kernel)
                    .for_each(|(t, v)| *t = *v);
            }
        });
    turned
}
