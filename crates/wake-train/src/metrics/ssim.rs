//! Structural similarity.

use super::plane::Plane;

/// The weights of the neighbourhood in which two images are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SsimWindow {
    /// A Gaussian of standard deviation 1.5 pixels, cut at 5 pixels, variances of the population: the window of the
    /// paper that defines SSIM.
    Gaussian,
    /// 7 × 7 equal weights, variances of a sample: scikit-image's default.
    Uniform,
}

impl SsimWindow {
    /// Weights along one axis, sum 1.
    fn weights(self) -> Vec<f64> {
        match self {
            Self::Gaussian => gaussian(1.5, 5),
            Self::Uniform => vec![1.0 / 7.0; 7],
        }
    }

    /// Factor from the population variance to the variance used.
    fn variance_factor(self) -> f64 {
        match self {
            Self::Gaussian => 1.0,
            Self::Uniform => 49.0 / 48.0,
        }
    }
}

/// Stabilises the ratio of means, relative to the range.
const K1: f64 = 0.01;
/// Stabilises the ratio of variances, relative to the range.
const K2: f64 = 0.03;

/// Mean structural similarity, over the pixels whose whole neighbourhood lies in the image.
///
/// ```text
/// SSIM = (2 μa μb + C₁)(2 σab + C₂)/((μa² + μb² + C₁)(σa² + σb² + C₂)),   C₁ = (0.01 range)², C₂ = (0.03 range)²
/// ```
///
/// - `range`: largest less smallest value that a pixel can have
/// - returns −1 to 1, 1 for equal planes; NaN for planes smaller than the window
///
/// # Panics
///
/// If the sizes differ.
///
/// # References
///
/// Wang, Bovik, Sheikh and Simoncelli (2004), IEEE Trans. Image Process. 13(4), equation 13.
#[must_use]
pub fn ssim(one: &Plane<'_>, other: &Plane<'_>, range: f64, window: SsimWindow) -> f64 {
    let map = ssim_map(one, other, range, window);
    let radius = window.weights().len() / 2;
    let (rows, columns) = (one.rows(), one.columns);
    let (mut sum, mut count) = (0.0, 0usize);
    for i in radius..rows.saturating_sub(radius) {
        for j in radius..columns.saturating_sub(radius) {
            sum += map[i * columns + j];
            count += 1;
        }
    }
    sum / count as f64
}

/// Structural similarity at each pixel; beyond the border the image is mirrored.
///
/// # Panics
///
/// If the sizes differ.
#[must_use]
pub fn ssim_map(one: &Plane<'_>, other: &Plane<'_>, range: f64, window: SsimWindow) -> Vec<f64> {
    one.assert_same_size(other);
    let weights = window.weights();
    let filtered = |value: &dyn Fn(f64, f64) -> f64| {
        let pairs = one.values.iter().zip(other.values);
        let values = pairs.map(|(&a, &b)| value(f64::from(a), f64::from(b)));
        filter(values.collect(), one.columns, &weights)
    };
    let (mean_a, mean_b) = (filtered(&|a, _| a), filtered(&|_, b| b));
    let squares = [filtered(&|a, _| a * a), filtered(&|_, b| b * b)];
    let product = filtered(&|a, b| a * b);
    let factor = window.variance_factor();
    let (c1, c2) = ((K1 * range).powi(2), (K2 * range).powi(2));
    (0..product.len())
        .map(|n| {
            let (a, b) = (mean_a[n], mean_b[n]);
            let [var_a, var_b] = [squares[0][n] - a * a, squares[1][n] - b * b].map(|v| factor * v);
            let covariance = factor * (product[n] - a * b);
            (2.0 * a * b + c1) * (2.0 * covariance + c2)
                / ((a * a + b * b + c1) * (var_a + var_b + c2))
        })
        .collect()
}

/// The plane smoothed with a Gaussian of standard deviation `std` \[pixels\], mirrored at its border.
#[must_use]
pub fn blurred(plane: &Plane<'_>, std: f64) -> Vec<f32> {
    let values = plane.values.iter().map(|&v| f64::from(v)).collect();
    let weights = gaussian(std, (4.0 * std).ceil() as usize);
    let smooth = filter(values, plane.columns, &weights);
    smooth.into_iter().map(|v| v as f32).collect()
}

fn gaussian(std: f64, radius: usize) -> Vec<f64> {
    let bell = |d: f64| (-0.5 * (d / std).powi(2)).exp();
    let weights: Vec<f64> = (0..=2 * radius)
        .map(|n| bell(n as f64 - radius as f64))
        .collect();
    let sum: f64 = weights.iter().sum();
    weights.into_iter().map(|w| w / sum).collect()
}

/// Filters along rows and columns.
fn filter(values: Vec<f64>, columns: usize, weights: &[f64]) -> Vec<f64> {
    let rows = values.len() / columns;
    let across = filter_rows(&values, columns, weights);
    let turned = transposed(&across, columns);
    transposed(&filter_rows(&turned, rows, weights), rows)
}

fn filter_rows(values: &[f64], columns: usize, weights: &[f64]) -> Vec<f64> {
    let radius = weights.len() / 2;
    let mut out = Vec::with_capacity(values.len());
    let mut padded = Vec::with_capacity(columns + 2 * radius);
    for row in values.chunks_exact(columns) {
        padded.clear();
        let ends = -(radius as i64)..(columns + radius) as i64;
        padded.extend(ends.map(|at| row[mirrored(at, columns)]));
        out.extend(padded.windows(weights.len()).map(|near| {
            let terms = near.iter().zip(weights);
            terms.map(|(v, w)| v * w).sum::<f64>()
        }));
    }
    out
}

/// Place in a row of `count` whose border is a mirror: −1 is 0, `count` is `count − 1`.
fn mirrored(at: i64, count: usize) -> usize {
    let period = 2 * count as i64;
    let at = at.rem_euclid(period);
    at.min(period - 1 - at) as usize
}

fn transposed(values: &[f64], columns: usize) -> Vec<f64> {
    let rows = values.len() / columns;
    let places = (0..columns).flat_map(|j| (0..rows).map(move |i| i * columns + j));
    places.map(|n| values[n]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pattern(seed: u32, count: usize) -> Vec<f32> {
        let mut state = seed;
        (0..count)
            .map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (state >> 8) as f32 / (1 << 24) as f32
            })
            .collect()
    }

    /// The definition with double sums at one pixel, against the separable filter.
    #[test]
    fn one_pixel_by_the_definition() {
        let (a, b) = (pattern(1, 15 * 20), pattern(2, 15 * 20));
        let planes = [&a, &b].map(|v| Plane::new(v, 20));
        let map = ssim_map(&planes[0], &planes[1], 1.0, SsimWindow::Gaussian);
        let (row, column) = (7usize, 9usize);
        let mut sums = [0.0f64; 6];
        for di in -5i32..=5 {
            for dj in -5i32..=5 {
                let weight = f64::from(-(di * di + dj * dj)) / (2.0 * 1.5 * 1.5);
                let n = (row as i32 + di) as usize * 20 + (column as i32 + dj) as usize;
                let (x, y) = (f64::from(a[n]), f64::from(b[n]));
                let terms = [1.0, x, y, x * x, y * y, x * y];
                for (sum, term) in sums.iter_mut().zip(terms) {
                    *sum += weight.exp() * term;
                }
            }
        }
        let [w, x, y, xx, yy, xy] = sums;
        let (x, y, xx, yy, xy) = (x / w, y / w, xx / w, yy / w, xy / w);
        let expected = (2.0 * x * y + 1e-4) * (2.0 * (xy - x * y) + 9e-4)
            / ((x * x + y * y + 1e-4) * (xx - x * x + yy - y * y + 9e-4));
        assert!((map[row * 20 + column] - expected).abs() < 1e-12);
    }

    #[test]
    fn equal_is_one_and_order_does_not_matter() {
        let (a, b) = (pattern(3, 400), pattern(4, 400));
        let planes = [&a, &b].map(|v| Plane::new(v, 20));
        for window in [SsimWindow::Gaussian, SsimWindow::Uniform] {
            let [ab, ba, aa] = [(0, 1), (1, 0), (0, 0)]
                .map(|(i, j): (usize, usize)| ssim(&planes[i], &planes[j], 1.0, window));
            assert!((ab - ba).abs() < 1e-14 && ab < 0.5);
            assert!((aa - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn the_border_is_a_mirror() {
        let places: Vec<usize> = (-4..8).map(|at| mirrored(at, 3)).collect();
        assert_eq!(places, [2, 2, 1, 0, 0, 1, 2, 2, 1, 0, 0, 1]);
    }

    /// A Gaussian keeps a constant, and multiplies a wave with exp(−k²σ²/2).
    #[test]
    fn blur_has_the_gaussian_response() {
        let k = std::f64::consts::TAU / 16.0;
        let wave: Vec<f32> = (0..64 * 64)
            .map(|n| (k * (f64::from(n % 64) + 0.5)).cos() as f32)
            .collect();
        let smooth = blurred(&Plane::new(&wave, 64), 2.0);
        let expected = (-0.5 * (k * 2.0).powi(2)).exp();
        for n in 0..64 * 64 {
            // Mirrored at the border, a cosine of whole periods continues itself. Cut at 4 σ: 6e-5.
            assert!((f64::from(smooth[n]) - expected * f64::from(wave[n])).abs() < 2e-4);
        }
    }
}
