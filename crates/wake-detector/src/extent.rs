//! Length of a wake's line, with its standard deviation.
//!
//! The first part of the line gives the profile of the wake across its axis, strips beside it give the noise of the sea, and the
//! likelihood decides how far the line continues.
//!
//! ```text
//! s_k = Σ_c p(c) z_k(c) / |p|                                   contrast of block k along the profile p of the first part
//! ln L(n) = Σ_{k<n} (s_k m − m²/2)/σ²                           the line ends behind block n; σ² from the same sums beside it
//! ```
//!
//! z is the contrast in standard deviations of the speckle. m is the mean of s on the first part, and a share of it beyond,
//! because wakes fade. The profile is smoothed, shrunk toward zero where it does not exceed its noise, and has mean zero, so
//! that mottle as wide as the strip cancels; on the first part, each block is compared with the profile of the others. The
//! length is the posterior mean over n, the shares of m and small turns of the axis; its standard deviation comes from the
//! posterior, plus a share of the length for wakes that fade.
//!
//! # References
//!
//! Hinkley (1970), Biometrika 57, 1: likelihood of a change point. James & Stein (1961): shrinkage. The constants are chosen.

use crate::wake::{Extent, Wake};

/// Length of a block along the axis and half the width of a profile \[units\], and the longest line \[blocks\].
const BLOCK: usize = 6;
const REACH: usize = 26;
const LONGEST: usize = 120;
/// Blocks at the tip that are skipped because of the ship.
const SHIP: usize = 2;
/// Fewest and most blocks of the first part, from which the profile is taken.
const FIRST: [usize; 2] = [7, 16];
/// Offsets from the axis of the strips of sea beside it, in half-widths of a profile.
const LANES: [isize; 4] = [-3, -2, 2, 3];
/// Largest distance of a column from the axis, enough for the outer lanes of a turned axis.
const SIDE: isize = 146;
/// Number of turns of the axis tried to each side, their step and prior standard deviation \[deg\].
const TURNS: i32 = 4;
const TURN_STEP: f64 = 0.75;
const TURN_DEVIATION: f64 = 1.5;
/// Ratios of the contrast beyond the first part to the contrast on it, all equally likely.
const SHARES: [f64; 5] = [0.25, 0.4, 0.6, 0.8, 1.0];
/// Standard deviation of the log-normal prior about the network's length.
const PRIOR: f64 = 0.8;
/// Standard deviation of the smoothing across the axis, and effective number of values it averages \[columns\].
const SMOOTH: f64 = 1.5;
const TOGETHER: f64 = 2.6;
/// Standard deviation of the end of a fading wake, as a share of the length.
const FADE: f64 = 0.08;
/// Contrast is clamped to ±this; higher contrast is a ship.
const BOUND: f32 = 4.0;

/// An image in standard deviations of its speckle, `[rows, columns]`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Surroundings<'a> {
    pub(crate) contrast: &'a [f32],
    pub(crate) rows: usize,
    pub(crate) columns: usize,
    /// Unit of length \[pixels\]: 1 where the speckle of neighbouring pixels is independent, more where it is correlated.
    pub(crate) unit: f32,
}

/// Mean contrast by block along the axis and column across it: `[blocks, 2·SIDE + 1]`, NaN outside the image.
struct Strip(Vec<[f64; 2 * SIDE as usize + 1]>);

impl Surroundings<'_> {
    /// Estimates the length of a wake's line; `None` if too little of it lies in the image, or nothing of it exceeds the noise.
    pub(crate) fn extent(&self, wake: &Wake) -> Option<Extent> {
        let strip = self.strip(wake);
        let told = f64::from(wake.length / self.unit).max(BLOCK as f64);
        strip.likelihood(0.0, told)?;
        let mut log_posterior = [f64::NEG_INFINITY; LONGEST + 1];
        for turn in -TURNS..=TURNS {
            let turn = TURN_STEP * f64::from(turn);
            let Some(likelihood) = strip.likelihood(turn, told) else {
                continue;
            };
            let prior = -0.5 * (turn / TURN_DEVIATION).powi(2);
            for (n, value) in likelihood.into_iter().enumerate().skip(SHIP + 1) {
                let length = (n * BLOCK) as f64;
                let usual = -length.ln() - 0.5 * ((length / told).ln() / PRIOR).powi(2);
                log_posterior[n] = log_sum(log_posterior[n], value + usual + prior);
            }
        }
        let highest = log_posterior
            .iter()
            .copied()
            .fold(f64::NEG_INFINITY, f64::max);
        if !highest.is_finite() {
            return None;
        }
        let (mut sum, mut first, mut second) = (0.0, 0.0, 0.0);
        for (n, value) in log_posterior.iter().enumerate() {
            let (weight, length) = ((value - highest).exp(), (n * BLOCK) as f64);
            sum += weight;
            first += weight * length;
            second += weight * length * length;
        }
        let length = first / sum;
        let variance = (second / sum - length * length).max(0.0)
            + (BLOCK * BLOCK) as f64 / 12.0
            + (FADE * length).powi(2);
        Some(Extent {
            length: length as f32 * self.unit,
            deviation: variance.sqrt() as f32 * self.unit,
        })
    }

    fn strip(&self, wake: &Wake) -> Strip {
        let [right, down] = wake.direction();
        let block = |k: usize| {
            let mut means = [0.0; 2 * SIDE as usize + 1];
            for (j, mean) in means.iter_mut().enumerate() {
                let across = (j as isize - SIDE) as f32 * self.unit;
                for i in k * BLOCK..(k + 1) * BLOCK {
                    let along = i as f32 * self.unit;
                    let x = wake.tip[0] + along * right - across * down;
                    let y = wake.tip[1] + along * down + across * right;
                    *mean += self.at(x, y).map_or(f64::NAN, f64::from) / BLOCK as f64;
                }
            }
            means
        };
        Strip((0..LONGEST).map(block).collect())
    }

    /// Clamped contrast at a place between pixels, by bilinear interpolation; `None` outside the image.
    fn at(&self, x: f32, y: f32) -> Option<f32> {
        let inside = |at: f32, size: usize| at >= 0.0 && at <= size as f32 - 1.0;
        if !inside(x, self.columns) || !inside(y, self.rows) {
            return None;
        }
        let (column, row) = (x as usize, y as usize);
        let (u, v) = (x - column as f32, y - row as f32);
        let next = |at: usize, size: usize| (at + 1).min(size - 1);
        let value = |row: usize, column: usize| {
            self.contrast[row * self.columns + column].clamp(-BOUND, BOUND)
        };
        let line = |row: usize| {
            let from = value(row, column);
            from + u * (value(row, next(column, self.columns)) - from)
        };
        let above = line(row);
        Some(above + v * (line(next(row, self.rows)) - above))
    }
}

impl Strip {
    /// One block of a lane along a turned axis, `[2·REACH + 1]`; `None` where it leaves the image.
    fn lane(&self, block: usize, turn: f64, lane: isize) -> Option<&[f64]> {
        let along = (block as f64 + 0.5) * BLOCK as f64;
        let shift = (turn.to_radians().tan() * along).round() as isize;
        let reach = REACH as isize;
        let first = SIDE + shift + lane * reach - reach;
        let values = usize::try_from(first)
            .ok()
            .and_then(|first| self.0[block].get(first..=first + 2 * REACH))?;
        values
            .iter()
            .all(|value| value.is_finite())
            .then_some(values)
    }

    /// Log-likelihood of the line's length, by number of blocks; `None` without a profile.
    ///
    /// - `told`: length given by the network \[units\]
    fn likelihood(&self, turn: f64, told: f64) -> Option<Vec<f64>> {
        let line: Vec<&[f64]> = (0..LONGEST).map_while(|k| self.lane(k, turn, 0)).collect();
        let first = ((told / BLOCK as f64) as usize)
            .clamp(FIRST[0], FIRST[1])
            .min(line.len());
        if first < SHIP + 3 {
            return None;
        }
        let beside: Vec<&[f64]> = LANES
            .iter()
            .flat_map(|&lane| (0..line.len()).filter_map(move |k| self.lane(k, turn, lane)))
            .collect();
        if beside.len() < FIRST[0] {
            return None;
        }
        let noise = variance(beside.iter().flat_map(|values| values.iter().copied()));
        let zone = &line[SHIP..first];
        let mut total = [0.0; 2 * REACH + 1];
        for values in zone {
            for (sum, value) in total.iter_mut().zip(*values) {
                *sum += value;
            }
        }
        let whole = profile(&total, zone.len(), noise)?;
        let strength = |k: usize| -> f64 {
            if !(SHIP..first).contains(&k) {
                return product(&whole, line[k]);
            }
            let mut others = total;
            for (sum, value) in others.iter_mut().zip(line[k]) {
                *sum -= value;
            }
            profile(&others, zone.len() - 1, noise).map_or(0.0, |p| product(&p, line[k]))
        };
        let strengths: Vec<f64> = (0..line.len()).map(strength).collect();
        let sea: Vec<f64> = beside
            .iter()
            .map(|values| product(&whole, values))
            .collect();
        let spread = correlated_variance(&sea);
        if spread <= 0.0 {
            return None;
        }
        let mean = strengths[SHIP..first].iter().sum::<f64>() / zone.len() as f64;
        let mean = mean.max(1e-6);
        let mut sums = [0.0; SHARES.len()];
        let equal = (SHARES.len() as f64).ln();
        let mut likelihood = vec![0.0];
        for (k, s) in strengths.iter().enumerate() {
            for (sum, share) in sums.iter_mut().zip(SHARES) {
                let m = if k < first { mean } else { share * mean };
                if k >= SHIP {
                    *sum += (s * m - 0.5 * m * m) / spread;
                }
            }
            let together = sums.iter().copied().fold(f64::NEG_INFINITY, log_sum);
            likelihood.push(together - equal);
        }
        Some(likelihood)
    }
}

/// Profile from a sum of `count` blocks: smoothed, mean removed, shrunk, of unit norm; `None` if nothing exceeds the noise.
///
/// - `noise`: variance of one value of a block
fn profile(total: &[f64; 2 * REACH + 1], count: usize, noise: f64) -> Option<[f64; 2 * REACH + 1]> {
    let size = total.len() as isize;
    let reach = (4.0 * SMOOTH) as isize;
    let weights: Vec<f64> = (-reach..=reach)
        .map(|k| (-0.5 * (k as f64 / SMOOTH).powi(2)).exp())
        .collect();
    let sum: f64 = weights.iter().sum();
    let mut smooth = [0.0; 2 * REACH + 1];
    for (c, value) in smooth.iter_mut().enumerate() {
        let near = (-reach..=reach).zip(&weights);
        let at = |k: isize| total[(c as isize + k).clamp(0, size - 1) as usize];
        *value = near.map(|(k, w)| w * at(k)).sum::<f64>() / (sum * count as f64);
    }
    let mean = smooth.iter().sum::<f64>() / size as f64;
    let error = noise / (count as f64 * TOGETHER);
    let mut square = 0.0;
    for value in &mut smooth {
        *value -= mean;
        let kept = 1.0 - 2.0 * error / (*value * *value).max(1e-12);
        *value *= kept.clamp(0.0, 1.0);
        square += *value * *value;
    }
    (square > 1e-12).then(|| smooth.map(|value| value / square.sqrt()))
}

fn product(profile: &[f64], values: &[f64]) -> f64 {
    profile.iter().zip(values).map(|(p, z)| p * z).sum()
}

fn variance(values: impl Iterator<Item = f64>) -> f64 {
    let (mut count, mut first, mut second) = (0.0, 0.0, 0.0);
    for value in values {
        (count, first, second) = (count + 1.0, first + value, second + value * value);
    }
    (second / count - (first / count).powi(2)).max(0.0)
}

/// Variance per value of a sum of consecutive values, with their correlation up to a lag of three.
fn correlated_variance(values: &[f64]) -> f64 {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let lag = |by: usize| {
        let pairs = values.iter().zip(&values[by.min(values.len())..]);
        pairs.map(|(a, b)| (a - mean) * (b - mean)).sum::<f64>() / count
    };
    lag(0) + 2.0 * (1..=3).map(|by| lag(by).max(0.0)).sum::<f64>()
}

/// ln(eᵃ + eᵇ).
fn log_sum(a: f64, b: f64) -> f64 {
    let (low, high) = (a.min(b), a.max(b));
    if low == f64::NEG_INFINITY {
        return high;
    }
    high + (low - high).exp().ln_1p()
}

#[cfg(test)]
mod tests {
    use super::*;
    use wake_nn::noise::NoiseSource;

    const ROWS: usize = 220;
    const COLUMNS: usize = 620;

    /// White noise with a dark line from (60, 110) to the right, 7 rows wide; depth in standard deviations.
    fn painted(seed: u64, length: f32, depth: f32) -> Vec<f32> {
        let mut image = NoiseSource::new(seed).normal(0, ROWS * COLUMNS);
        for row in 107..=113 {
            for column in 60..60 + length as usize {
                image[row * COLUMNS + column] -= depth;
            }
        }
        image
    }

    fn wake(length: f32) -> Wake {
        Wake {
            tip: [60.0, 110.0],
            axis_deg: 90.0,
            half_angle_deg: 4.0,
            length,
            snr: f32::INFINITY,
            contrast_db: None,
        }
    }

    fn extent(image: &[f32], told: f32, tip: [f32; 2], axis_deg: f32) -> Option<Extent> {
        let surroundings = Surroundings {
            contrast: image,
            rows: ROWS,
            columns: COLUMNS,
            unit: 1.0,
        };
        surroundings.extent(&Wake {
            tip,
            axis_deg,
            ..wake(told)
        })
    }

    /// Lines of 60 to 480 pixels for which the network gives 100: a block of 6 × 7 pixels of depth 0.6 exceeds the noise by 3.9
    /// standard deviations, so the end is located to a block and a half; the axis is off by a degree, the tip by 3 pixels.
    #[test]
    fn lines_are_followed_to_their_end() {
        for (n, length) in [60.0, 100.0, 180.0, 300.0, 480.0].into_iter().enumerate() {
            for seed in 0..3 {
                let image = painted(10 * n as u64 + seed, length, 0.6);
                let found = extent(&image, 100.0, [57.0, 111.0], 91.0).expect("a line");
                let off = found.length - length - 3.0;
                assert!(off.abs() < 3.0 * found.deviation, "{length}: {found:?}");
                assert!(off.abs() < 12.0 + 0.05 * length, "{length}: {found:?}");
                assert!(found.deviation < 12.0 + 0.1 * length, "{length}: {found:?}");
            }
        }
    }

    /// The deviation is honest for faint lines too: about two thirds lie within it; at least half of 24 must.
    #[test]
    fn the_deviation_holds_two_thirds() {
        let within = (0..24).filter(|&seed| {
            let image = painted(100 + seed, 200.0, 0.35);
            let found = extent(&image, 100.0, [60.0, 110.0], 90.0);
            found.is_some_and(|found| (found.length - 200.0).abs() < found.deviation)
        });
        assert!(within.count() >= 12);
    }

    /// The end of a fainter line is less certain.
    #[test]
    fn faint_lines_are_less_certain() {
        let mean = |depth: f32| -> f32 {
            let found = (0..6).filter_map(|seed| {
                extent(
                    &painted(50 + seed, 150.0, depth),
                    100.0,
                    [60.0, 110.0],
                    90.0,
                )
            });
            found.map(|found| found.deviation).sum::<f32>() / 6.0
        };
        let (plain, faint) = (mean(1.0), mean(0.25));
        assert!(plain < 0.8 * faint, "{plain} {faint}");
    }

    /// A line that leaves the image ends at its border.
    #[test]
    fn a_line_ends_at_the_border() {
        let image = painted(7, 560.0, 0.8);
        let found = extent(&image, 100.0, [60.0, 110.0], 90.0).expect("a line");
        assert!((500.0..=560.0).contains(&found.length), "{found:?}");
    }

    /// With correlated speckle, a line has the same length in pixels, measured in larger blocks.
    #[test]
    fn lengths_are_in_pixels_of_the_image() {
        let image = painted(3, 240.0, 0.9);
        let found = Surroundings {
            contrast: &image,
            rows: ROWS,
            columns: COLUMNS,
            unit: 1.25,
        }
        .extent(&wake(90.0))
        .expect("a line");
        assert!((found.length - 240.0).abs() < 30.0, "{found:?}");
    }

    /// Where nothing can be measured, the result is `None`, without a panic.
    #[test]
    fn hard_images_have_no_end() {
        let flat = vec![0.0; ROWS * COLUMNS];
        assert_eq!(extent(&flat, 100.0, [60.0, 110.0], 90.0), None);
        let image = painted(1, 100.0, 1.0);
        assert_eq!(extent(&image, 100.0, [610.0, 110.0], 90.0), None);
        assert_eq!(extent(&image, 100.0, [-1e6, f32::MAX], 90.0), None);
        assert_eq!(extent(&image, f32::INFINITY, [610.0, 110.0], 90.0), None);
    }
}
