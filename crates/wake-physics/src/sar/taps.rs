//! Gaussian taps and their number: the arithmetic of the fast sum.

use crate::numeric::vector::exp2_f32;
use std::f64::consts::PI;

/// Taps are computed in groups of this size.
pub(super) const LANES: usize = 8;

/// Composition of every Gaussian response from two: taps on every `step`-th row, then one fixed Gaussian that fills the
/// rows between.
///
/// ```text
/// G_v(m − t) ≈ step · Σ_n G_b(m − n·step) · G_{v−b}(n·step − t)
/// ```
///
/// The sum over n is a trapezoidal rule for the convolution of two Gaussians; with a = v − b its relative error is at most
/// 2 exp(−2π² (a b/(a+b))/step²). A wide response thus costs as few taps as a narrow one.
#[derive(Debug)]
pub(super) struct Steps {
    /// Rows per step; 1 means no second Gaussian.
    pub(super) step: usize,
    /// Variance b of the second Gaussian [rows²]; 0 at step 1.
    pub(super) filling: f64,
    /// Standard deviations at which each Gaussian is cut.
    pub(super) reach: f64,
}

impl Steps {
    /// The largest step that keeps the error of any response of at least variance `smallest` within 3/4 of
    /// `tolerance`: a quarter each for the trapezoidal rule and the ends of the two Gaussians.
    pub(super) fn new(smallest: f64, tolerance: f64) -> Self {
        let per_square = (8.0 / tolerance).ln() / (2.0 * PI * PI);
        // The best split is into halves: a b/(a+b) = v/4.
        let step = ((smallest / (4.0 * per_square)).sqrt() as usize).max(1);
        Self {
            step,
            filling: if step > 1 { 0.5 * smallest } else { 0.0 },
            reach: reach(tolerance / 4.0),
        }
    }

    /// Number of taps for a response of variance `variance` [rows²] around any position, a multiple of [`LANES`]. The
    /// omitted part lies beyond `reach` standard deviations (plus half a tap, so that a sum is at most the integral).
    #[inline(always)]
    pub(super) fn taps(&self, variance: f32) -> usize {
        let half = self.reach as f32 * (variance - self.filling as f32).sqrt() / self.step as f32;
        // The conversion truncates; one more tap makes up for it.
        ((2.0 * half) as usize + 2).next_multiple_of(LANES)
    }

    /// The second Gaussian: for every phase `row mod step`, weights of the steps `first, first + 1, …` relative to `row div
    /// step`. All weights of one step, over all rows, sum to 1.
    pub(super) fn filling_taps(&self) -> (i64, Vec<Vec<f32>>) {
        let side = (self.reach * self.filling.sqrt() + 0.5).ceil() as i64;
        let weight = |d: i64| {
            if d.abs() > side || self.step == 1 {
                return f64::from(u8::from(d == 0));
            }
            (-((d * d) as f64) / (2.0 * self.filling)).exp()
        };
        let sum: f64 = (-side..=side).map(weight).sum();
        let step = self.step as i64;
        let half = side / step + 1;
        let phase = |r: i64| {
            (-half..=half)
                .map(|n| (weight(r - n * step) / sum) as f32)
                .collect()
        };
        (-half, (0..step).map(phase).collect())
    }
}

/// Standard deviations z at which a Gaussian may be cut and renormalised with a change of at most `error`: 2·2Q(z) ≤ error,
/// with the bound Q(z) ≤ exp(−z²/2)/(z√(2π)).
fn reach(error: f64) -> f64 {
    (0..8).fold(3.0, |z: f64, _| {
        let ratio = 4.0 / (error * z * (2.0 * PI).sqrt());
        (2.0 * ratio.ln()).max(1.0).sqrt()
    })
}

/// Fills `taps` with exp(−(k − centre)²·scale·ln 2), k = 0, 1, …, and returns their sum.
#[inline(always)]
pub(super) fn gaussian(taps: &mut [f32], centre: f32, scale: f32) -> f32 {
    let mut sums = [0f32; LANES];
    let mut first = -centre;
    for group in taps.as_chunks_mut::<LANES>().0 {
        *group = std::array::from_fn(|lane| {
            let d = first + lane as f32;
            exp2_f32(-d * d * scale)
        });
        for (sum, tap) in sums.iter_mut().zip(*group) {
            *sum += tap;
        }
        first += LANES as f32;
    }
    sums.iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reach_is_that_of_the_normal_tail() {
        // Two-sided tails 2Q(z) of the normal distribution: 0.0027 at 3, 5.733e-7 at 5 (tables). The bound used exceeds Q
        // by at most the fraction 1/z².
        for (z, tails) in [(3.0, 2.6998e-3), (5.0, 5.733e-7)] {
            let found = reach(2.0 * tails);
            assert!(found >= z && found < z + 0.04, "{found}");
        }
    }
    /// The two Gaussians compose to the single one, at every position between the steps, for all tolerances.
    #[test]
    fn two_gaussians_make_one() {
        for tolerance in [1e-1, 1e-2, 1e-3, 1e-4, 1e-5] {
            for (smallest, wider) in [(0.25, 1.0), (3.0, 1.0), (40.0, 1.0), (40.0, 6.0)] {
                let steps = Steps::new(smallest, tolerance);
                let variance = smallest * wider;
                for i in 0..7 {
                    let place = 400.0 + 0.37 * f64::from(i);
                    let error = composed_error(&steps, variance, place);
                    // Rounding to f32 adds a few 1e-7 to the tolerance.
                    assert!(error < tolerance + 1e-6, "{tolerance} {smallest} {error}");
                }
            }
        }
    }

    /// Sum over all rows of |taps composed in steps − normalised Gaussian|.
    fn composed_error(steps: &Steps, variance: f64, place: f64) -> f64 {
        let count = steps.taps(variance as f32);
        let narrow = (variance - steps.filling) / (steps.step * steps.step) as f64;
        let at = place / steps.step as f64;
        let first = at.floor() as i64 - (count as i64) / 2 + 1;
        let mut taps = vec![0.0; count];
        let scale = std::f64::consts::LOG2_E / (2.0 * narrow);
        let sum = gaussian(&mut taps, (at - first as f64) as f32, scale as f32);
        let (filling_first, filling) = steps.filling_taps();
        let exact_at = |m: i64| (-(m as f64 - place).powi(2) / (2.0 * variance)).exp();
        let exact_sum: f64 = (0..800).map(exact_at).sum();
        (0..800)
            .map(|m: i64| {
                let step = steps.step as i64;
                let made: f64 = filling[(m % step) as usize]
                    .iter()
                    .enumerate()
                    .map(|(k, &g)| {
                        let n = m / step + filling_first + k as i64 - first;
                        let tap = usize::try_from(n).ok().and_then(|n| taps.get(n));
                        f64::from(g) * f64::from(*tap.unwrap_or(&0.0) / sum)
                    })
                    .sum();
                (made - exact_at(m) / exact_sum).abs()
            })
            .sum()
    }
}
