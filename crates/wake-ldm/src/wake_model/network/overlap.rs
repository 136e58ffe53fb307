//! Overlapping squares: an orthogonal filter across their borders.

use std::f64::consts::{PI, SQRT_2};

use burn::tensor::{Tensor, TensorData};

use crate::wake_model::conditioning::PATCH_SIZE;
use wake_nn::cast_to;
use wake_nn::patch::{depth_to_space, space_to_depth};

/// Pixels on each side of a border that are filtered.
pub(super) const REACH: usize = PATCH_SIZE / 2;
/// Number of pixels of a square.
pub(super) const PIXELS: usize = PATCH_SIZE * PATCH_SIZE;

/// Filters images across the borders of their squares, so that the content of a filtered square reaches into its neighbours.
///
/// ```text
/// a + b stays,    b − a becomes V (b − a),    V = C₂ᵀ C₄
/// ```
///
/// - a, b: the four pixels before a border, and their mirror images behind it, farthest first; along rows and along columns
/// - C₂, C₄: cosine transforms of four numbers, types II and IV
///
/// The filter is orthogonal and preserves constants. At the edge of an image b equals a, so nothing changes there.
///
/// # Shapes
///
/// `[batch, 1, rows, columns]`, multiples of 8
///
/// # References
///
/// Malvar & Staelin (1989), "The LOT: Transform Coding Without Blocking Effects"; Tran, Liang & Tu (2003), "Lapped Transform
/// via Time-Domain Pre- and Post-Filtering", section III (the filter as a stage of its own).
pub(super) fn before_encoding(images: Tensor<4>) -> Tensor<4> {
    filtered(images, |i, j| [i, j])
}

/// The inverse of [`before_encoding`].
pub(super) fn after_decoding(images: Tensor<4>) -> Tensor<4> {
    filtered(images, |i, j| [j, i])
}

/// Applies the filter or, with swapped indices, its inverse.
fn filtered(images: Tensor<4>, index: impl Fn(usize, usize) -> [usize; 2]) -> Tensor<4> {
    let [batch, _, rows, columns] = images.dims();
    let line = across_a_border();
    let entry = |p: usize, q: usize| {
        let [from, to] = [
            index(p / PATCH_SIZE, q / PATCH_SIZE),
            index(p % PATCH_SIZE, q % PATCH_SIZE),
        ];
        (line[from[0]][from[1]] * line[to[0]][to[1]]) as f32
    };
    let matrix = (0..PIXELS * PIXELS).map(|n| entry(n / PIXELS, n % PIXELS));
    let matrix = TensorData::new(matrix.collect::<Vec<f32>>(), [1, PIXELS, PIXELS]);
    let matrix = cast_to(
        Tensor::<3>::from_data(matrix, &images.device()),
        images.dtype(),
    );
    let squares = space_to_depth(mirrored(mirrored(images, 2), 3), PATCH_SIZE);
    let [_, _, down, right] = squares.dims();
    let squares = matrix.matmul(squares.reshape([batch, PIXELS, down * right]));
    depth_to_space(squares.reshape([batch, PIXELS, down, right]), PATCH_SIZE)
        .narrow(2, REACH, rows)
        .narrow(3, REACH, columns)
}

/// Extends images by the mirror image of four pixels at both ends of a dimension.
fn mirrored(images: Tensor<4>, dimension: usize) -> Tensor<4> {
    let length = images.dims()[dimension];
    let mirror = |start| {
        images
            .clone()
            .narrow(dimension, start, REACH)
            .flip([dimension as isize])
    };
    let (first, last) = (mirror(0), mirror(length - REACH));
    Tensor::cat(vec![first, images, last], dimension)
}

/// Filter of the eight pixels about a border, in their order.
fn across_a_border() -> [[f64; PATCH_SIZE]; PATCH_SIZE] {
    let n = REACH as f64;
    let second = |k: usize, i: usize| {
        let scale = if k == 0 { 1.0 / SQRT_2 } else { 1.0 };
        scale * (2.0 / n).sqrt() * (PI * k as f64 * (i as f64 + 0.5) / n).cos()
    };
    let fourth = |k: usize, j: usize| {
        (2.0 / n).sqrt() * (PI * (k as f64 + 0.5) * (j as f64 + 0.5) / n).cos()
    };
    let mut filter = [[0.0; PATCH_SIZE]; PATCH_SIZE];
    for (i, j) in (0..PATCH_SIZE).flat_map(|i| (0..PATCH_SIZE).map(move |j| (i, j))) {
        let [from_end_i, from_end_j] = [i, j].map(|k| k.min(PATCH_SIZE - 1 - k));
        let turned: f64 = (0..REACH)
            .map(|k| second(k, from_end_i) * fourth(k, from_end_j))
            .sum();
        let kept = f64::from(u8::from(from_end_i == from_end_j));
        let same_side = (i < REACH) == (j < REACH);
        filter[i][j] = 0.5 * (kept + if same_side { turned } else { -turned });
    }
    filter
}

#[cfg(all(test, feature = "flex"))]
mod tests {
    use super::*;
    use burn::tensor::Device;
    use wake_nn::noise::NoiseSource;

    fn image(rows: usize, columns: usize) -> Tensor<4> {
        let values = NoiseSource::new(5).normal(0, rows * columns);
        let data = TensorData::new(values, [1, 1, rows, columns]);
        Tensor::from_data(data, &Device::flex())
    }

    fn largest(difference: Tensor<4>) -> f32 {
        difference.abs().max().into_scalar::<f32>()
    }

    #[test]
    fn the_filter_is_undone_and_keeps_the_square_sum() {
        let image = image(32, 48);
        let filtered = before_encoding(image.clone());
        assert!(largest(filtered.clone() - image.clone()) > 0.5);
        // A sum of 64 products in f32.
        assert!(largest(after_decoding(filtered.clone()) - image.clone()) < 1e-5);
        let power = |x: Tensor<4>| x.square().sum().into_scalar::<f32>();
        assert!((power(filtered) / power(image) - 1.0).abs() < 1e-5);
    }

    #[test]
    fn a_constant_stays() {
        let flat = Tensor::<4>::ones([1, 1, 24, 24], &Device::flex());
        assert!(largest(before_encoding(flat.clone()) - flat) < 1e-6);
    }

    /// The filter follows its formula and order, pixel by pixel.
    #[test]
    fn differences_across_a_border_are_turned() {
        let x = image(8, 16);
        let of = |x: &Tensor<4>| -> Vec<f64> { x.to_data().iter::<f64>().collect() };
        let (x, y) = (of(&x), of(&before_encoding(x)));
        // There is one row of squares, so nothing changes along columns.
        let cosine = |k: f64, i: f64| 0.5f64.sqrt() * (PI * k * (i + 0.5) / 4.0).cos();
        for row in 0..8 {
            let (x, y) = (&x[16 * row..][..16], &y[16 * row..][..16]);
            let pair = |z: &[f64], k: usize| (z[4 + k], z[11 - k]);
            for i in 0..4 {
                let ((a, b), (c, d)) = (pair(x, i), pair(y, i));
                assert!((a + b - c - d).abs() < 1e-5);
                let turned: f64 = (0..4)
                    .flat_map(|j| (0..4).map(move |k| (j, k)))
                    .map(|(j, k)| {
                        let flat = if k == 0 { 0.5f64.sqrt() } else { 1.0 };
                        let (a, b) = pair(x, j);
                        flat * cosine(k as f64, i as f64)
                            * cosine(k as f64 + 0.5, j as f64)
                            * (b - a)
                    })
                    .sum();
                assert!((d - c - turned).abs() < 1e-5, "{row} {i}");
            }
            assert!((0..4).chain(12..16).all(|j| (x[j] - y[j]).abs() < 1e-5));
        }
    }
}
