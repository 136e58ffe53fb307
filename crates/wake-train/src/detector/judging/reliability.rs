//! Reliability of predicted probabilities.

use serde::Serialize;
use wake_nn::noise::NoiseSource;

/// Predictions with neighbouring probabilities.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ReliabilityBin {
    /// Number of predictions.
    pub count: usize,
    /// Mean probability.
    pub predicted: f64,
    /// Share that was right.
    pub observed: f64,
}

/// Reliability of some predictions.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Reliability {
    /// Number of predictions.
    pub count: usize,
    /// Bins of equal width from 0 to 1, including empty ones.
    pub bins: Vec<ReliabilityBin>,
    /// Expected calibration error: mean distance of predicted and observed over the bins, weighted with their counts.
    pub calibration_error: f64,
    /// Brier score: mean square of probability less outcome.
    pub brier: f64,
    /// Brier score of a constant probability, the share that was right.
    pub brier_of_constant: f64,
}

/// Number of bins.
const BINS: usize = 10;
/// Draws of a bootstrap and their seed.
const DRAWS: u32 = 1000;
const SEED: u64 = 5;

impl Reliability {
    /// The reliability of predictions, each a probability and whether it was right; `None` without any.
    ///
    /// # References
    ///
    /// Brier (1950), "Verification of forecasts expressed in terms of probability"; Naeini, Cooper & Hauskrecht (2015),
    /// "Obtaining well calibrated probabilities using Bayesian binning" (calibration error).
    #[must_use]
    pub fn of(predictions: &[(f64, bool)]) -> Option<Self> {
        let count = predictions.len();
        if count == 0 {
            return None;
        }
        let mut sums = [(0usize, 0.0, 0.0); BINS];
        let (mut square, mut right) = (0.0, 0.0);
        for &(p, is_right) in predictions {
            let outcome = f64::from(u8::from(is_right));
            let bin = &mut sums[((p * BINS as f64) as usize).min(BINS - 1)];
            *bin = (bin.0 + 1, bin.1 + p, bin.2 + outcome);
            square += (p - outcome).powi(2);
            right += outcome;
        }
        let all = count as f64;
        let error = sums
            .iter()
            .map(|(_, p, right)| (p - right).abs())
            .sum::<f64>()
            / all;
        let bin = |&(count, predicted, observed): &(usize, f64, f64)| {
            let share = |sum: f64| if count == 0 { 0.0 } else { sum / count as f64 };
            ReliabilityBin {
                count,
                predicted: share(predicted),
                observed: share(observed),
            }
        };
        let rate = right / all;
        Some(Self {
            count,
            bins: sums.iter().map(bin).collect(),
            calibration_error: error,
            brier: square / all,
            brier_of_constant: rate * (1.0 - rate),
        })
    }
}

/// The 95 % bootstrap interval of a figure, drawing groups of predictions with replacement.
///
/// - `groups`: predictions that depend on each other, such as those of an image
///
/// # References
///
/// Efron & Tibshirani (1993), "An Introduction to the Bootstrap", chapter 13 (percentile interval).
#[must_use]
pub fn bootstrap(
    groups: &[Vec<(f64, bool)>],
    figure: impl Fn(&Reliability) -> f64,
) -> Option<[f64; 2]> {
    let draws = NoiseSource::new(SEED);
    let draw = |n: u32| -> Option<f64> {
        let one = |k: u64| {
            let at = draws.uniform(n, k) * groups.len() as f64;
            &groups[at as usize]
        };
        let drawn: Vec<(f64, bool)> = (0..groups.len() as u64).flat_map(one).copied().collect();
        Reliability::of(&drawn).map(|found| figure(&found))
    };
    let mut figures: Vec<f64> = (0..DRAWS).filter_map(draw).collect();
    figures.sort_by(f64::total_cmp);
    let at = |share: f64| {
        figures
            .get((share * figures.len() as f64) as usize)
            .copied()
    };
    Some([at(0.025)?, at(0.975)?])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean of 400 independent outcomes of 0.3: ± 1.96 · √(0.21/400) = 0.045, to a tenth of that for 1,000 draws.
    #[test]
    fn the_interval_of_a_share_is_that_of_the_binomial() {
        let groups: Vec<Vec<(f64, bool)>> = (0..400).map(|k| vec![(0.0, k % 10 < 3)]).collect();
        // With a probability of 0 the Brier score is the share that was right.
        let [low, high] = bootstrap(&groups, |found| found.brier).unwrap();
        assert!(
            (low - 0.255).abs() < 0.006 && (high - 0.345).abs() < 0.006,
            "{low} {high}"
        );
        assert!(bootstrap(&[], |found| found.brier).is_none());
    }

    /// Ten predictions of 0.25 of which four were right, and ten of 0.8 of which all were: the figures by hand.
    #[test]
    fn figures_are_those_computed_by_hand() {
        let mut predictions: Vec<(f64, bool)> = (0..10).map(|k| (0.25, k < 4)).collect();
        predictions.extend([(0.8, true); 10]);
        let found = Reliability::of(&predictions).unwrap();
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
        close(found.calibration_error, 0.5 * 0.15 + 0.5 * 0.2);
        close(
            found.brier,
            (4.0 * 0.75f64.powi(2) + 6.0 * 0.25f64.powi(2) + 10.0 * 0.2f64.powi(2)) / 20.0,
        );
        close(found.brier_of_constant, 0.7 * 0.3);
        assert_eq!(found.bins.iter().map(|bin| bin.count).sum::<usize>(), 20);
        close(found.bins[2].observed, 0.4);
        close(found.bins[8].predicted, 0.8);
        assert!(Reliability::of(&[]).is_none());
        assert_eq!(
            Reliability::of(&[(1.0, true)]).unwrap().bins[BINS - 1].count,
            1
        );
    }
}
