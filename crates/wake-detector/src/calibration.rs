//! Probabilities of detections, fitted on images whose wakes are known.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::wake::Detection;

/// Beta calibration: maps a number between 0 and 1 to a probability.
///
/// ```text
/// p(x) = 1/(1 + exp(−a ln x + b ln(1 − x) − c)),    a, b ≥ 0
/// ```
///
/// # References
///
/// Kull, Silva Filho & Flach (2017), "Beta calibration: a well-founded and easily implemented improvement on logistic calibration
/// for binary classifiers", AISTATS.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Beta {
    /// Weight of ln x.
    pub a: f64,
    /// Weight of −ln(1 − x).
    pub b: f64,
    /// Offset of the logit.
    pub c: f64,
}

/// Numbers are clamped to at least this distance from 0 and 1.
const LEAST: f64 = 1e-6;
/// Largest number of Newton steps, and the step size below which the iteration stops.
const STEPS: usize = 100;
const CONVERGED: f64 = 1e-10;

impl Beta {
    /// Returns the probability for a number.
    #[must_use]
    pub fn of(&self, x: f64) -> f64 {
        let [rising, falling, one] = features(x);
        logistic(self.a * rising + self.b * falling + self.c * one)
    }

    /// Fits the curve by maximum likelihood to numbers and whether each was right; the curve never falls, and is constant without
    /// numbers.
    ///
    /// The targets for right and wrong are (n₊ + 1)/(n₊ + 2) and 1/(n₋ + 2), so that separable numbers give finite coefficients.
    ///
    /// # References
    ///
    /// Platt (1999), "Probabilistic outputs for support vector machines" (targets).
    #[must_use]
    pub fn fit(known: &[(f64, bool)]) -> Self {
        let right = known.iter().filter(|one| one.1).count() as f64;
        let wrong = known.len() as f64 - right;
        let targets = [1.0 / (wrong + 2.0), (right + 1.0) / (right + 2.0)];
        let rows: Vec<([f64; 3], f64)> = known
            .iter()
            .map(|&(x, is_right)| (features(x), targets[usize::from(is_right)]))
            .collect();
        // A negative weight would make the curve fall somewhere, so its feature is left out.
        let mut used = [true; 3];
        loop {
            let found = newton(&rows, used);
            let negative = [0, 1].map(|k| used[k] && found[k] < 0.0);
            match negative {
                [true, other] => used = [false, used[1] && !other, true],
                [false, true] => used[1] = false,
                _ => {
                    let [a, b, c] = found;
                    return Self { a, b, c };
                }
            }
        }
    }
}

fn features(x: f64) -> [f64; 3] {
    let x = x.clamp(LEAST, 1.0 - LEAST);
    [x.ln(), -(1.0 - x).ln(), 1.0]
}

fn logistic(logit: f64) -> f64 {
    1.0 / (1.0 + (-logit).exp())
}

/// Coefficients of a logistic regression by Newton's method; unused ones stay 0.
fn newton(rows: &[([f64; 3], f64)], used: [bool; 3]) -> [f64; 3] {
    let mut found = [0.0; 3];
    for _ in 0..STEPS {
        let (mut gradient, mut curvature) = ([0.0; 3], [[0.0; 3]; 3]);
        for (features, target) in rows {
            let logit: f64 = features.iter().zip(found).map(|(x, w)| x * w).sum();
            let p = logistic(logit);
            for i in 0..3 {
                gradient[i] += (target - p) * features[i];
                for j in 0..3 {
                    curvature[i][j] += p * (1.0 - p) * features[i] * features[j];
                }
            }
        }
        for i in 0..3 {
            // Keeps the matrix regular where a feature does not vary.
            curvature[i][i] += 1e-9 * (1.0 + curvature[i][i]);
            if !used[i] {
                gradient[i] = 0.0;
                curvature[i] = [0.0; 3];
                curvature.iter_mut().for_each(|row| row[i] = 0.0);
                curvature[i][i] = 1.0;
            }
        }
        let step = solved(curvature, gradient);
        let longest = step.iter().fold(0.0f64, |longest, x| longest.max(x.abs()));
        // Far from the optimum, a full step may overshoot.
        let share = (2.0 / longest).min(1.0);
        found
            .iter_mut()
            .zip(step)
            .for_each(|(w, x)| *w += share * x);
        if longest < CONVERGED {
            break;
        }
    }
    found
}

/// Solves a positive definite system by elimination.
fn solved(mut matrix: [[f64; 3]; 3], mut right: [f64; 3]) -> [f64; 3] {
    for k in 0..3 {
        for i in k + 1..3 {
            let factor = matrix[i][k] / matrix[k][k];
            let pivot = matrix[k];
            for (value, above) in matrix[i].iter_mut().zip(pivot).skip(k) {
                *value -= factor * above;
            }
            right[i] -= factor * right[k];
        }
    }
    for k in (0..3).rev() {
        let known: f64 = (k + 1..3).map(|j| matrix[k][j] * right[j]).sum();
        right[k] = (right[k] - known) / matrix[k][k];
    }
    right
}

/// Calibration curves of one search mode, and the score threshold of sure detections.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Probabilities {
    /// Probability of a wake, in either direction, by score.
    pub wake: Beta,
    /// Probability that tip and end are not confused, by (1 + [`forward`](Detection::forward))/2.
    pub direction: Beta,
    /// Lowest score of a sure detection.
    pub sure_from: f32,
    /// False alarms at or above that score, per 1,000 km² of simulated sea without ships.
    pub false_alarms: f64,
}

/// Calibration of a network's scores.
///
/// `wake evaluate calibration` writes it beside the weights, as `NAME.calibration.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// CRC-32 of the weight file that the calibration belongs to.
    pub weights: String,
    /// Curves for images of known pixel spacing.
    pub known_spacing: Probabilities,
    /// Curves for images of unknown pixel spacing, which are searched at more scales.
    pub unknown_spacing: Probabilities,
}

impl Calibration {
    /// Path of the calibration of a weight file: `detector.calibration.json` for `detector.safetensors`.
    #[must_use]
    pub fn path_beside(weights: &Path) -> PathBuf {
        weights.with_extension("calibration.json")
    }

    /// Reads a calibration.
    ///
    /// - `weights`: CRC-32 of the weights that it must belong to
    ///
    /// # Errors
    ///
    /// [`Error::Calibration`] for text that is not a calibration, or is the calibration of other weights.
    pub(crate) fn read(name: &Path, text: &str, weights: &str) -> Result<Self> {
        let wrong = |why: String| Error::Calibration {
            path: name.to_owned(),
            why,
        };
        let found: Self = serde_json::from_str(text).map_err(|error| wrong(error.to_string()))?;
        match found.weights == weights {
            true => Ok(found),
            false => Err(wrong(format!(
                "it belongs to weights with CRC-32 {}, not {weights}; make it again with `wake evaluate calibration`",
                whole_files::quoted(&found.weights)
            ))),
        }
    }
}

impl Probabilities {
    /// Sets the probabilities of a detection.
    pub(crate) fn rate(&self, one: &mut Detection) {
        one.probability = Some(self.wake.of(f64::from(one.score)) as f32);
        let forward = one.forward.map(|forward| 0.5 * (1.0 + f64::from(forward)));
        one.direction_probability = forward.map(|x| self.direction.of(x) as f32);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wake_nn::noise::NoiseSource;

    /// Uniform random numbers, each right with the probability that a curve gives it.
    fn drawn(curve: &Beta, count: u64) -> Vec<(f64, bool)> {
        let number = |stream: u32, k: u64| NoiseSource::new(5).uniform(stream, k);
        let one = |k: u64| (number(0, k), number(1, k) < curve.of(number(0, k)));
        (0..count).map(one).collect()
    }

    /// With three coefficients, 20,000 numbers determine the curve to √(p(1 − p)·3/n) ≈ 0.006 on average; the tolerance at each
    /// tested number is five times that.
    #[test]
    fn the_curve_behind_the_numbers_is_found() {
        for curve in [
            Beta {
                a: 1.3,
                b: 0.6,
                c: 0.4,
            },
            Beta {
                a: 0.7,
                b: 0.0,
                c: -1.0,
            },
            Beta {
                a: 0.0,
                b: 2.0,
                c: -2.0,
            },
        ] {
            let found = Beta::fit(&drawn(&curve, 20_000));
            assert!(found.a >= 0.0 && found.b >= 0.0);
            for x in [0.05, 0.2, 0.5, 0.8, 0.95] {
                let (p, q) = (curve.of(x), found.of(x));
                let odds = x.powf(curve.a) / (1.0 - x).powf(curve.b) * curve.c.exp();
                assert!((p - odds / (1.0 + odds)).abs() < 1e-12, "{curve:?} at {x}");
                assert!((p - q).abs() < 0.03, "{curve:?} {found:?} at {x}: {p} {q}");
            }
        }
    }

    /// With a free offset, the probabilities sum to the sum of the targets.
    #[test]
    fn probabilities_sum_to_what_was_right() {
        let known = drawn(
            &Beta {
                a: 2.0,
                b: 0.3,
                c: 1.0,
            },
            3000,
        );
        let fitted = Beta::fit(&known);
        let right = known.iter().filter(|one| one.1).count() as f64;
        let wrong = known.len() as f64 - right;
        let targets = right * (right + 1.0) / (right + 2.0) + wrong / (wrong + 2.0);
        let sum: f64 = known.iter().map(|one| fitted.of(one.0)).sum();
        assert!((sum - targets).abs() < 1e-3, "{sum} {targets}");
    }

    /// No numbers, one class alone, separable numbers, falling ones and the bounds 0 and 1 give finite curves that never fall.
    #[test]
    fn hard_numbers_have_a_rising_finite_curve() {
        let separable: Vec<(f64, bool)> =
            (0..100).map(|k| (f64::from(k) / 100.0, k >= 50)).collect();
        let falling: Vec<(f64, bool)> = (0..100).map(|k| (f64::from(k) / 100.0, k < 50)).collect();
        let alone = vec![(0.3, true); 7];
        for known in [
            Vec::new(),
            alone,
            separable,
            falling,
            vec![(0.0, false), (1.0, true)],
        ] {
            let curve = Beta::fit(&known);
            let values: Vec<f64> = (0..=50).map(|k| curve.of(f64::from(k) / 50.0)).collect();
            assert!(
                values.iter().all(|p| (0.0..=1.0).contains(p)),
                "{known:?} {curve:?}"
            );
            assert!(
                values.windows(2).all(|pair| pair[1] >= pair[0]),
                "{curve:?}"
            );
        }
    }

    #[test]
    fn a_calibration_of_other_weights_is_refused() {
        let curve = Beta {
            a: 1.0,
            b: 1.0,
            c: 0.0,
        };
        let probabilities = Probabilities {
            wake: curve,
            direction: curve,
            sure_from: 0.3,
            false_alarms: 1.0,
        };
        let calibration = Calibration {
            weights: "0123abcd".to_owned(),
            known_spacing: probabilities,
            unknown_spacing: probabilities,
        };
        let text = serde_json::to_string(&calibration).expect("JSON");
        let path = Calibration::path_beside(Path::new("a/detector.safetensors"));
        assert_eq!(path, Path::new("a/detector.calibration.json"));
        assert_eq!(
            Calibration::read(&path, &text, "0123abcd").expect("its weights"),
            calibration
        );
        let refused = |text: &str, weights: &str| {
            let error = Calibration::read(&path, text, weights).expect_err("refused");
            error.to_string()
        };
        assert!(refused(&text, "ffffffff").contains("0123abcd"));
        assert!(refused("{}", "0123abcd").contains("detector.calibration.json"));
    }
}
