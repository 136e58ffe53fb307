//! Reliability of predicted probabilities.

use serde::Serialize;

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

#[cfg(test)]
mod tests {
    use super::*;

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
