//! Features of a window of sea, in groups, for a linear discriminant between kinds of sea.

use std::ops::Range;

use wake_physics::Field;

/// Lags of the correlations of texture and of mottle \[pixels\].
const TEXTURE: [usize; 4] = [3, 4, 6, 8];
const MOTTLE: [usize; 3] = [16, 24, 32];
/// Side of JPEG's blocks \[pixels\].
const BLOCK: usize = 8;
/// Side of the squares over which the mottle is averaged \[pixels\].
const SQUARE: usize = 4;

/// A group of features: its name and its indices in [`features`].
#[derive(Debug, Clone, PartialEq)]
pub struct FeatureGroup {
    /// Name in reports.
    pub name: &'static str,
    /// Indices of its features.
    pub places: Range<usize>,
}

/// The groups of features.
#[must_use]
pub fn feature_groups() -> Vec<FeatureGroup> {
    let sizes = [
        ("power near Nyquist and in the corner", 3),
        ("JPEG blocks and comb", 4),
        ("lags 3 to 8", 2 * TEXTURE.len()),
        ("histogram", 5),
        ("mottle, lags 16 to 32", 2 * MOTTLE.len() + 1),
    ];
    let mut first = 0;
    let group = |(name, count)| {
        let places = first..first + count;
        first += count;
        FeatureGroup { name, places }
    };
    sizes.into_iter().map(group).collect()
}

/// The features of a window of levels of 8 bits, in the order of [`feature_groups`].
///
/// No feature depends on a common factor of the levels, up to rounding; only the histogram's features depend on contrast.
///
/// - `window`: at least 64 rows and columns
#[must_use]
pub fn features(window: &Field) -> Vec<f64> {
    let all = [
        nyquist(window),
        compression(window),
        texture(window),
        histogram(window),
        mottle(window),
    ];
    all.concat()
}

/// An axis of a field.
#[derive(Clone, Copy)]
enum Axis {
    Rows,
    Columns,
}

/// Half the sum (`sign` = 1) or difference (−1) of neighbours.
fn neighbours(field: &Field, axis: Axis, sign: f32) -> Field {
    let (rows, columns, step) = match axis {
        Axis::Rows => (field.rows, field.columns - 1, 1),
        Axis::Columns => (field.rows - 1, field.columns, field.columns),
    };
    let value = |n: usize| {
        let at = n / columns * field.columns + n % columns;
        0.5 * (field.values[at] + sign * field.values[at + step])
    };
    Field {
        rows,
        columns,
        values: (0..rows * columns).map(value).collect(),
    }
}

/// Applies `high` differences and `low` sums along an axis: response (sin πf)^high (cos πf)^low.
fn filtered(field: &Field, axis: Axis, high: usize, low: usize) -> Field {
    let signs = std::iter::repeat_n(-1.0, high).chain(std::iter::repeat_n(1.0, low));
    signs.fold(field.clone(), |field, sign| neighbours(&field, axis, sign))
}

fn variance(field: &Field) -> f64 {
    let mean = field.mean();
    let squares = field.values.iter().map(|&v| (f64::from(v) - mean).powi(2));
    squares.sum::<f64>() / field.values.len().max(1) as f64
}

/// Logarithms of the power near Nyquist along rows, along columns and along both, over the power at a quarter of the sampling
/// frequency.
fn nyquist(window: &Field) -> Vec<f64> {
    use Axis::{Columns, Rows};
    let power = |[along, across]: [[usize; 2]; 2]| {
        let rows = filtered(window, Rows, along[0], along[1]);
        variance(&filtered(&rows, Columns, across[0], across[1]))
    };
    let (high, middle, low) = ([6, 0], [3, 3], [0, 6]);
    // (sin πf cos πf)³ is at most 2⁻³: 2⁻⁶ of the power.
    let [along, across] = [[middle, low], [low, middle]].map(|bands| 64.0 * power(bands));
    let ratio = |bands, over: f64| (power(bands).max(1e-9) / over.max(1e-9)).ln();
    vec![
        ratio([high, low], along),
        ratio([low, high], across),
        ratio([high, high], 0.5 * (along + across)),
    ]
}

/// Logarithm of the largest over the median step from pixel to pixel among the eight places in a block, along both axes;
/// roughness of the histogram; share of empty levels.
fn compression(window: &Field) -> Vec<f64> {
    let steps = |axis: Axis| {
        let field = neighbours(window, axis, -1.0);
        let mut sums = [0.0; BLOCK];
        for (n, value) in field.values.iter().enumerate() {
            let place = match axis {
                Axis::Rows => n % field.columns,
                Axis::Columns => n / field.columns,
            };
            sums[place % BLOCK] += f64::from(value.abs());
        }
        sums.sort_by(f64::total_cmp);
        let median = 0.5 * (sums[3] + sums[4]);
        (sums[BLOCK - 1] / median.max(1e-9)).ln()
    };
    let mut counts = [0.0f64; 256];
    for &value in &window.values {
        counts[value.round().clamp(0.0, 255.0) as usize] += 1.0;
    }
    // Levels between the 5th and the 95th percentile.
    let total = window.values.len() as f64;
    let mut sum = 0.0;
    let inside = |&level: &usize| {
        sum += counts[level];
        (0.05 * total..0.95 * total).contains(&sum)
    };
    let levels: Vec<usize> = (1..255).filter(inside).collect();
    let rough = |&n: &usize| {
        let beside = 0.5 * (counts[n - 1] + counts[n + 1]);
        ((counts[n] + 1.0) / (beside + 1.0)).ln().abs()
    };
    let count = levels.len().max(1) as f64;
    let roughness = levels.iter().map(rough).sum::<f64>() / count;
    let empty = levels.iter().filter(|&&n| counts[n] == 0.0).count();
    vec![
        steps(Axis::Rows),
        steps(Axis::Columns),
        // Over the scatter of Poisson counts of N pixels in L levels.
        (roughness / (1.5 * count / total).sqrt()).ln_1p(),
        empty as f64 / count,
    ]
}

/// The field less its mean over squares of 17 pixels, which removes the mottle.
fn detail(window: &Field) -> Field {
    const HALF: usize = 8;
    let along = |values: &[f32]| -> Vec<f32> {
        let mut sums = vec![0.0f64];
        for value in values {
            sums.push(sums[sums.len() - 1] + f64::from(*value));
        }
        let mean = |n: usize| {
            let (first, end) = (n.saturating_sub(HALF), (n + HALF + 1).min(values.len()));
            ((sums[end] - sums[first]) / (end - first) as f64) as f32
        };
        (0..values.len()).map(mean).collect()
    };
    let rows: Vec<f32> = window
        .values
        .chunks_exact(window.columns)
        .flat_map(along)
        .collect();
    let mut values = window.values.clone();
    for j in 0..window.columns {
        let column: Vec<f32> = rows
            .iter()
            .skip(j)
            .step_by(window.columns)
            .copied()
            .collect();
        for (i, mean) in along(&column).into_iter().enumerate() {
            values[i * window.columns + j] -= mean;
        }
    }
    Field { values, ..*window }
}

/// Covariance of pixels `lag` apart along an axis, over `variance`.
fn correlation(field: &Field, axis: Axis, lag: usize, variance: f64) -> f64 {
    let mean = field.mean();
    let at = |i: usize, j: usize| f64::from(field.values[i * field.columns + j]) - mean;
    let [down, right] = match axis {
        Axis::Rows => [0, lag],
        Axis::Columns => [lag, 0],
    };
    let (rows, columns) = (field.rows - down, field.columns - right);
    let sum: f64 = (0..rows * columns)
        .map(|n| at(n / columns, n % columns) * at(n / columns + down, n % columns + right))
        .sum();
    sum / (rows * columns) as f64 / variance.max(1e-9)
}

fn correlations(field: &Field, lags: &[usize], variance: f64) -> Vec<f64> {
    let along = |axis| {
        lags.iter()
            .map(move |&lag| correlation(field, axis, lag, variance))
    };
    along(Axis::Rows).chain(along(Axis::Columns)).collect()
}

fn texture(window: &Field) -> Vec<f64> {
    let detail = detail(window);
    let variance = variance(&detail);
    correlations(&detail, &TEXTURE, variance)
}

/// Spread over mean, skewness, excess kurtosis, and the 1st and 99th percentiles in standard deviations.
fn histogram(window: &Field) -> Vec<f64> {
    let (mean, deviation) = (window.mean(), variance(window).sqrt().max(1e-9));
    let moment = |power: i32| {
        let sum: f64 = window
            .values
            .iter()
            .map(|&v| ((f64::from(v) - mean) / deviation).powi(power))
            .sum();
        sum / window.values.len() as f64
    };
    let mut sorted = window.values.clone();
    sorted.sort_by(f32::total_cmp);
    let at = |share: f64| {
        let value = sorted[(share * (sorted.len() - 1) as f64) as usize];
        (f64::from(value) - mean) / deviation
    };
    vec![
        deviation / mean.max(1e-9),
        moment(3),
        moment(4) - 3.0,
        at(0.01),
        at(0.99),
    ]
}

/// Correlations of the means of squares, and their standard deviation over a pixel's.
fn mottle(window: &Field) -> Vec<f64> {
    let (rows, columns) = (window.rows / SQUARE, window.columns / SQUARE);
    let mean = |n: usize| {
        let (top, left) = (n / columns * SQUARE, n % columns * SQUARE);
        let row = |i: usize| window.values[(top + i) * window.columns + left..][..SQUARE].iter();
        (0..SQUARE).flat_map(row).sum::<f32>() / (SQUARE * SQUARE) as f32
    };
    let coarse = Field {
        rows,
        columns,
        values: (0..rows * columns).map(mean).collect(),
    };
    let own = variance(&coarse);
    let mut found = correlations(&coarse, &MOTTLE.map(|lag| lag / SQUARE), own);
    found.push((own / variance(window).max(1e-9)).sqrt());
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use wake_nn::noise::NoiseSource;

    const SIDE: usize = 128;

    /// White noise of mean 100 and spread 20.
    fn white(seed: u64) -> Field {
        let values = NoiseSource::new(seed).normal(0, SIDE * SIDE);
        Field {
            rows: SIDE,
            columns: SIDE,
            values: values.iter().map(|x| 100.0 + 20.0 * x).collect(),
        }
    }

    fn of(name: &str, window: &Field) -> Vec<f64> {
        let groups = feature_groups();
        let group = groups.iter().find(|group| group.name.starts_with(name));
        features(window)[group.expect("a group").places.clone()].to_vec()
    }

    /// The filters' gains over white noise are computed by quadrature of their responses.
    #[test]
    fn white_noise_has_the_power_of_the_filters() {
        let gain = |high: i32, low: i32| -> f64 {
            let response = |n: i32| {
                let f = std::f64::consts::PI * (f64::from(n) + 0.5) / 1000.0;
                (f.sin().powi(high) * f.cos().powi(low)).powi(2)
            };
            (0..1000).map(response).sum::<f64>() / 1000.0
        };
        let [high, middle, low] = [gain(6, 0), 64.0 * gain(3, 3), gain(0, 6)];
        let expected = [
            (high / middle).ln(),
            (high / middle).ln(),
            (high * high / (middle * low)).ln(),
        ];
        let found = of("power", &white(1));
        for (found, expected) in found.iter().zip(expected) {
            // A filter of six taps per axis keeps a quarter of the independent pixels along it: four errors of √(2/1000).
            assert!((found - expected).abs() < 0.2, "{found} {expected}");
        }
    }

    #[test]
    fn features_have_their_places_and_no_scale() {
        let groups = feature_groups();
        let window = white(2);
        let all = features(&window);
        assert_eq!(groups.last().map(|group| group.places.end), Some(all.len()));
        let brighter = Field {
            values: window.values.iter().map(|v| v + 50.0).collect(),
            ..window
        };
        let other = features(&brighter);
        for group in &groups[..3] {
            for n in group.places.clone() {
                assert!((all[n] - other[n]).abs() < 0.02, "{}", group.name);
            }
        }
    }

    /// Correlations of white noise are 0; correlations of noise smoothed over a few columns follow from the smoothing.
    #[test]
    fn lags_are_correlations_along_both_axes() {
        let white = white(3);
        // Means of 16,384 products: five errors of 1/128. Subtracting the local mean leaves −2/17² and less.
        assert!(of("lags", &white).iter().all(|r| r.abs() < 0.05));
        let smooth = filtered(&white, Axis::Rows, 0, 4);
        let found = of("lags", &smooth);
        // Binomial weights 1 4 6 4 1: (1 · 4 + 4 · 1) of 70 at lag 3, 1 of 70 at lag 4.
        assert!(
            (found[0] - 8.0 / 70.0).abs() < 0.06 && found[4].abs() < 0.06,
            "{found:?}"
        );
    }

    #[test]
    fn blocks_and_combs_are_found() {
        let mut blocks = white(4);
        for (n, value) in blocks.values.iter_mut().enumerate() {
            *value = value.round()
                + if (n % SIDE / 8).is_multiple_of(2) {
                    30.0
                } else {
                    0.0
                };
        }
        let [plain, blocky] = [white(4), blocks].map(|window| of("JPEG", &window));
        assert!(blocky[0] > plain[0] + 0.3, "{blocky:?} {plain:?}");
        let mut comb = white(4);
        for value in &mut comb.values {
            *value = 2.0 * (0.5 * *value).round();
        }
        let comb = of("JPEG", &comb);
        assert!(
            comb[2] > plain[2] + 0.5 && comb[3] > 0.3 && plain[3] < 0.05,
            "{comb:?}"
        );
    }
}
