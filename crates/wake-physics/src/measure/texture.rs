//! Texture of open sea: speckle, its correlation, and the mottle beneath.

use super::smooth::smooth;
use crate::raster::Field;
use serde::Serialize;

/// Standard deviation of the bell that tells speckle from what lies beneath \[pixels\]: chosen.
const BELL: f64 = 8.0;

/// A window with a pixel this many standard deviations over its mean holds a ship: chosen.
const SHIP: f64 = 8.0;

/// Sides of the blocks whose means are compared \[pixels\].
const BLOCKS: [usize; 2] = [8, 32];

/// Variance over squared mean of the amplitude of one look, 4/π − 1.
const ONE_LOOK: f64 = 4.0 / std::f64::consts::PI - 1.0;

/// Texture of an image of amplitude: medians over its windows of open sea.
///
/// Speckle is the deviation from a smoothed image. Correlations and skewness do not depend on the grey scale of an image
/// that is linear in amplitude; looks and variations do, where its black is not amplitude 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Texture {
    /// Number of windows.
    pub windows: usize,
    /// Equivalent looks: (4/π − 1) over the squared variation of the speckle, exact for one look and right to a tenth
    /// for many.
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

/// Texture of the windows of `side` pixels of an image that hold no ship; `None` where there is no such window.
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
        looks: ONE_LOOK * mean * mean / variance,
        along_rows: std::array::from_fn(|n| correlation(0, n + 1)),
        along_columns: std::array::from_fn(|n| correlation(n + 1, 0)),
        skewness: moment(3) / variance.powf(1.5),
        block_variation: BLOCKS.map(|block| block_variation(amplitude, side, block, mean)),
    })
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

    /// Independent pixels of a Rayleigh amplitude: skewness 2√π(π − 3)/(4 − π)^{3/2} = 0.631, no correlation but that
    /// of the bell taken away, block means 0.5227/block.
    #[test]
    fn one_look_of_independent_pixels() {
        let found = texture(&amplitude(1), 256).unwrap();
        assert_eq!(found.windows, 4);
        assert!((found.looks - 1.0).abs() < 0.03, "{found:?}");
        assert!((found.skewness - 0.631).abs() < 0.05, "{found:?}");
        for lag in found.along_rows.into_iter().chain(found.along_columns) {
            // The bell of 8 pixels holds 1/(4π·64) of the variance and takes twice that away: below 3e-3.
            assert!(lag.abs() < 0.012, "{found:?}");
        }
        for (n, block) in BLOCKS.into_iter().enumerate() {
            let expected = ONE_LOOK.sqrt() / block as f64;
            // 64 blocks a window: 9 % of scatter, the median of four has 5 %.
            assert!(
                (found.block_variation[n] / expected - 1.0).abs() < 0.2,
                "{found:?}"
            );
        }
    }

    #[test]
    fn many_looks_are_found_to_a_tenth() {
        for looks in [4, 20] {
            let found = texture(&amplitude(looks), 256).unwrap();
            assert!(
                (found.looks / f64::from(looks) - 1.0).abs() < 0.12,
                "{looks}: {found:?}"
            );
        }
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
