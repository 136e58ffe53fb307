//! Squares of pixels as channels, and back.

use burn::tensor::Tensor;

/// Turns every square of `size` × `size` pixels into channels.
///
/// ```text
/// y[c s² + i s + j, r, q] = x[c, r s + i, q s + j]
/// ```
///
/// # Shapes
///
/// `[batch, channels, rows, columns]` to `[batch, channels · s², rows / s, columns / s]`.
///
/// # Panics
///
/// When `size` does not divide rows and columns.
pub fn space_to_depth(x: Tensor<4>, size: usize) -> Tensor<4> {
    if size == 1 {
        return x;
    }
    let [batch, channels, rows, columns] = x.dims();
    assert!(
        rows.is_multiple_of(size) && columns.is_multiple_of(size),
        "{rows} × {columns} pixels cannot be cut into squares of {size} × {size}"
    );
    let (rows, columns) = (rows / size, columns / size);
    x.reshape([batch, channels, rows, size, columns, size])
        .permute([0, 1, 3, 5, 2, 4])
        .reshape([batch, channels * size * size, rows, columns])
}

/// Turns channels back into squares of pixels: the inverse of [`space_to_depth`].
///
/// # Shapes
///
/// `[batch, channels · s², rows, columns]` to `[batch, channels, rows · s, columns · s]`.
pub fn depth_to_space(x: Tensor<4>, size: usize) -> Tensor<4> {
    if size == 1 {
        return x;
    }
    let [batch, channels, rows, columns] = x.dims();
    let channels = channels / (size * size);
    x.reshape([batch, channels, size, size, rows, columns])
        .permute([0, 1, 4, 2, 5, 3])
        .reshape([batch, channels, rows * size, columns * size])
}

#[cfg(all(test, feature = "flex"))]
mod tests {
    use burn::tensor::{Device, Int};

    use super::*;

    #[test]
    fn a_four_by_four_image_becomes_four_channels_and_comes_back() {
        let x = Tensor::<1, Int>::arange(0..16, &Device::flex())
            .float()
            .reshape([1, 1, 4, 4]);
        let y = space_to_depth(x.clone(), 2);
        let values: Vec<f32> = y.clone().into_data().iter::<f32>().collect();
        let expected = [
            0., 2., 8., 10., 1., 3., 9., 11., 4., 6., 12., 14., 5., 7., 13., 15.,
        ];
        assert_eq!(
            values, expected,
            "worked out by hand, as torch's PixelUnshuffle orders them"
        );
        depth_to_space(y, 2)
            .into_data()
            .assert_eq(&x.into_data(), true);
    }
}
