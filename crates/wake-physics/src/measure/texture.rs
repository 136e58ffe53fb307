//! Texture of open sea: speckle, its correlation, and the mottle beneath.

use super::smooth::smooth;
use crate::raster::Field;
use serde::Serialize;

/// Standard deviation of the Gaussian that separates speckle from the image beneath \[pixels\] (chosen).
const BELL: f64 = 8.0;

/// Standard deviations over the mean from which a pixel is taken for a ship and its window is dropped (chosen).
const SHIP: f64 = 8.0;

/// Sides of the blocks whose means are compared \[pixels\].
const BLOCKS: [usize; 2] = [8, 32];

/// Largest number of looks that can be distinguished: with 1,000 looks the amplitude varies by 1.6 %.
const MOST_LOOKS: f64 = 1e3;

/// Texture of an amplitude image: medians over its windows of open sea.
///
/// Speckle is the deviation from a smoothed image. Correlations and skewness do not depend on the grey scale of an image that is
/// linear in amplitude; looks and variations do, unless black is amplitude 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Texture {
    /// Number of windows.
    pub windows: usize,
    /// Equivalent number of looks: the amplitude of so many, the root of a Gamma distribution, varies as the speckle does; up to
    /// 1,000.
    pub looks: f64,
    /// Correlation of speckle 1 to 4 pixels apart along a row.
    pub along_rows: [f64; 4],
    /// Correlation of speckle 1 to 4 pixels apart along a column.
    pub along_columns: [f64; 4],
    /// Skewness of speckle; 0.63 for one look, falling with more.
    pub skewness: f64,
    /// Standard deviation over mean of the means of blocks of 8 and of 32 pixels.
    pub block_variation: [f64; 2],
}

/// Texture over the windows of `side` pixels that hold no ship; `None` if there is no such window.
///
/// - `amplitude`: √ of the intensity, or the grey of a quick-look
#[must_use]
pub fn texture(amplitude: &Field, side: usize) -> Option<Texture> {
    let beneath = smooth(amplitude, BELL);
    let mut found = Vec::new();
    for top in (0..(amplitude.rows + 1).saturating_sub(side)).step_by(side.max(1)) {
        for left in (0..(amplitude.columns + 1).saturating_sub(side)).step_by(side.max(1)) {
            let cut = |field: &Field| -> Vec<f64> {
                let rows =
                    (top..top + side).map(|i| &field.values[i * field.columns + left..][..side]);
                rows.flatten().map(|&v| f64::from(v)).collect()
            };
            found.extend(of_window(&cut(amplitude), &cut(&beneath), side));
        }
    }
    let median = |of: &dyn Fn(&Texture) -> f64| {
        let mut values: Vec<f64> = found.iter().map(of).collect();
        values.sort_by(f64::total_cmp);
        let n = values.len();
        0.5 * (values[(n - 1) / 2] + values[n / 2])
    };
    (!found.is_empty()).then(|| Texture {
        windows: found.len(),
        looks: median(&|t| t.looks),
        along_rows: std::array::from_fn(|n| median(&|t| t.along_rows[n])),
        along_columns: std::array::from_fn(|n| median(&|t| t.along_columns[n])),
        skewness: median(&|t| t.skewness),
        block_variation: std::array::from_fn(|n| median(&|t| t.block_variation[n])),
    })
}

fn of_window(amplitude: &[f64], beneath: &[f64], side: usize) -> Option<Texture> {
    let count = amplitude.len() as f64;
    let mean = amplitude.iter().sum::<f64>() / count;
    let speckle: Vec<f64> = amplitude.iter().zip(beneath).map(|(a, b)| a - b).collect();
    let moment = |power: i32| speckle.iter().map(|s| s.powi(power)).sum::<f64>() / count;
    let variance = moment(2);
    let largest = amplitude.iter().copied().fold(0.0, f64::max);
    if !(mean > 0.0 && variance > 0.0) || largest > mean + SHIP * variance.sqrt() {
        return None;
    }
    let correlation = |down: usize, right: usize| {
        let mut sum = 0.0;
        for i in 0..side.saturating_sub(down) {
            for j in 0..side.saturating_sub(right) {
                sum += speckle[i * side + j] * speckle[(i + down) * side + j + right];
            }
        }
        let pairs = side.saturating_sub(down) * side.saturating_sub(right);
        sum / (pairs as f64 * variance)
    };
    Some(Texture {
        windows: 1,
        looks: equivalent_looks(variance / (mean * mean)),
        along_rows: std::array::from_fn(|n| correlation(0, n + 1)),
        along_columns: std::array::from_fn(|n| correlation(n + 1, 0)),
        skewness: moment(3) / variance.powf(1.5),
        block_variation: BLOCKS.map(|block| block_variation(amplitude, side, block, mean)),
    })
}

/// Number of looks N at which the amplitude's variance over its squared mean, N Γ(N)²/Γ(N + ½)² − 1, has a given value; by
/// bisection, as it falls with N.
fn equivalent_looks(variation: f64) -> f64 {
    let of = |looks: f64| {
        let ratio = libm::lgamma(looks) - libm::lgamma(looks + 0.5);
        (looks.ln() + 2.0 * ratio).exp_m1()
    };
    let [mut low, mut high] = [1e-3f64, MOST_LOOKS];
    for _ in 0..50 {
        let middle = (low * high).sqrt();
        if of(middle) > variation {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

/// Correlation of the amplitudes of two pixels of N looks whose intensities have the correlation ρ².
///
/// ```text
/// (₂F₁(−½, −½; N; ρ²) − 1)/(₂F₁(−½, −½; N; 1) − 1)
/// ```
///
/// - `looks`: N, at least 1
/// - `intensities`: ρ², 0 to 1
/// - returns ρ² for many looks, up to 0.03 less for one
///
/// # References
///
/// The product moment of a bivariate Gamma distribution of common shape N (Kibble, 1941).
#[must_use]
pub fn amplitude_correlation(looks: f64, intensities: f64) -> f64 {
    let excess = |x: f64| {
        let (mut term, mut sum) = (1.0, 0.0);
        // Terms fall at least as n⁻³.
        for n in 0..3000 {
            let n = f64::from(n);
            term *= (n - 0.5).powi(2) / ((looks + n) * (n + 1.0)) * x;
            sum += term;
        }
        sum
    };
    excess(intensities) / excess(1.0)
}

/// Standard deviation over mean of the means of square blocks.
fn block_variation(amplitude: &[f64], side: usize, block: usize, mean: f64) -> f64 {
    let count = side / block;
    if count == 0 {
        return 0.0;
    }
    let area = (block * block) as f64;
    let mean_of = |i: usize, j: usize| -> f64 {
        let rows = (0..block).map(|di| &amplitude[(i * block + di) * side + j * block..][..block]);
        rows.flatten().sum::<f64>() / area
    };
    let blocks = (0..count).flat_map(|i| (0..count).map(move |j| (i, j)));
    let square: f64 = blocks
        .map(|(i, j)| (mean_of(i, j) / mean - 1.0).powi(2))
        .sum();
    (square / (count * count) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::Raster;
    use crate::sar::speckle::speckle;

    fn amplitude(looks: u32) -> Field {
        let mut field = Field::constant(&Raster::image(512, 520, 1.0), 2.0);
        speckle(&mut field, looks, 3);
        field.values.iter_mut().for_each(|v| *v = v.sqrt());
        field
    }

    /// Independent pixels of a Rayleigh amplitude: skewness 2√π(π − 3)/(4 − π)^{3/2} = 0.631, no correlation except from the
    /// subtracted smooth image, block means 0.5227/block.
    #[test]
    fn one_look_of_independent_pixels() {
        let found = texture(&amplitude(1), 256).unwrap();
        assert_eq!(found.windows, 4);
        assert!((found.looks - 1.0).abs() < 0.03, "{found:?}");
        assert!((found.skewness - 0.631).abs() < 0.05, "{found:?}");
        for lag in found.along_rows.into_iter().chain(found.along_columns) {
            // The Gaussian of 8 pixels holds 1/(4π·64) of the variance, and twice that is subtracted: below 3e-3.
            assert!(lag.abs() < 0.012, "{found:?}");
        }
        for (n, block) in BLOCKS.into_iter().enumerate() {
            let expected = 0.5227 / block as f64;
            // With 64 blocks per window the scatter is 9 %, and 5 % for the median of four windows.
            assert!(
                (found.block_variation[n] / expected - 1.0).abs() < 0.2,
                "{found:?}"
            );
        }
    }

    /// A variance over 65,536 pixels has a standard error of √(2/65,536) = 0.0055, the median of four windows half of that.
    #[test]
    fn many_looks_are_found() {
        for looks in [4, 20] {
            let found = texture(&amplitude(looks), 256).unwrap();
            assert!(
                (found.looks / f64::from(looks) - 1.0).abs() < 0.015,
                "{looks}: {found:?}"
            );
        }
    }

    /// Variance over squared mean: 4/π − 1 for one look, 1/(4N) + 1/(32N²) for many, the next order being below 1/(100 N³).
    #[test]
    fn looks_are_those_of_a_root_of_a_gamma_distribution() {
        let one = 4.0 / std::f64::consts::PI - 1.0;
        assert!((equivalent_looks(one) - 1.0).abs() < 1e-9);
        for looks in [10.0f64, 100.0] {
            let variation = 0.25 / looks + 1.0 / (32.0 * looks * looks);
            let found = equivalent_looks(variation);
            assert!((found / looks - 1.0).abs() < 0.1 / looks.powi(2), "{found}");
        }
    }

    /// 200,000 simulated pairs of two looks each with ρ = 0.8. The standard error of a correlation r is (1 − r²)/√n, 0.0013.
    #[test]
    fn amplitudes_correlate_less_than_intensities() {
        use rand_distr::{Distribution, StandardNormal};
        let mut random = crate::random::generator(5, crate::random::Stream::Speckle, 0);
        let mut draw = || -> f64 { StandardNormal.sample(&mut random) };
        let rho = 0.8f64;
        let mut sums = [0.0; 5];
        let count = 200_000;
        for _ in 0..count {
            let mut power = [0.0; 2];
            // Two looks of a real and an imaginary part.
            for _ in 0..4 {
                let (a, b) = (draw(), draw());
                power[0] += a * a;
                power[1] += (rho * a + (1.0 - rho * rho).sqrt() * b).powi(2);
            }
            let [a, b] = power.map(f64::sqrt);
            for (sum, value) in sums.iter_mut().zip([a, b, a * a, b * b, a * b]) {
                *sum += value / f64::from(count);
            }
        }
        let [a, b, aa, bb, ab] = sums;
        let found = (ab - a * b) / ((aa - a * a) * (bb - b * b)).sqrt();
        let expected = amplitude_correlation(2.0, rho * rho);
        assert!(
            (found - expected).abs() < 4.0 * 0.0013,
            "{found} {expected}"
        );
        assert!(expected < 0.64 - 0.005, "{expected}");
        assert!((amplitude_correlation(1.0, 1.0) - 1.0).abs() < 1e-12);
        assert!((amplitude_correlation(1e4, 0.3) - 0.3).abs() < 1e-4);
    }

    #[test]
    fn windows_with_a_ship_are_left_out() {
        let mut field = amplitude(4);
        field.values[100 * 520 + 100] = 100.0;
        assert_eq!(texture(&field, 256).unwrap().windows, 3);
        assert!(texture(&field, 513).is_none());
        let flat = Field::constant(&Raster::image(300, 300, 1.0), 1.0);
        assert!(texture(&flat, 256).is_none());
    }
}
