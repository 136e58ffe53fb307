//! Converts grey levels of any scaling to contrast in standard deviations of the speckle.

/// Spacing of the places where the background is measured, and half the window around each \[pixels\].
const STEP: usize = 32;
const REACH: usize = 56;
/// Step of the subsampling of pixels, in each direction.
const SKIP: usize = 3;
/// Ratio of standard deviation to median absolute deviation for normal noise.
const NORMAL: f32 = 1.4826;
/// Smallest local spread as a share of the median spread, so that flat areas are not amplified.
const LEAST: f32 = 0.3;
/// Spread below this share of the largest level is rounding and set to zero.
const ROUNDING: f32 = 1e-5;
/// Bounds of the contrast in the network's input.
const BOUNDS: [f32; 2] = [-5.0, 6.0];

/// Local median and spread on a coarse lattice.
struct Background {
    rows: usize,
    columns: usize,
    values: Vec<[f32; 2]>,
}

impl Background {
    fn of(pixels: &[f32], rows: usize, columns: usize) -> Self {
        let lattice = |n: usize| n.div_ceil(STEP) + 1;
        let (lattice_rows, lattice_columns) = (lattice(rows), lattice(columns));
        let window = |k: usize, n: usize| {
            let centre = (k * STEP).min(n - 1);
            (centre.saturating_sub(REACH), (centre + REACH).min(n))
        };
        let largest = pixels
            .iter()
            .fold(0.0f32, |largest, x| largest.max(x.abs()));
        let mut values = Vec::with_capacity(lattice_rows * lattice_columns);
        let mut seen = Vec::new();
        for r in 0..lattice_rows {
            let (top, bottom) = window(r, rows);
            for c in 0..lattice_columns {
                let (left, right) = window(c, columns);
                seen.clear();
                for row in (top..bottom).step_by(SKIP) {
                    let line = &pixels[row * columns..][left..right];
                    seen.extend(line.iter().step_by(SKIP));
                }
                let middle = median(&mut seen);
                seen.iter_mut().for_each(|x| *x = (*x - middle).abs());
                let spread = NORMAL * median(&mut seen);
                values.push([
                    middle,
                    if spread > ROUNDING * largest {
                        spread
                    } else {
                        0.0
                    },
                ]);
            }
        }
        let mut spreads: Vec<f32> = values.iter().map(|v| v[1]).filter(|&s| s > 0.0).collect();
        let usual = if spreads.is_empty() {
            0.0
        } else {
            median(&mut spreads)
        };
        for value in &mut values {
            value[1] = value[1].max(LEAST * usual);
        }
        Self {
            rows: lattice_rows,
            columns: lattice_columns,
            values,
        }
    }

    /// Contrast of every pixel in standard deviations.
    fn contrast(&self, pixels: &[f32], columns: usize) -> Vec<f32> {
        let place = |i: usize, n: usize| {
            let cell = (i / STEP).min(n - 2);
            (cell, (i - cell * STEP) as f32 / STEP as f32)
        };
        let across: Vec<_> = (0..columns).map(|j| place(j, self.columns)).collect();
        let mut contrast = Vec::with_capacity(pixels.len());
        for (i, line) in pixels.chunks_exact(columns).enumerate() {
            let (r, v) = place(i, self.rows);
            let [above, below] =
                [r, r + 1].map(|r| &self.values[r * self.columns..][..self.columns]);
            let value = |c: usize, u: f32, k: usize| {
                let mix = |line: &[[f32; 2]]| line[c][k] + u * (line[c + 1][k] - line[c][k]);
                mix(above) + v * (mix(below) - mix(above))
            };
            contrast.extend(line.iter().zip(&across).map(|(&x, &(c, u))| {
                let spread = value(c, u, 1);
                if spread > 0.0 {
                    (x - value(c, u, 0)) / spread
                } else {
                    0.0
                }
            }));
        }
        contrast
    }
}

/// Median of numbers, which are reordered.
fn median(numbers: &mut [f32]) -> f32 {
    let middle = numbers.len() / 2;
    *numbers.select_nth_unstable_by(middle, f32::total_cmp).1
}

/// Contrast to the median of the surroundings, in standard deviations of the speckle there; 0 where nothing varies.
///
/// # Shapes
///
/// `rows · columns` numbers, row by row, in and out; none may be missing.
pub fn contrast(pixels: &[f32], rows: usize, columns: usize) -> Vec<f32> {
    Background::of(pixels, rows, columns).contrast(pixels, columns)
}

/// Network inputs for a contrast: the contrast within bounds, and a logarithm that also resolves bright pixels above them.
pub fn inputs(contrast: f32) -> [f32; 2] {
    let [low, high] = BOUNDS;
    [
        0.7 * contrast.clamp(low, high),
        (1.0 + 0.25 * contrast.max(0.0)).ln() - 0.2,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use wake_nn::noise::NoiseSource;

    fn noise(rows: usize, columns: usize) -> Vec<f32> {
        NoiseSource::new(2).normal(0, rows * columns)
    }

    /// Normal noise gets unit spread; the median of 1,444 numbers has an error of 1.25/38, the median deviation one of 1.17/38.
    #[test]
    fn noise_has_unit_spread_whatever_its_scaling() {
        let pixels = noise(200, 170);
        let reference = contrast(&pixels, 200, 170);
        let power = reference.iter().map(|z| z * z).sum::<f32>() / reference.len() as f32;
        assert!((power - 1.0).abs() < 0.06, "{power}");
        for (gain, offset) in [(1e-3, 0.0), (30.0, 1e3), (1e4, -7.0)] {
            let scaled: Vec<f32> = pixels.iter().map(|x| gain * x + offset).collect();
            let found = contrast(&scaled, 200, 170);
            // Rounding of the offset, relative to the gain, a few times.
            let rounding = 8.0 * f32::EPSILON * (offset / gain + 5.0).abs();
            for (a, b) in reference.iter().zip(found) {
                assert!((a - b).abs() < rounding * (1.0 + a.abs()), "{a} {b}");
            }
        }
    }

    #[test]
    fn flat_and_tiny_images_give_finite_contrast() {
        for (rows, columns) in [(1, 1), (17, 400), (64, 64)] {
            let flat = contrast(&vec![77.0; rows * columns], rows, columns);
            assert!(flat.iter().all(|&z| z.abs() < f32::MIN_POSITIVE));
            // A flat image with rounding errors, as after rescaling.
            let rounded: Vec<f32> = (0..rows * columns)
                .map(|i| 77.0 + 1e-5 * (i % 3) as f32)
                .collect();
            let flat = contrast(&rounded, rows, columns);
            assert!(flat.iter().all(|&z| z.abs() < f32::MIN_POSITIVE));
            assert!(
                contrast(&noise(rows, columns), rows, columns)
                    .iter()
                    .all(|z| z.is_finite())
            );
        }
        // Half of the image saturated.
        let mut half = noise(100, 100);
        half[5000..].fill(255.0);
        assert!(contrast(&half, 100, 100).iter().all(|z| z.is_finite()));
    }
}
