//! Gradient of a convolution to its image: a convolution with the kernel turned around.

use rayon::prelude::*;

use super::convolve;
use super::geometry::Geometry;

/// Gradient to the image.
///
/// ```text
/// ∂L/∂x[c, q] = Σ_{o, t} weight[o, c, t] · dy[o, p],   p · stride + t − border = q
/// ```
///
/// Pixels whose places q + border leave the same remainder a when divided by the stride see the same taps a, a + stride, …
/// Each such phase is a convolution of `dy` with a smaller kernel; all phases are computed as channels of one.
///
/// # Shapes
///
/// - `dy`: `[batch, channels out, rows out, columns out]`
/// - `weight`: `[channels out, channels in, kernel, kernel]`
/// - result: `[batch, channels in, rows, columns]`
pub(crate) fn image_gradient(dy: &[f32], weight: &[f32], geometry: &Geometry) -> Vec<f32> {
    let phases = phases_of(geometry);
    let gradient = convolve(dy, &turn(weight, geometry), None, &phases);
    if geometry.stride == 1 {
        gradient
    } else {
        join(&gradient, &phases, geometry)
    }
}

/// The convolution of the output's gradient: its channels out are `[channel in, phase]`, and every phase begins with the pixel
/// at `border / stride · stride` of the image with its border.
pub(super) fn phases_of(geometry: &Geometry) -> Geometry {
    let Geometry {
        batch,
        channels: [channels_in, channels_out],
        size,
        stride,
        border: [top, left, ..],
        ..
    } = *geometry;
    let size_out = geometry.size_out();
    let kernel = geometry.kernel.div_ceil(stride);
    let after = |i: usize, before: usize| (size[i] + before).div_ceil(stride) - size_out[i];
    Geometry {
        batch,
        channels: [channels_out, channels_in * stride * stride],
        size: size_out,
        kernel,
        stride: 1,
        border: [
            kernel - 1 - top / stride,
            kernel - 1 - left / stride,
            after(0, top),
            after(1, left),
        ],
    }
}

/// Swaps channels in and out, splits every kernel by phases and turns each part by half a circle; places that a kernel does not
/// reach are 0.
pub(super) fn turn(weight: &[f32], geometry: &Geometry) -> Vec<f32> {
    let [channels_in, channels_out] = geometry.channels;
    let Geometry { kernel, stride, .. } = *geometry;
    let side = kernel.div_ceil(stride);
    let (taps, part) = (kernel * kernel, side * side);
    let mut turned = vec![0.0; channels_in * stride * stride * channels_out * part];
    turned
        .par_chunks_mut(stride * stride * channels_out * part)
        .enumerate()
        .with_min_len(8)
        .for_each(|(channel, turned)| {
            let kernels = weight.chunks_exact(taps).skip(channel).step_by(channels_in);
            for (o, values) in kernels.enumerate() {
                for (tap, value) in values.iter().enumerate() {
                    let [row, column] = [tap / kernel, tap % kernel];
                    let phase = row % stride * stride + column % stride;
                    let place = part - 1 - (row / stride * side + column / stride);
                    turned[(phase * channels_out + o) * part + place] = *value;
                }
            }
        });
    turned
}

/// Puts the pixels of all phases in their places.
fn join(gradient: &[f32], phases: &Geometry, geometry: &Geometry) -> Vec<f32> {
    let Geometry {
        size: [rows, columns],
        stride,
        border: [top, left, ..],
        ..
    } = *geometry;
    let columns_of_a_phase = phases.size_out()[1];
    let pixels = phases.pixels_out();
    let planes = geometry.batch * geometry.channels[0];
    let mut out = vec![0.0; planes * rows * columns];
    out.par_chunks_mut(rows * columns)
        .zip(gradient.par_chunks(stride * stride * pixels))
        .with_min_len(8)
        .for_each(|(out, phases)| {
            for (row, out) in out.chunks_exact_mut(columns).enumerate() {
                let row = row + top % stride;
                let of_row = &phases[row % stride * stride * pixels..];
                for phase in 0..stride {
                    let from = phase * pixels + row / stride * columns_of_a_phase;
                    // The first pixel of this phase that is not border.
                    let skipped = usize::from(phase < left % stride);
                    let first = skipped * stride + phase - left % stride;
                    let values = of_row[from + skipped..].iter();
                    for (out, value) in out.iter_mut().skip(first).step_by(stride).zip(values) {
                        *out = *value;
                    }
                }
            }
        });
    out
}
