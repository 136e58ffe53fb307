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
    #[cfg(feature = "flex")]
    if let Some(y) = native::cut(&x, size, [rows, columns], false) {
        return y;
    }
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
    #[cfg(feature = "flex")]
    if let Some(y) = native::cut(&x, size, [rows, columns], true) {
        return y;
    }
    x.reshape([batch, channels, size, size, rows, columns])
        .permute([0, 1, 4, 2, 5, 3])
        .reshape([batch, channels, rows * size, columns * size])
}

/// The same on burn's CPU backend, without a tensor of six dimensions.
#[cfg(feature = "flex")]
mod native {
    use super::*;
    use crate::kernels::squares::Cut;
    use crate::operation::{Operation, apply};

    /// `None` unless the tensor is in f32 on burn's CPU backend.
    pub(super) fn cut(
        x: &Tensor<4>,
        size: usize,
        squares: [usize; 2],
        back: bool,
    ) -> Option<Tensor<4>> {
        let [batch, channels, ..] = x.dims();
        let (area, [rows, columns]) = (size * size, squares);
        let shape = match back {
            true => [batch, channels / area, rows * size, columns * size],
            false => [batch, channels * area, rows, columns],
        };
        let cut = Directed {
            cut: Cut { size, squares },
            back,
        };
        apply(cut, [x.clone().into_dispatch()], shape)
    }

    #[derive(Debug, Clone, Copy)]
    struct Directed {
        cut: Cut,
        back: bool,
    }

    impl Operation<1> for Directed {
        type Saved = ();

        fn forward(&self, [x]: [&[f32]; 1]) -> (Vec<f32>, ()) {
            let y = match self.back {
                true => self.cut.to_space(x),
                false => self.cut.to_depth(x),
            };
            (y, ())
        }

        fn gradients(&self, [_]: [&[f32]; 1], (): &(), dy: &[f32], _: [bool; 1]) -> [Vec<f32>; 1] {
            [match self.back {
                true => self.cut.to_depth(dy),
                false => self.cut.to_space(dy),
            }]
        }
    }
}

#[cfg(all(test, feature = "flex"))]
mod tests {
    use burn::tensor::{DType, Device, Int};

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

    /// Several planes, unequal sides, squares of three: each pixel lands where the formula says.
    #[test]
    fn every_pixel_goes_where_the_formula_says() {
        let (batch, channels, rows, columns, s) = (2, 3, 4, 5, 3);
        let shape = [batch, channels, rows * s, columns * s];
        let count = shape.iter().product::<usize>();
        let x = Tensor::<1, Int>::arange(0..count as i64, &Device::flex())
            .float()
            .reshape(shape);
        let y = space_to_depth(x.clone(), s);
        assert_eq!(y.dims(), [batch, channels * s * s, rows, columns]);
        let values: Vec<f32> = y.clone().into_data().iter::<f32>().collect();
        for (place, value) in values.into_iter().enumerate() {
            let (q, r) = (place % columns, place / columns % rows);
            let channel = place / columns / rows;
            let (c, i, j) = (channel / s / s, channel / s % s, channel % s);
            let from = (c * rows * s + r * s + i) * columns * s + q * s + j;
            assert_eq!(value as usize, from, "{place}");
        }
        // Numbers of another type take burn's operations.
        let wide = |x: &Tensor<4>| x.clone().cast(DType::F64);
        let data = |x: Tensor<4>| x.cast(DType::F32).into_data();
        data(space_to_depth(wide(&x), s)).assert_eq(&y.clone().into_data(), true);
        data(depth_to_space(wide(&y), s)).assert_eq(&x.clone().into_data(), true);
        depth_to_space(y, s)
            .into_data()
            .assert_eq(&x.into_data(), true);
    }

    /// Gradients return to the pixels that they belong to.
    #[test]
    #[cfg(feature = "autodiff")]
    fn gradients_are_put_back() {
        let device = Device::flex().autodiff();
        let numbers = |first: i64, shape: [usize; 4]| {
            let count = shape.iter().product::<usize>() as i64;
            Tensor::<1, Int>::arange(first..first + count, &device)
                .float()
                .reshape(shape)
        };
        for (back, shape) in [(false, [1, 2, 4, 6]), (true, [1, 8, 2, 3])] {
            let change = |x| match back {
                true => depth_to_space(x, 2),
                false => space_to_depth(x, 2),
            };
            let x = numbers(1, shape).require_grad();
            let y = change(x.clone());
            let weights = numbers(100, y.dims());
            let gradients = (y * weights.clone()).sum().backward();
            // The sum is Σ x w', where w' are the weights put back.
            let expected = match back {
                true => space_to_depth(weights, 2),
                false => depth_to_space(weights, 2),
            };
            let found = x.grad(&gradients).expect("a gradient");
            found
                .into_data()
                .assert_eq(&expected.inner().into_data(), true);
        }
    }
}
