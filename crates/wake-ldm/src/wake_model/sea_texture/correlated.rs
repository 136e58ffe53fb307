//! Correlation of a field's pixels, and Gaussian fields with a given correlation.

use num_complex::Complex32;
use wake_physics::Field;
use wake_physics::waves::{fast_length, lattice_sum};

/// Correlation of two pixels by their distance, up to a number of rows and columns apart.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Correlation {
    lags: usize,
    /// `[lags + 1, 2 lags + 1]`: 0 to `lags` rows down, −`lags` to `lags` columns to the right.
    values: Vec<f32>,
}

impl Correlation {
    /// Estimates the correlation of a field's pixels, as the mean over all pairs at each distance; `None` for a
    /// constant field, or one no larger than the lags.
    pub(super) fn of(field: &Field, lags: usize) -> Option<Self> {
        if field.rows <= lags || field.columns <= lags {
            return None;
        }
        let mean = field.mean() as f32;
        let variance = field.values.iter().map(|&v| f64::from(v - mean).powi(2));
        let variance = variance.sum::<f64>() / field.values.len() as f64;
        if variance.is_nan() || variance <= 0.0 {
            return None;
        }
        // With this many zeros around the field, no pixel is paired with another across the edge.
        let [rows, columns] = [field.rows, field.columns].map(|n| fast_length(n + lags));
        let mut waves = vec![Complex32::default(); rows * columns];
        for (i, line) in field.values.chunks_exact(field.columns).enumerate() {
            for (j, &value) in line.iter().enumerate() {
                waves[j * rows + i].re = value - mean;
            }
        }
        let [re, im] = lattice_sum(&mut waves, [rows, columns], [rows, columns]);
        let power = re.iter().zip(&im).map(|(re, im)| re * re + im * im);
        let power: Vec<f32> = power.collect();
        let sum = transposed_sum(&power, [rows, columns]);
        let scale = 1.0 / (variance * (rows * columns) as f64);
        let value = |down: usize, right: isize| {
            let column = right.rem_euclid(columns as isize) as usize;
            let pairs = (field.rows - down) * (field.columns - right.unsigned_abs());
            let product = f64::from(sum[down * columns + column]) * scale / pairs as f64;
            product.clamp(-1.0, 1.0) as f32
        };
        Some(Self {
            lags,
            values: places(lags)
                .map(|(down, right)| value(down, right))
                .collect(),
        })
    }

    /// Makes a correlation from values `[lags + 1, 2 lags + 1]`: 0 to `lags` rows down, −`lags` to `lags` columns to the
    /// right; `None` for another number of values, for a value outside −1 to 1, or if a pixel's own correlation is not 1.
    pub(super) fn new(lags: usize, values: Vec<f32>) -> Option<Self> {
        let sound = values.len() == (lags + 1) * (2 * lags + 1)
            && values.iter().all(|v| (-1.0..=1.0).contains(v))
            && (values[lags] - 1.0).abs() < 1e-3;
        sound.then_some(Self { lags, values })
    }

    /// All values, in the order of [`Self::new`].
    pub(super) fn values(&self) -> &[f32] {
        &self.values
    }

    /// Correlation of pixels a number of rows and columns apart; 0 beyond the lags.
    pub(super) fn at(&self, down: isize, right: isize) -> f32 {
        // The correlation is the same in opposite directions.
        let [down, right] = if down < 0 {
            [-down, -right]
        } else {
            [down, right]
        };
        let lags = self.lags as isize;
        if down > lags || right.abs() > lags {
            return 0.0;
        }
        self.values[(down * (2 * lags + 1) + right + lags) as usize]
    }
}

/// Distances in the order in which a correlation keeps them.
fn places(lags: usize) -> impl Iterator<Item = (usize, isize)> {
    let right = -(lags as isize)..=lags as isize;
    (0..=lags).flat_map(move |down| right.clone().map(move |right| (down, right)))
}

/// Parzen window, 1 at distance 0 and 0 from `lags` on; its transform is nowhere negative.
fn parzen(distance: isize, lags: usize) -> f64 {
    let u = distance.unsigned_abs() as f64 / lags.max(1) as f64;
    match u {
        _ if distance == 0 => 1.0,
        u if u <= 0.5 => 1.0 - 6.0 * u * u * (1.0 - u),
        u if u < 1.0 => 2.0 * (1.0 - u).powi(3),
        _ => 0.0,
    }
}

/// Real part of the sum of waves with amplitudes `[rows, columns]`.
fn transposed_sum(amplitudes: &[f32], [rows, columns]: [usize; 2]) -> Vec<f32> {
    let mut waves = vec![Complex32::default(); rows * columns];
    for (i, line) in amplitudes.chunks_exact(columns).enumerate() {
        for (j, &value) in line.iter().enumerate() {
            waves[j * rows + i].re = value;
        }
    }
    let [re, _] = lattice_sum(&mut waves, [rows, columns], [rows, columns]);
    re
}

/// Correlated Gaussian noise of variance 1, from the spectrum of a correlation on a torus larger than the image.
///
/// ```text
/// P(k) = max(0, Σ w(d) ρ(d) cos k·d),     n(x) = Re Σ √(P(k)/Σ P) (a + i b) exp(i k·x),   a, b normal
/// ```
///
/// where w is Parzen's window of the lags along both axes. If P is nowhere negative, the noise has the correlation w ρ: with
/// 32 lags, 0.994 ρ between neighbours, half of ρ 11 pixels apart, and none beyond the lags.
///
/// # References
///
/// Blackman & Tukey (1958), "The Measurement of Power Spectra"; Parzen (1961), "Mathematical Considerations in the
/// Estimation of Spectra" (the window); Dietrich & Newsam (1997), "Fast and Exact Simulation of Stationary Gaussian
/// Processes through Circulant Embedding of the Covariance Matrix".
#[derive(Debug, Clone)]
pub(super) struct CorrelatedNoise {
    size: [usize; 2],
    /// Rows and columns of a period in pixels.
    period: [usize; 2],
    /// √(P/ΣP) of each wave, `[columns, rows]` of the period.
    amplitudes: Vec<f32>,
}

impl CorrelatedNoise {
    /// Noise for images of `rows` and `columns`, at least 1 each; opposite edges are independent.
    pub(super) fn new(correlation: &Correlation, rows: usize, columns: usize) -> Self {
        let lags = correlation.lags;
        let [high, wide] = [rows, columns].map(|n| fast_length((n + lags).max(2 * lags + 1)));
        let mut windowed = vec![0.0; high * wide];
        let reach = lags as isize;
        for down in -reach..=reach {
            for right in -reach..=reach {
                let [i, j] = [
                    down.rem_euclid(high as isize) as usize,
                    right.rem_euclid(wide as isize) as usize,
                ];
                let window = parzen(down, lags) * parzen(right, lags);
                windowed[i * wide + j] = correlation.at(down, right) * window as f32;
            }
        }
        let power = transposed_sum(&windowed, [high, wide]);
        // The mean of P is the variance, so some of P is above 0.
        let total: f64 = power.iter().map(|&p| f64::from(p.max(0.0))).sum();
        let mut amplitudes = vec![0.0; high * wide];
        for (n, &p) in power.iter().enumerate() {
            let share = f64::from(p.max(0.0)) / total;
            amplitudes[(n % wide) * high + n / wide] = share.sqrt() as f32;
        }
        Self {
            size: [rows, columns],
            period: [high, wide],
            amplitudes,
        }
    }

    /// Number of independent standard normal numbers that [`field`](Self::field) needs.
    pub(super) fn normals(&self) -> usize {
        2 * self.amplitudes.len()
    }

    /// Makes one field of noise.
    ///
    /// # Panics
    ///
    /// If there are fewer numbers than [`normals`](Self::normals).
    pub(super) fn field(&self, normals: &[f32]) -> Field {
        let pairs = normals[..self.normals()].as_chunks::<2>().0;
        let waves = self.amplitudes.iter().zip(pairs);
        let waves = waves.map(|(&a, &[re, im])| Complex32::new(a * re, a * im));
        let [rows, columns] = self.size;
        let [values, _] = lattice_sum(&mut waves.collect::<Vec<_>>(), self.period, self.size);
        Field {
            rows,
            columns,
            values,
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;
    use rand::rngs::StdRng;
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;

    fn normals(count: usize, seed: u64) -> Vec<f32> {
        let mut random = StdRng::seed_from_u64(seed);
        (0..count).map(|_| random.sample(StandardNormal)).collect()
    }

    fn field(rows: usize, columns: usize, value: impl Fn(usize, usize) -> f32) -> Field {
        let values = (0..rows * columns).map(|n| value(n / columns, n % columns));
        Field {
            rows,
            columns,
            values: values.collect(),
        }
    }

    /// Values of Parzen (1961), by hand.
    #[test]
    fn parzens_window_has_its_published_values() {
        for (distance, expected) in [
            (0, 1.0),
            (2, 0.71875),
            (-2, 0.71875),
            (4, 0.25),
            (6, 0.03125),
            (8, 0.0),
            (11, 0.0),
        ] {
            assert!((parzen(distance, 8) - expected).abs() < 1e-15, "{distance}");
        }
        assert_eq!(
            [0, 1].map(|distance| parzen(distance, 0).to_bits()),
            [1.0, 0.0].map(f64::to_bits)
        );
    }

    /// Comparison with direct sums; the transforms of 30 × 37 values in f32 round to a few 1e-6.
    #[test]
    fn the_correlation_is_the_mean_product_of_all_pairs() {
        let white = normals(23 * 31, 4);
        let rough = field(23, 31, |i, j| {
            5.0 + white[i * 31 + j] + white[i * 31 + j.saturating_sub(1)]
        });
        let found = Correlation::of(&rough, 6).unwrap();
        let mean = rough.mean();
        let off = |i: usize, j: usize| f64::from(rough.at(i, j)) - mean;
        let product = |down: usize, right: isize| {
            let (mut sum, mut pairs) = (0.0, 0.0);
            for i in 0..23 - down {
                for j in 0..31 {
                    let other = j as isize + right;
                    if (0..31).contains(&other) {
                        sum += off(i, j) * off(i + down, other as usize);
                        pairs += 1.0;
                    }
                }
            }
            sum / pairs
        };
        for (down, right) in places(6) {
            let expected = (product(down, right) / product(0, 0)).clamp(-1.0, 1.0);
            let [there, back] = [1, -1].map(|s| found.at(s * down as isize, s * right));
            let error = (f64::from(there) - expected).abs();
            assert!(error < 2e-5, "{down} {right}: {there} {expected}");
            assert!((there - back).abs() < f32::EPSILON);
        }
        assert!(found.at(7, 0) == 0.0 && found.at(0, -7) == 0.0);
    }

    #[test]
    fn what_is_no_correlation_is_none() {
        let flat = field(9, 9, |_, _| 2.0);
        assert_eq!(Correlation::of(&flat, 2), None);
        let small = field(3, 9, |i, j| (i * j) as f32);
        assert_eq!(Correlation::of(&small, 3), None);
        let good = Correlation::of(&small, 2).unwrap();
        let values = good.values().to_vec();
        assert_eq!(Correlation::new(2, values.clone()), Some(good));
        for (at, wrong) in [(0, 1.5), (0, f32::NAN), (2, 0.5)] {
            let mut values = values.clone();
            values[at] = wrong;
            assert_eq!(Correlation::new(2, values), None, "{at} {wrong}");
        }
        assert_eq!(Correlation::new(1, values), None);
    }

    /// A correlation with a direction, exp(−(d/5)²) along the diagonal and exp(−d²) across: the mean over many fields agrees
    /// within five standard errors and the loss of the window, at most 1 − w.
    #[test]
    fn noise_has_the_correlation_that_was_asked_for() {
        let lags = 16;
        let asked = |down: isize, right: isize| {
            let [a, b] = [down + right, down - right].map(|d| d as f64 / f64::sqrt(2.0));
            (-(a / 5.0).powi(2) - b * b).exp()
        };
        let values = places(lags).map(|(down, right)| asked(down as isize, right) as f32);
        let correlation = Correlation::new(lags, values.collect()).unwrap();
        let noise = CorrelatedNoise::new(&correlation, 90, 120);
        let fields = 24;
        let drawn: Vec<Field> = (0..fields)
            .map(|seed| noise.field(&normals(noise.normals(), seed)))
            .collect();
        let mean = |down: usize, right: isize| {
            let (mut sum, mut pairs) = (0.0, 0.0);
            for field in &drawn {
                for i in 0..90 - down {
                    for j in 0..120isize {
                        if (0..120).contains(&(j + right)) {
                            let other = field.at(i + down, (j + right) as usize);
                            sum += f64::from(field.at(i, j as usize) * other);
                            pairs += 1.0;
                        }
                    }
                }
            }
            sum / pairs
        };
        // Sum of ρ² over all distances, the number of pixels that share the random error of a product: π · 5/√2 · 1/√2.
        let shared = std::f64::consts::PI * 2.5;
        let error = 5.0 * (2.0 * shared / (fields * 90 * 120) as f64).sqrt();
        for (down, right) in [(0, 0), (1, 1), (1, -1), (0, 3), (3, 0), (4, 4), (3, -3)] {
            let expected = asked(down as isize, right);
            let loss = 1.0 - parzen(down as isize, lags) * parzen(right, lags);
            let off = (mean(down, right) - expected).abs();
            assert!(
                off < error + loss * expected,
                "{down} {right}: {off} {error}"
            );
        }
    }

    /// White noise stays white, even in an image smaller than the lags.
    #[test]
    fn lags_may_be_longer_than_the_image() {
        let mut values = vec![0.0; 9 * 17];
        values[8] = 1.0;
        let white = Correlation::new(8, values).unwrap();
        let noise = CorrelatedNoise::new(&white, 3, 5);
        let (mut squares, mut products) = (0.0, 0.0);
        let fields = 2000;
        for seed in 0..fields {
            let field = noise.field(&normals(noise.normals(), seed));
            assert_eq!([field.rows, field.columns], [3, 5]);
            squares += f64::from(field.values[7]).powi(2);
            products += f64::from(field.values[7] * field.values[8]);
        }
        // Five standard errors of a square, √2/√n, and of a product, 1/√n.
        let error = 5.0 / (fields as f64).sqrt();
        assert!((squares / fields as f64 - 1.0).abs() < 1.5 * error);
        assert!((products / fields as f64).abs() < error);
    }
}
