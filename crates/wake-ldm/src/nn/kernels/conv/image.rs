//! Gradient of a convolution to its image: a convolution with the kernel turned around.

use rayon::prelude::*;

use super::{Geometry, convolve};

/// Gradient to the image.
///
/// ```text
/// ∂L/∂x[c, q] = Σ_{o, t} weight[o, c, t] · dy[o, p],   p · stride + t − border = q
/// ```
///
/// Output pixels are first set `stride` apart, with zeros between them.
///
/// # Shapes
///
/// - `dy`: `[batch, channels out, rows out, columns out]`
/// - `weight`: `[channels out, channels in, kernel, kernel]`
/// - result: `[batch, channels in, rows, columns]`
pub(in crate::nn) fn image_gradient(dy: &[f32], weight: &[f32], geometry: &Geometry) -> Vec<f32> {
    let Geometry {
        batch,
        channels: [channels_in, channels_out],
        size,
        kernel,
        stride,
        border: [top, left, ..],
    } = *geometry;
    let apart = geometry.size_out().map(|size| (size - 1) * stride + 1);
    let back = Geometry {
        batch,
        channels: [channels_out, channels_in],
        size: apart,
        kernel,
        stride: 1,
        border: [
            kernel - 1 - top,
            kernel - 1 - left,
            size[0] + top - apart[0],
            size[1] + left - apart[1],
        ],
    };
    let turned = turn(weight, geometry);
    if stride == 1 {
        convolve(dy, &turned, None, &back)
    } else {
        convolve(&spread(dy, geometry, apart), &turned, None, &back)
    }
}

/// Swaps channels in and out and turns every kernel by half a circle.
fn turn(weight: &[f32], geometry: &Geometry) -> Vec<f32> {
    let [channels_in, channels_out] = geometry.channels;
    let taps = geometry.kernel * geometry.kernel;
    let mut turned = vec![0.0; weight.len()];
    turned
        .par_chunks_mut(channels_out * taps)
        .enumerate()
        .with_min_len(8)
        .for_each(|(channel, turned)| {
            let kernels = weight.chunks_exact(taps).skip(channel).step_by(channels_in);
            for (turned, kernel) in turned.chunks_exact_mut(taps).zip(kernels) {
                for (turned, value) in turned.iter_mut().rev().zip(kernel) {
                    *turned = *value;
                }
            }
        });
    turned
}

/// Sets the pixels of all planes `stride` apart.
fn spread(dy: &[f32], geometry: &Geometry, [rows, columns]: [usize; 2]) -> Vec<f32> {
    let columns_out = geometry.size_out()[1];
    let mut out = vec![0.0; dy.len() / geometry.pixels_out() * rows * columns];
    out.par_chunks_mut(rows * columns)
        .zip(dy.par_chunks(geometry.pixels_out()))
        .with_min_len(8)
        .for_each(|(out, dy)| {
            let rows = out.chunks_mut(columns).step_by(geometry.stride);
            for (out, dy) in rows.zip(dy.chunks_exact(columns_out)) {
                for (out, value) in out.iter_mut().step_by(geometry.stride).zip(dy) {
                    *out = *value;
                }
            }
        });
    out
}
