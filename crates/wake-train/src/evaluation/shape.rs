//! Statistics that distinguish a sea from a Gaussian field of the same spectrum: skewness, steep fronts, groups.

use wake_physics::Field;
use wake_physics::measure::smooth;

/// Standard deviation of the Gaussian window of local energy \[pixels\]: chosen, some wavelengths of an image of 4 m
/// pixels.
const BELL: f64 = 8.0;

/// One pixel in so many counts as a crest of an expected image, and one as a trough: chosen.
const QUARTER: usize = 4;

/// Moments of a field beyond its spectrum.
///
/// For a Gaussian field all but [`grouping`](Self::grouping) are 0 up to chance; `grouping` depends on the spectrum alone, so
/// compare it with the value of a Gaussian field of the same spectrum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SeaShape {
    /// Skewness of the values \[1\].
    pub(super) skewness: f64,
    /// Excess kurtosis of the values, ⟨v⁴⟩/⟨v²⟩² − 3 \[1\].
    pub(super) kurtosis: f64,
    /// Skewness of the derivative along range, along azimuth, and along the wind \[1\]: above 0 where values rise more
    /// steeply than they fall.
    pub(super) derivative_skewness: [f64; 3],
    /// Standard deviation over mean of the local energy \[1\]: large where waves come in groups.
    pub(super) grouping: f64,
}

/// The shape of a field; `None` for less than 3 × 3 pixels, or a constant.
///
/// - `field`: grey, or grey less an expected image
/// - `wind_toward`: direction the wind blows to \[rad clockwise from azimuth\]
pub(super) fn sea_shape(field: &Field, wind_toward: f64) -> Option<SeaShape> {
    if field.rows < 3 || field.columns < 3 {
        return None;
    }
    let mean = field.mean();
    let deviations = Field {
        values: field
            .values
            .iter()
            .map(|&v| (f64::from(v) - mean) as f32)
            .collect(),
        ..*field
    };
    let variance = moment(&deviations.values, 2);
    if variance <= 0.0 {
        return None;
    }
    let (sin, cos) = wind_toward.sin_cos();
    let along = |[x, y]: [f64; 2]| skewness(&derivative(&deviations, [x, y]));
    let energy = Field {
        values: deviations.values.iter().map(|v| v * v).collect(),
        ..*field
    };
    let local = smooth(&energy, BELL);
    let level = local.mean();
    let spread = local
        .values
        .iter()
        .map(|&e| (f64::from(e) - level).powi(2))
        .sum::<f64>()
        / local.values.len() as f64;
    Some(SeaShape {
        skewness: skewness(&deviations.values),
        kurtosis: moment(&deviations.values, 4) / (variance * variance) - 3.0,
        derivative_skewness: [along([1.0, 0.0]), along([0.0, 1.0]), along([sin, cos])],
        grouping: spread.sqrt() / level,
    })
}

/// Variance of an image less its expected image on the crests of the latter, over that in its troughs \[1\].
///
/// It is `None` where the expected image is flat or nothing is left in the troughs.
///
/// A random sea that is merely added to a wake has 1. Crests and troughs are the highest and the lowest quarter of the
/// expected image's pixels.
///
/// - `image`, `expected`: of one size
pub(super) fn crest_variance(image: &Field, expected: &Field) -> Option<f64> {
    let mut order: Vec<usize> = (0..expected.values.len().min(image.values.len())).collect();
    order.sort_unstable_by(|&a, &b| expected.values[a].total_cmp(&expected.values[b]));
    let quarter = order.len() / QUARTER;
    let (low, high) = (order.first()?, order.last()?);
    if quarter < 2 || expected.values[*low] >= expected.values[*high] {
        return None;
    }
    let variance = |pixels: &[usize]| {
        let left = pixels
            .iter()
            .map(|&n| f64::from(image.values[n]) - f64::from(expected.values[n]));
        let mean = left.clone().sum::<f64>() / pixels.len() as f64;
        left.map(|v| (v - mean).powi(2)).sum::<f64>() / pixels.len() as f64
    };
    let [troughs, crests] = [&order[..quarter], &order[order.len() - quarter..]].map(variance);
    (troughs > 0.0).then(|| crests / troughs)
}

/// Central differences along a direction (range, azimuth), without the edges.
fn derivative(field: &Field, [x, y]: [f64; 2]) -> Vec<f32> {
    let mut out = Vec::with_capacity((field.rows - 2) * (field.columns - 2));
    for i in 1..field.rows - 1 {
        for j in 1..field.columns - 1 {
            let range = f64::from(field.at(i, j + 1)) - f64::from(field.at(i, j - 1));
            // Rows run against the azimuth.
            let azimuth = f64::from(field.at(i - 1, j)) - f64::from(field.at(i + 1, j));
            out.push((0.5 * (x * range + y * azimuth)) as f32);
        }
    }
    out
}

/// Mean of a power.
fn moment(values: &[f32], power: i32) -> f64 {
    let sum: f64 = values.iter().map(|&v| f64::from(v).powi(power)).sum();
    sum / values.len() as f64
}

/// Skewness of values of mean 0; 0 where there is no variance.
fn skewness(values: &[f32]) -> f64 {
    let variance = moment(values, 2);
    match variance > 0.0 {
        true => moment(values, 3) / variance.powf(1.5),
        false => 0.0,
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
mod tests {
    use super::*;
    use rand::rngs::StdRng;
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;
    use std::f64::consts::{PI, TAU};

    const SIDE: usize = 256;

    fn field(value: impl Fn(usize, usize) -> f64) -> Field {
        Field {
            rows: SIDE,
            columns: SIDE,
            values: (0..SIDE * SIDE)
                .map(|n| value(n / SIDE, n % SIDE) as f32)
                .collect(),
        }
    }

    fn white(seed: u64) -> Vec<f64> {
        let mut random = StdRng::seed_from_u64(seed);
        (0..SIDE * SIDE)
            .map(|_| random.sample(StandardNormal))
            .collect()
    }

    /// Independent normal numbers: skewness has the standard error √(6/n), kurtosis √(24/n); derivatives share pixels with
    /// their neighbours, which at most doubles the error of their skewness.
    #[test]
    fn white_noise_has_no_shape() {
        let noise = white(1);
        let shape = sea_shape(&field(|i, j| 5.0 + noise[i * SIDE + j]), 0.7).unwrap();
        let n = (SIDE * SIDE) as f64;
        assert!(shape.skewness.abs() < 5.0 * (6.0 / n).sqrt(), "{shape:?}");
        assert!(shape.kurtosis.abs() < 5.0 * (24.0 / n).sqrt(), "{shape:?}");
        for skewness in shape.derivative_skewness {
            assert!(skewness.abs() < 10.0 * (6.0 / n).sqrt(), "{shape:?}");
        }
        // The square of a normal number has the variance 2, which a Gaussian window of σ divides by 4πσ².
        let expected = (2.0 / (4.0 * PI * BELL * BELL)).sqrt();
        assert!((shape.grouping / expected - 1.0).abs() < 0.1, "{shape:?}");
    }

    /// exp(s g) of a normal g: skewness (e + 2)√(e − 1), e = exp s².
    #[test]
    fn skewness_and_kurtosis_are_those_of_a_lognormal() {
        let noise = white(2);
        let s = 0.3f64;
        let shape = sea_shape(&field(|i, j| (s * noise[i * SIDE + j]).exp()), 0.0).unwrap();
        let e = (s * s).exp();
        let skewness = (e + 2.0) * (e - 1.0).sqrt();
        let kurtosis = e.powi(4) + 2.0 * e.powi(3) + 3.0 * e * e - 6.0;
        // The eighth moment of the lognormal gives the kurtosis of 65,536 numbers an error of 5 %.
        assert!((shape.skewness / skewness - 1.0).abs() < 0.05, "{shape:?}");
        assert!((shape.kurtosis / kurtosis - 1.0).abs() < 0.2, "{shape:?}");
    }

    /// A wave that rises in a quarter and falls in three quarters of its length along the wind.
    #[test]
    fn steep_fronts_are_found_where_they_are() {
        let saw = |phase: f64| {
            let at = phase.rem_euclid(1.0);
            if at < 0.25 {
                4.0 * at
            } else {
                (1.0 - at) / 0.75
            }
        };
        let range = sea_shape(&field(|_, j| saw(j as f64 / 64.0)), PI / 2.0).unwrap();
        // Slopes 4 on a quarter and −4/3 on the rest: ⟨d³⟩/⟨d²⟩^{3/2} = (2/√3), less at the 4 of 64 pixels of the bends.
        let expected = 2.0 / 3f64.sqrt();
        assert!(
            (range.derivative_skewness[0] / expected - 1.0).abs() < 0.08,
            "{range:?}"
        );
        assert!(
            (range.derivative_skewness[2] - range.derivative_skewness[0]).abs() < 1e-6,
            "{range:?}"
        );
        assert!(range.derivative_skewness[1].abs() < 1e-9, "{range:?}");
        let azimuth = sea_shape(&field(|i, _| saw(-(i as f64) / 64.0)), PI).unwrap();
        assert!(
            (azimuth.derivative_skewness[1] / expected - 1.0).abs() < 0.08,
            "{azimuth:?}"
        );
        assert!(
            (azimuth.derivative_skewness[2] + azimuth.derivative_skewness[1]).abs() < 1e-6,
            "{azimuth:?}"
        );
    }

    /// With a noise energy of 1 + m cos the local energy has the deviation m/√2.
    #[test]
    fn groups_are_counted() {
        let noise = white(3);
        let energy = |j: usize| 1.0 + 0.8 * (TAU * j as f64 / SIDE as f64).cos();
        let shape = sea_shape(&field(|i, j| energy(j).sqrt() * noise[i * SIDE + j]), 0.0).unwrap();
        let own = (2.0 / (4.0 * PI * BELL * BELL)).sqrt();
        let expected = (0.8f64 / 2f64.sqrt()).hypot(own);
        assert!((shape.grouping / expected - 1.0).abs() < 0.05, "{shape:?}");
    }

    /// Noise twice as strong on crests as in troughs.
    #[test]
    fn the_sea_on_crests_is_told_from_that_in_troughs() {
        let noise = white(4);
        let crest = |j: usize| (TAU * j as f64 / 32.0).cos();
        let expected = field(|_, j| crest(j));
        let added = field(|i, j| crest(j) + 0.1 * noise[i * SIDE + j]);
        // 16,384 pixels each: four standard errors of a ratio of variances.
        let error = 4.0 * (4.0 / 16_384f64).sqrt();
        assert!((crest_variance(&added, &expected).unwrap() - 1.0).abs() < error);
        let stronger = |j: usize| if crest(j) > 0.0 { 0.2 } else { 0.1 };
        let ridden = field(|i, j| crest(j) + stronger(j) * noise[i * SIDE + j]);
        assert!((crest_variance(&ridden, &expected).unwrap() / 4.0 - 1.0).abs() < error);
        assert_eq!(crest_variance(&added, &field(|_, _| 1.0)), None);
    }

    #[test]
    fn a_constant_has_no_shape() {
        assert_eq!(sea_shape(&field(|_, _| 2.0), 0.0), None);
        let tiny = Field {
            rows: 2,
            columns: 2,
            values: vec![1.0, 2.0, 3.0, 4.0],
        };
        assert_eq!(sea_shape(&tiny, 0.0), None);
    }
}
