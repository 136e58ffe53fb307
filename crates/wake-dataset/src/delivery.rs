//! Delivery of an image: resizing and JPEG compression.

use super::grey::Grey;
use crate::error::{Error, Result};
use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, ImageFormat};
use wake_physics::Scene;

/// Side of the blocks of JPEG \[pixels\].
const BLOCK: usize = 8;
/// Half-width of the cubic kernel \[pixels of the coarser image\].
const REACH: f64 = 2.0;

/// Processing from the image of a product to the delivered image.
///
/// The product is simulated with pixels of `resize` times the delivered size and with a margin. Its grey levels are interpolated
/// at the centres of the delivered pixels (Catmull & Rom's cubic, widened where the image shrinks), compressed and cut. The
/// origin is the same place in both images, so the labels of the delivered scene hold unchanged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Delivery {
    /// Pixel size of the product over the pixel size of the delivered image, 0.25 to 4.
    pub resize: f64,
    /// JPEG quality, 1 to 100; `None` for no compression.
    pub quality: Option<u8>,
    /// Rows and columns from the border of a JPEG block to the first pixel, below 8.
    pub phase: [usize; 2],
}

impl Delivery {
    /// The scene on the grid of the product.
    #[must_use]
    pub fn product(&self, delivered: &Scene) -> Scene {
        let mut scene = delivered.clone();
        scene.grid.spacing *= self.resize;
        scene.grid.rows = self.product_pixels(delivered.grid.rows);
        scene.grid.columns = self.product_pixels(delivered.grid.columns);
        scene
    }

    /// Pixels along an axis of the product that cover `count` delivered pixels and the blocks around them.
    fn product_pixels(&self, count: usize) -> usize {
        let half = (count.div_ceil(2) + 2 * BLOCK) as f64 / self.resize;
        2 * (half + REACH * self.widening()).ceil() as usize + 2
    }

    /// Width of the kernel in pixels of the product.
    fn widening(&self) -> f64 {
        (1.0 / self.resize).max(1.0)
    }

    /// Resizes, compresses and cuts a product to the delivered image, with 8-bit grey levels.
    ///
    /// - `product`: grey image of [`Self::product`]
    /// - `size`: rows and columns of the delivered scene
    ///
    /// # Errors
    ///
    /// [`Error::Source`] if the codec refuses the image.
    pub fn deliver(&self, product: &Grey, [rows, columns]: [usize; 2]) -> Result<Grey> {
        let [down, right] = self.phase;
        let padded = [rows, columns].map(|count| (count + BLOCK - 1).next_multiple_of(BLOCK));
        let whole = self.resized(product, [rows, columns], padded);
        let levels = match self.quality {
            Some(quality) => compressed(&whole.levels(), padded, quality)?,
            None => whole.levels(),
        };
        let row = |i: usize| &levels[(i + down) * padded[1] + right..][..columns];
        let cut: Vec<u8> = (0..rows).flat_map(|i| row(i).iter().copied()).collect();
        Ok(Grey::of_levels(&cut, rows, columns))
    }

    /// The product's grey levels at `padded` delivered pixels from the first block.
    fn resized(&self, product: &Grey, size: [usize; 2], padded: [usize; 2]) -> Grey {
        let taps = |axis: usize, count: usize| -> Vec<Taps> {
            let first = (self.phase[axis] + size[axis] / 2) as f64;
            let middle = (count / 2) as f64;
            let place = |i: usize| middle + (i as f64 - first) / self.resize;
            (0..padded[axis])
                .map(|i| Taps::at(place(i), count, self.widening()))
                .collect()
        };
        let (down, right) = (taps(0, product.rows), taps(1, product.columns));
        let along =
            |row: &[f32]| -> Vec<f32> { right.iter().map(|taps| taps.of(row, 1)).collect() };
        let lines: Vec<f32> = product
            .pixels
            .chunks_exact(product.columns.max(1))
            .flat_map(along)
            .collect();
        let column = |taps: &Taps, j: usize| taps.of(&lines[j..], padded[1]).clamp(0.0, 1.0);
        let pixels = down
            .iter()
            .flat_map(|taps| (0..padded[1]).map(move |j| column(taps, j)))
            .collect();
        Grey {
            rows: padded[0],
            columns: padded[1],
            pixels,
        }
    }
}

/// Interpolation weights of neighbouring pixels.
struct Taps {
    first: usize,
    weights: Vec<f32>,
}

impl Taps {
    /// Weights of the cubic kernel around a place on a line of `count` pixels.
    ///
    /// - `widening`: width of the kernel \[pixels\]
    fn at(place: f64, count: usize, widening: f64) -> Self {
        let last = count.saturating_sub(1) as f64;
        let [low, high] = [
            (place - REACH * widening).ceil().clamp(0.0, last),
            (place + REACH * widening).floor().clamp(0.0, last),
        ];
        let pixels = low as usize..=high as usize;
        let weights: Vec<f64> = pixels
            .map(|m| cubic((place - m as f64) / widening))
            .collect();
        let sum: f64 = weights.iter().sum();
        Self {
            first: low as usize,
            weights: weights.iter().map(|w| (w / sum) as f32).collect(),
        }
    }

    /// Weighted sum of values that are `step` apart.
    fn of(&self, values: &[f32], step: usize) -> f32 {
        let values = values.iter().skip(self.first * step).step_by(step);
        self.weights.iter().zip(values).map(|(w, v)| w * v).sum()
    }
}

/// Interpolating cubic of Catmull & Rom (1974), in the form of Keys (1981) with a = −½.
fn cubic(x: f64) -> f64 {
    match x.abs() {
        x if x < 1.0 => (1.5 * x - 2.5) * x * x + 1.0,
        x if x < 2.0 => ((-0.5 * x + 2.5) * x - 4.0) * x + 2.0,
        _ => 0.0,
    }
}

/// Levels of `[rows, columns]` pixels after JPEG compression.
fn compressed(levels: &[u8], [rows, columns]: [usize; 2], quality: u8) -> Result<Vec<u8>> {
    let failed = |error| Error::Source(Box::new(error));
    let mut file = Vec::new();
    JpegEncoder::new_with_quality(&mut file, quality)
        .encode(levels, columns as u32, rows as u32, ExtendedColorType::L8)
        .map_err(failed)?;
    let image = image::load_from_memory_with_format(&file, ImageFormat::Jpeg).map_err(failed)?;
    Ok(image.into_luma8().into_raw())
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;

    fn delivery(resize: f64, quality: Option<u8>) -> Delivery {
        Delivery {
            resize,
            quality,
            phase: [3, 6],
        }
    }

    /// Product of a scene whose grey level is a function of the place \[m\].
    fn drawn(delivery: Delivery, scene: &Scene, grey: impl Fn(f64, f64) -> f64) -> Grey {
        let grid = delivery.product(scene).grid;
        let x = |j: usize| (j as f64 - (grid.columns / 2) as f64) * grid.spacing;
        let y = |i: usize| ((grid.rows / 2) as f64 - i as f64) * grid.spacing;
        let pixels = (0..grid.rows)
            .flat_map(|i| (0..grid.columns).map(move |j| (i, j)))
            .map(|(i, j)| grey(x(j), y(i)) as f32)
            .collect();
        Grey {
            rows: grid.rows,
            columns: grid.columns,
            pixels,
        }
    }

    fn scene() -> Scene {
        let keys = ["grid.rows=40", "grid.columns=53", "grid.spacing=8"];
        Scene::default().with_assignments(&keys).unwrap()
    }

    /// A linear ramp of grey is the same ramp at the delivered pixels: cubic interpolation is exact for it, and 8 bits round by
    /// half of 1/255. So each place is delivered at the pixel that its label gives.
    #[test]
    fn places_keep_their_labels() {
        let scene = scene();
        let plane = |x: f64, y: f64| 0.5 + 1.1e-3 * x - 0.9e-3 * y;
        for resize in [0.4, 0.8, 1.0, 1.37, 2.6] {
            let delivery = delivery(resize, None);
            let product = drawn(delivery, &scene, plane);
            let image = delivery.deliver(&product, [40, 53]).unwrap();
            for (n, grey) in image.pixels.iter().enumerate() {
                let (x, y) = (
                    ((n % 53) as f64 - 26.0) * 8.0,
                    (20.0 - (n / 53) as f64) * 8.0,
                );
                let off = (f64::from(*grey) - plane(x, y)).abs();
                assert!(off < 0.5 / 255.0 + 1e-5, "{resize}: {off} at {x}, {y}");
            }
        }
    }

    /// Without resizing and compression, the image is the middle of the product.
    #[test]
    fn nothing_to_do_changes_nothing() {
        let scene = scene();
        let noise = |x: f64, y: f64| ((12.9898 * x + 78.233 * y).sin() * 437.5).fract().abs();
        let delivery = delivery(1.0, None);
        let product = drawn(delivery, &scene, noise);
        let image = delivery.deliver(&product, [40, 53]).unwrap();
        let levels = product.levels();
        let [top, left] = [product.rows / 2 - 20, product.columns / 2 - 26];
        for (n, level) in image.levels().iter().enumerate() {
            let (i, j) = (n / 53 + top, n % 53 + left);
            assert_eq!(*level, levels[i * product.columns + j]);
        }
    }

    /// Waves shorter than two delivered pixels are not aliased into an image that is reduced to a quarter.
    #[test]
    fn a_smaller_image_is_smoothed_first() {
        let scene = scene();
        let wave = |x: f64, _: f64| 0.5 + 0.4 * (std::f64::consts::TAU * x / 5.0).cos();
        let delivery = delivery(0.25, None);
        let image = delivery
            .deliver(&drawn(delivery, &scene, wave), [40, 53])
            .unwrap();
        // The widened kernel leaves 2 % of a wave of 0.62 delivered pixels; sampling alone would keep its amplitude.
        assert!(image.pixels.iter().all(|grey| (grey - 0.5).abs() < 0.02));
    }

    /// JPEG quantises the coefficients of each block: at quality 90, smooth grey changes by at most two levels; at 10, steps
    /// appear at the block borders given by the phase.
    #[test]
    fn compression_has_blocks_at_the_phase() {
        let scene = scene();
        let delivery = delivery(1.0, Some(90));
        let smooth = |x: f64, y: f64| 0.5 + 0.1 * (x / 90.0).sin() * (y / 70.0).cos();
        let product = drawn(delivery, &scene, smooth);
        let plain = Delivery {
            quality: None,
            ..delivery
        };
        let [image, before] = [delivery, plain].map(|d| d.deliver(&product, [40, 53]).unwrap());
        let apart = image.pixels.iter().zip(&before.pixels);
        assert!(apart.clone().all(|(a, b)| (a - b).abs() < 2.5 / 255.0));
        let low = Delivery {
            quality: Some(10),
            ..delivery
        };
        let image = low.deliver(&product, [40, 53]).unwrap();
        // Steps from column to column are largest at block borders, at columns 8 n − 6 of the image.
        let step = |j: usize| -> f32 {
            let row = |i: usize| (image.pixels[i * 53 + j] - image.pixels[i * 53 + j - 1]).abs();
            (0..40).map(row).sum()
        };
        let mean = |first: usize| -> f32 {
            let columns: Vec<usize> = (first..53).step_by(8).collect();
            columns.iter().map(|&j| step(j)).sum::<f32>() / columns.len() as f32
        };
        let others = (1..9).filter(|&first| first != 2).map(mean);
        let largest = others.fold(0.0, f32::max);
        assert!(mean(2) > largest, "{} {largest}", mean(2));
    }

    /// The kernel interpolates, and its weights sum to 1 at any position.
    #[test]
    fn the_kernel_is_a_partition_of_one() {
        for n in -1..=1 {
            assert!((cubic(f64::from(n)) - f64::from(u8::from(n == 0))).abs() < 1e-15);
        }
        for place in [0.0, 0.1, 0.37, 0.5, 0.93] {
            let sum: f64 = (-2..4).map(|m| cubic(place - f64::from(m))).sum();
            assert!((sum - 1.0).abs() < 1e-14);
        }
    }
}
