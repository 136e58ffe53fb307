//! Group normalisation, optionally followed by SiLU, and its gradients, in one pass over memory each.

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::silu::sigmoid;
use super::sum::{product_sum, sum};
use crate::kernels::zeros;

/// Sizes and options of a normalisation.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shape {
    /// Channels of an image.
    pub(crate) channels: usize,
    /// Groups of channels.
    pub(crate) groups: usize,
    /// Pixels of a channel.
    pub(crate) pixels: usize,
    /// ε under the root.
    pub(crate) epsilon: f32,
    /// Whether SiLU is applied afterwards.
    pub(crate) silu: bool,
}

impl Shape {
    fn per_group(&self) -> usize {
        self.channels / self.groups
    }

    fn group(&self) -> usize {
        self.per_group() * self.pixels
    }

    /// Values of a parameter for one group; groups are counted over the batch.
    fn of_group<'a>(&self, parameter: &'a [f32], group: usize) -> &'a [f32] {
        &parameter[group % self.groups * self.per_group()..][..self.per_group()]
    }
}

/// Mean and 1 / √(variance + ε) of every group of every image.
pub(crate) type Moments = Vec<[f32; 2]>;

/// Normalises; see [`GroupNorm`](crate::norm::GroupNorm).
///
/// # Shapes
///
/// - `x`: `[batch, channels, pixels]`
/// - `parameters`: weight and bias, `[channels]` each
/// - result: as `x`, and the moments `[batch · groups]`
pub(crate) fn normalize(x: &[f32], parameters: [&[f32]; 2], shape: &Shape) -> (Vec<f32>, Moments) {
    let mut y = zeros(x.len());
    let arch = Arch::new();
    let moments = y
        .par_chunks_mut(shape.group())
        .zip(x.par_chunks(shape.group()))
        .enumerate()
        .map(|(group, (y, x))| {
            let parameters = parameters.map(|p| shape.of_group(p, group));
            arch.dispatch(Forward {
                x,
                parameters,
                shape,
                y,
            })
        })
        .collect();
    (y, moments)
}

/// One group of one image in the forward pass.
struct Forward<'a> {
    x: &'a [f32],
    parameters: [&'a [f32]; 2],
    shape: &'a Shape,
    y: &'a mut [f32],
}

impl WithSimd for Forward<'_> {
    type Output = [f32; 2];

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> [f32; 2] {
        let (x, pixels) = (self.x, self.shape.pixels);
        let count = x.len() as f32;
        let mean = sum(x, |v| v) / count;
        let variance = sum(x, |v| (v - mean) * (v - mean)) / count;
        let inverse = 1.0 / (variance + self.shape.epsilon).sqrt();
        let [weight, bias] = self.parameters;
        let silu = self.shape.silu;
        let images = x.chunks_exact(pixels).zip(self.y.chunks_exact_mut(pixels));
        for ((x, y), (weight, &bias)) in images.zip(weight.iter().zip(bias)) {
            let scale = inverse * weight;
            for (y, x) in y.iter_mut().zip(x) {
                let z = (x - mean).mul_add(scale, bias);
                *y = if silu { z * sigmoid(z) } else { z };
            }
        }
        [mean, inverse]
    }
}

/// Gradients with respect to the image, the weight and the bias.
///
/// ```text
/// x̂ = (x − μ) r,   z = x̂ γ + β,   y = z or z σ(z)
/// dz = dy · (1 or σ(z) (1 + z (1 − σ(z)))),   dγ = Σ dz x̂,   dβ = Σ dz
/// dx = r (γ dz − ⟨γ dz⟩ − x̂ ⟨γ dz x̂⟩)        ⟨·⟩: mean over the group
/// ```
///
/// # Shapes
///
/// - `x`, `dy`: `[batch, channels, pixels]`; `parameters`: weight γ and bias β, `[channels]` each
/// - result: `dx`, `dγ`, `dβ`, with the shapes of `x`, γ and β
pub(crate) fn gradients(
    x: &[f32],
    dy: &[f32],
    parameters: [&[f32]; 2],
    moments: &[[f32; 2]],
    shape: &Shape,
) -> [Vec<f32>; 3] {
    let mut dx = zeros(x.len());
    let mut partial = vec![[0.0; 2]; x.len() / shape.pixels];
    let arch = Arch::new();
    dx.par_chunks_mut(shape.group())
        .zip(
            x.par_chunks(shape.group())
                .zip(dy.par_chunks(shape.group())),
        )
        .zip(partial.par_chunks_mut(shape.per_group()).zip(moments))
        .enumerate()
        .for_each(|(group, ((dx, (x, dy)), (sums, &moments)))| {
            arch.dispatch(Backward {
                x,
                dy,
                parameters: parameters.map(|p| shape.of_group(p, group)),
                moments,
                shape,
                dx,
                sums,
            });
        });
    let total = |of: usize| {
        let mut total = vec![0.0; shape.channels];
        for image in partial.chunks_exact(shape.channels) {
            for (total, sums) in total.iter_mut().zip(image) {
                *total += sums[of];
            }
        }
        total
    };
    let (weight, bias) = (total(0), total(1));
    [dx, weight, bias]
}

/// One group of one image in the backward pass.
struct Backward<'a> {
    x: &'a [f32],
    dy: &'a [f32],
    parameters: [&'a [f32]; 2],
    moments: [f32; 2],
    shape: &'a Shape,
    dx: &'a mut [f32],
    /// Σ dz x̂ and Σ dz of every channel.
    sums: &'a mut [[f32; 2]],
}

impl WithSimd for Backward<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, _: S) {
        self.through_silu();
        let [mean, inverse] = self.moments;
        let weight = self.parameters[0];
        let mut means = [0.0; 2];
        for (weight, sums) in weight.iter().zip(&*self.sums) {
            for (mean, sum) in means.iter_mut().zip(sums) {
                *mean += weight * sum / self.x.len() as f32;
            }
        }
        let pixels = self.shape.pixels;
        let planes = self
            .x
            .chunks_exact(pixels)
            .zip(self.dx.chunks_exact_mut(pixels));
        for ((x, dx), &weight) in planes.zip(weight) {
            for (dx, x) in dx.iter_mut().zip(x) {
                let normalized = (x - mean) * inverse;
                *dx = inverse * (dx.mul_add(weight, -means[1]) - normalized * means[0]);
            }
        }
    }
}

impl Backward<'_> {
    /// Writes dz into the buffer of dx, and sums it.
    #[inline(always)]
    fn through_silu(&mut self) {
        let pixels = self.shape.pixels;
        let [mean, inverse] = self.moments;
        let [weight, bias] = self.parameters;
        let silu = self.shape.silu;
        let planes = self
            .x
            .chunks_exact(pixels)
            .zip(self.dy.chunks_exact(pixels));
        let outs = self.dx.chunks_exact_mut(pixels).zip(&mut *self.sums);
        for (((x, dy), (dz, sums)), (weight, bias)) in planes.zip(outs).zip(weight.iter().zip(bias))
        {
            let bias = *bias;
            let scale = inverse * weight;
            for ((dz, dy), x) in dz.iter_mut().zip(dy).zip(x) {
                let z = (x - mean).mul_add(scale, bias);
                let s = sigmoid(z);
                let slope = if silu {
                    s * z.mul_add(1.0 - s, 1.0)
                } else {
                    1.0
                };
                *dz = dy * slope;
            }
            *sums = [product_sum(dz, x, |x| (x - mean) * inverse), sum(dz, |v| v)];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::noise;

    const SHAPE: Shape = Shape {
        channels: 6,
        groups: 3,
        pixels: 35,
        epsilon: 1e-5,
        silu: true,
    };

    /// The formula in f64.
    fn exact(x: &[f64], weight: &[f64], bias: &[f64], shape: &Shape) -> Vec<f64> {
        let groups = x.chunks(shape.group()).enumerate();
        let normalize = |(group, x): (usize, &[f64])| {
            let mean = x.iter().sum::<f64>() / x.len() as f64;
            let square = x.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
            let deviation = (square / x.len() as f64 + f64::from(shape.epsilon)).sqrt();
            let first = group % shape.groups * shape.per_group();
            let value = |(i, v): (usize, &f64)| {
                let channel = first + i / shape.pixels;
                let z = (v - mean) / deviation * weight[channel] + bias[channel];
                if shape.silu {
                    z / (1.0 + (-z).exp())
                } else {
                    z
                }
            };
            x.iter().enumerate().map(value).collect::<Vec<_>>()
        };
        groups.flat_map(normalize).collect()
    }

    fn wide(values: &[f32]) -> Vec<f64> {
        values.iter().map(|&v| f64::from(v)).collect()
    }

    #[test]
    fn values_are_those_of_the_formula() {
        for silu in [false, true] {
            let shape = Shape { silu, ..SHAPE };
            let x: Vec<f32> = noise(2 * 6 * 35, 1).iter().map(|v| 3.0 * v + 2.0).collect();
            let (weight, bias) = (noise(6, 2), noise(6, 3));
            let (y, _) = normalize(&x, [&weight, &bias], &shape);
            let exact = exact(&wide(&x), &wide(&weight), &wide(&bias), &shape);
            for (y, exact) in y.iter().zip(exact) {
                // Values are below 2, with a dozen roundings each.
                assert!((f64::from(*y) - exact).abs() < 12.0 * 2.0 * 6e-8);
            }
        }
    }

    #[test]
    fn a_constant_image_gives_the_bias() {
        let (weight, bias) = (noise(6, 2), noise(6, 3));
        let shape = Shape {
            silu: false,
            ..SHAPE
        };
        let (y, _) = normalize(&[0.75; 6 * 35], [&weight, &bias], &shape);
        for (y, bias) in y.chunks(35).zip(&bias) {
            assert!(y.iter().all(|v| (v - bias).abs() < 1e-7));
        }
    }

    /// Gradients against central differences of the formula in f64.
    #[test]
    fn gradients_are_differences() {
        for silu in [false, true] {
            let shape = Shape { silu, ..SHAPE };
            let inputs = [noise(2 * 6 * 35, 1), noise(6, 2), noise(6, 3)];
            let dy = noise(2 * 6 * 35, 4);
            let [x, weight, bias] = &inputs;
            let (_, moments) = normalize(x, [weight, bias], &shape);
            let ours = gradients(x, &dy, [weight, bias], &moments, &shape);
            for (input, ours) in ours.iter().enumerate() {
                for (i, ours) in ours.iter().enumerate() {
                    let at = |step: f64| {
                        let mut moved = [wide(x), wide(weight), wide(bias)];
                        moved[input][i] += step;
                        let y = exact(&moved[0], &moved[1], &moved[2], &shape);
                        y.iter()
                            .zip(&dy)
                            .map(|(y, dy)| y * f64::from(*dy))
                            .sum::<f64>()
                    };
                    let slope = (at(1e-5) - at(-1e-5)) / 2e-5;
                    // Gradients are of order 1: 70 terms in f32, and (10⁻⁵)² times the third derivative.
                    let error = (f64::from(*ours) - slope).abs();
                    assert!(error < 1e-5, "input {input}, element {i}: {ours} {slope}");
                }
            }
        }
    }
}
