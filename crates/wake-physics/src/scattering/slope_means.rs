//! Means of σ⁰ over subpixel slopes, with as many nodes as the demanded error requires.

use crate::numeric::gauss_hermite;
use crate::scattering::slopes::SlopeCovariance;
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_4, SQRT_2};
use std::sync::LazyLock;

/// Node counts of the rules; the last rule serves only to estimate the errors of the others.
const COUNTS: [usize; 10] = [1, 3, 5, 7, 9, 13, 19, 27, 39, 55];
/// Number of rules in use.
const USED: usize = COUNTS.len() - 1;

/// Smallest weight of a node that is kept; omitted nodes contribute a ten-millionth of σ⁰ five deviations away.
const LEAST_WEIGHT: f64 = 1e-7;

/// The rules: nodes in ascending order, and weights.
static RULES: LazyLock<Vec<Vec<[f64; 2]>>> = LazyLock::new(|| {
    let mut rules = gauss_hermite(&COUNTS);
    for rule in &mut rules {
        rule.retain(|[_, weight]| *weight > LEAST_WEIGHT);
    }
    rules
});

/// Number of deviations at which the errors of the rules are evaluated, each a factor of √2 below the previous one.
const DEVIATIONS: usize = 14;

/// Share of the variance along the second axis below which it counts as zero: rounding error for a single wave.
const ROUNDED: f64 = 1e-5;

/// Points along each axis of the slopes at which the errors of the rules are evaluated.
const PLACES: usize = 5;

/// Cells between these points.
const CELLS: usize = PLACES - 1;

/// Choice of the rule for a mean over slopes, by the central slope and the deviation of the others.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SlopeMeans {
    /// Ranges of the central slopes.
    facets: [[f64; 2]; 2],
    /// Largest variance of each rule, by cell: `[CELLS, CELLS]`, with the first axis varying fastest.
    largest: Vec<[f64; USED]>,
    /// Error of the last rule at the largest deviation.
    error: f64,
}

impl SlopeMeans {
    /// Number of rules in use.
    #[cfg(test)]
    pub(crate) const RULES_TAKEN: usize = USED;

    /// Upper bound on the distance of the farthest node from the centre, for slopes of a given total variance.
    pub(crate) fn reach(variance: f64) -> f64 {
        if variance <= 0.0 {
            return 0.0;
        }
        let farthest = RULES.iter().filter_map(|rule| rule.last());
        farthest.map(|node| node[0]).fold(0.0, f64::max) * variance.sqrt()
    }

    /// Uses one rule for all means.
    #[cfg(test)]
    pub(crate) fn fixed(rule: usize) -> Self {
        let mut largest = [0.0; USED];
        largest[rule..].fill(f64::INFINITY);
        Self {
            facets: [[-1.0, 1.0]; 2],
            largest: vec![largest; CELLS * CELLS],
            error: 0.0,
        }
    }

    /// Chooses rules for means of a function to an absolute `error`, from the effect of more nodes along four directions.
    ///
    /// - `facets`: ranges of the central slopes
    /// - `largest`: largest variance
    pub(crate) fn new(
        function: impl Fn([f64; 2]) -> f64 + Sync,
        facets: [[f64; 2]; 2],
        largest: f64,
        error: f64,
    ) -> Self {
        let errors: Vec<Vec<[f64; USED]>> = (0..PLACES * PLACES)
            .into_par_iter()
            .map(|n| {
                let part = [n % PLACES, n / PLACES].map(|n| n as f64 / CELLS as f64);
                let place = [0, 1].map(|axis| {
                    let [first, last] = facets[axis];
                    first + part[axis] * (last - first)
                });
                let of = |n| errors_at(&function, place, deviation(largest, n));
                (0..DEVIATIONS).map(of).collect()
            })
            .collect();
        let cell = |n: usize| -> [f64; USED] {
            let [i, j] = [n % CELLS, n / CELLS];
            let corners = [[i, j], [i + 1, j], [i, j + 1], [i + 1, j + 1]];
            let of_corner = |rule: usize, [i, j]: [usize; 2]| {
                // Both axes may contribute the error.
                let keeps = |e: &&[f64; USED]| 2.0 * e[rule] <= error;
                let at = errors[j * PLACES + i].iter().rev();
                at.take_while(keeps).count()
            };
            std::array::from_fn(|rule| {
                let kept = corners.map(|corner| of_corner(rule, corner));
                match kept.into_iter().min() {
                    None | Some(0) => 0.0,
                    Some(kept) => deviation(largest, DEVIATIONS - kept).powi(2) * (1.0 + 1e-9),
                }
            })
        };
        let last = errors.iter().map(|place| place[0][USED - 1]);
        Self {
            facets,
            largest: (0..CELLS * CELLS).map(cell).collect(),
            error: 2.0 * last.fold(0.0, f64::max),
        }
    }

    /// Stated error of a mean.
    pub(crate) fn error(&self) -> f64 {
        self.error
    }

    /// The rule for a variance.
    #[inline(always)]
    fn rule<'r>(
        rules: &'r [Vec<[f64; 2]>],
        largest: &[f64; USED],
        variance: f64,
    ) -> &'r [[f64; 2]] {
        let fits = largest.iter().position(|&v| variance <= v);
        &rules[fits.unwrap_or(USED - 1)]
    }

    /// Largest variance of each rule for a mean around a slope.
    #[inline(always)]
    fn largest_at(&self, slope: [f64; 2]) -> &[f64; USED] {
        let cell = |axis: usize| {
            let [first, last] = self.facets[axis];
            let part = (slope[axis] - first) / (last - first) * CELLS as f64;
            (part.max(0.0) as usize).min(CELLS - 1)
        };
        &self.largest[cell(1) * CELLS + cell(0)]
    }

    /// Mean of a function over slopes of a given covariance around a central slope.
    #[inline(always)]
    pub(crate) fn around(
        &self,
        covariance: &SlopeCovariance,
        slope: [f64; 2],
        function: impl Fn([f64; 2]) -> f64,
    ) -> f64 {
        let rules = &*RULES;
        let axes = covariance.principal_axes();
        let [deviation_u, deviation_v] = axes.variance.map(f64::sqrt);
        let largest = self.largest_at(slope);
        let along = Self::rule(rules, largest, axes.variance[0]);
        let across = if axes.variance[1] > ROUNDED * axes.variance[0] {
            Self::rule(rules, largest, axes.variance[1])
        } else {
            &rules[0]
        };
        let mut sum = 0.0;
        for [v, weight_v] in across {
            let mut line = 0.0;
            for [u, weight_u] in along {
                let [dx, dy] = axes.slope([u * deviation_u, v * deviation_v]);
                line += weight_u * function([slope[0] + dx, slope[1] + dy]);
            }
            sum += weight_v * line;
        }
        sum
    }
}

/// The `n`-th deviation at which errors are evaluated.
fn deviation(largest: f64, n: usize) -> f64 {
    largest.sqrt() * SQRT_2.powi(-(n as i32))
}

/// Errors of the rules for means around a point along the worst of four directions.
fn errors_at(function: impl Fn([f64; 2]) -> f64, place: [f64; 2], deviation: f64) -> [f64; USED] {
    let mut worst = [0.0f64; USED];
    for turn in 0..4 {
        let (sin, cos) = (FRAC_PI_4 * f64::from(turn)).sin_cos();
        let at = |u: f64| function([place[0] + u * cos, place[1] + u * sin]);
        let mean =
            |rule: &Vec<[f64; 2]>| -> f64 { rule.iter().map(|[z, w]| w * at(z * deviation)).sum() };
        let means: Vec<f64> = RULES.iter().map(mean).collect();
        for (worst, mean) in worst.iter_mut().zip(&means) {
            *worst = worst.max((mean - means[USED]).abs());
        }
    }
    worst
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Moments of a unit Gaussian, 1, 1, 3, 15, …, (2n − 1)!!, up to the omitted nodes.
    #[test]
    fn rules_are_exact_for_powers() {
        assert_eq!(RULES.len(), COUNTS.len());
        for (count, rule) in COUNTS.into_iter().zip(RULES.iter()) {
            let mut expected = 1.0;
            for power in 0..(2 * count).min(12) {
                let moment: f64 = rule.iter().map(|[z, w]| w * z.powi(power as i32)).sum();
                if power % 2 == 1 {
                    assert!(moment.abs() < 1e-3, "{count} {power}");
                    continue;
                }
                // Omitted nodes begin at five deviations, each with a tenth of the previous weight.
                let left_out = 4e-7 * 5.8f64.powi(power as i32);
                assert!(
                    (moment / expected - 1.0).abs() < 1e-12 + left_out / expected,
                    "{count} {power}: {moment}"
                );
                expected *= power as f64 + 1.0;
            }
        }
    }

    /// E exp(cᵀs) = exp(½ cᵀCc), which needs few nodes for small slopes and more for large ones.
    #[test]
    fn means_are_as_exact_as_asked_for() {
        let function = |[x, y]: [f64; 2]| (9.0 * x - 4.0 * y).exp();
        let places: Vec<[f64; 2]> = vec![[0.0; 2], [0.1, 0.0], [-0.1, 0.1]];
        let facets = [[-0.1, 0.1]; 2];
        let largest = 0.02;
        let mut before = None;
        for error in [1e-1, 1e-2, 1e-3] {
            let means = SlopeMeans::new(function, facets, largest, error);
            assert!(means.error() <= error);
            for variance in [0.02, 0.01, 1e-3, 1e-5] {
                for degrees in [0.0f64, 30.0, 77.0, 140.0] {
                    let (sin, cos) = degrees.to_radians().sin_cos();
                    for second in [0.0, 0.3 * variance] {
                        let covariance =
                            SlopeCovariance::along_wind([variance, second], [cos, sin]);
                        let c = &covariance;
                        let square = 81.0 * c.xx - 72.0 * c.xy + 16.0 * c.yy;
                        for &place in &places {
                            let expected = function(place) * (0.5 * square).exp();
                            let found = means.around(&covariance, place, function);
                            // The error of each axis; directions other than the four may double it.
                            assert!(
                                (found - expected).abs() < 4.0 * error,
                                "{error} {variance} {degrees}: {found} {expected}"
                            );
                        }
                    }
                }
            }
            let nodes = |variance: f64| {
                let largest = means.largest_at([0.0; 2]);
                SlopeMeans::rule(&RULES, largest, variance).len()
            };
            assert!(nodes(1e-5) < nodes(0.02), "{error}");
            assert!(before.is_none_or(|fewer| fewer <= nodes(0.02)));
            before = Some(nodes(0.02));
        }
    }
}
