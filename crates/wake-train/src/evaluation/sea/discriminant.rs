//! A linear discriminant between real and other windows of sea, by groups of features.

use serde::Serialize;
use wake_physics::Field;

use super::features::{feature_groups, features};

/// Share of the pooled variance that is added to every variance, since features may depend on each other and windows are few.
const RIDGE: f64 = 0.1;
/// Standard errors on each side of a 95 % interval.
const STANDARD_ERRORS: f64 = 1.96;

/// Accuracy of a linear discriminant of a group of features.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GroupAccuracy {
    /// Name of the group, or "all".
    pub group: &'static str,
    /// Mean over the images left out of the shares of real and of other windows that are classified correctly: ½ where the kinds
    /// are alike, 1 where no window is mistaken.
    pub accuracy: f64,
    /// Half-width of its 95 % interval, from the spread over the images left out.
    pub half_width: f64,
}

/// Accuracy of Fisher's linear discriminant between windows of real images and others, by groups of features and by all of them.
///
/// Each real image is left out in turn, together with its share of the others.
///
/// - `real`: the windows of each image, at least two images that have some
/// - `others`: at least as many windows as images
///
/// # References
///
/// Fisher (1936), "The use of multiple measurements in taxonomic problems".
#[must_use]
pub fn discriminant(real: &[Vec<Field>], others: &[Field]) -> Vec<GroupAccuracy> {
    let numbers = |windows: &[Field]| -> Vec<Vec<f64>> { windows.iter().map(features).collect() };
    let real: Vec<Vec<Vec<f64>>> = real
        .iter()
        .filter(|windows| !windows.is_empty())
        .map(|windows| numbers(windows))
        .collect();
    let others = numbers(others);
    let mut groups: Vec<_> = feature_groups()
        .into_iter()
        .map(|group| (group.name, group.places))
        .collect();
    let end = groups.last().map_or(0, |(_, places)| places.end);
    groups.push(("all", 0..end));
    groups
        .into_iter()
        .map(|(group, places)| {
            let only = |all: &Vec<f64>| all[places.clone()].to_vec();
            let real: Vec<Vec<Vec<f64>>> = real
                .iter()
                .map(|image| image.iter().map(only).collect())
                .collect();
            let others: Vec<Vec<f64>> = others.iter().map(only).collect();
            let [accuracy, half_width] = left_out(&real, &others);
            GroupAccuracy {
                group,
                accuracy,
                half_width,
            }
        })
        .collect()
}

/// Accuracy and half-width of its interval over the images left out.
fn left_out(real: &[Vec<Vec<f64>>], others: &[Vec<f64>]) -> [f64; 2] {
    let folds = real.len();
    let accuracy = |out: usize| {
        let rest = real.iter().enumerate().filter(|(n, _)| *n != out);
        let learnt: Vec<&Vec<f64>> = rest.flat_map(|(_, image)| image).collect();
        let fold = |mine: bool| -> Vec<&Vec<f64>> {
            let of = others.iter().enumerate();
            of.filter(|(n, _)| (n % folds == out) == mine)
                .map(|(_, window)| window)
                .collect()
        };
        let line = Line::between(&learnt, &fold(false));
        let tested: Vec<&Vec<f64>> = real[out].iter().collect();
        0.5 * (share(&tested, |x| line.at(x) > 0.0) + share(&fold(true), |x| line.at(x) <= 0.0))
    };
    let all: Vec<f64> = (0..folds).map(accuracy).collect();
    let count = folds.max(1) as f64;
    let mean = all.iter().sum::<f64>() / count;
    let squares: f64 = all.iter().map(|a| (a - mean).powi(2)).sum();
    let error = (squares / (count - 1.0).max(1.0) / count).sqrt();
    [mean, STANDARD_ERRORS * error]
}

fn share(windows: &[&Vec<f64>], right: impl Fn(&[f64]) -> bool) -> f64 {
    let count = windows.iter().filter(|window| right(window)).count();
    count as f64 / windows.len().max(1) as f64
}

/// A direction, and the midpoint between two means.
struct Line {
    middle: Vec<f64>,
    direction: Vec<f64>,
}

impl Line {
    /// Fisher's direction w = (S + 0.1 diag S)⁻¹ (m₁ − m₂), S the mean of both covariances.
    fn between(first: &[&Vec<f64>], second: &[&Vec<f64>]) -> Self {
        let count = first.first().or(second.first()).map_or(0, |x| x.len());
        let mean = |windows: &[&Vec<f64>]| -> Vec<f64> {
            let sum = |n: usize| windows.iter().map(|x| x[n]).sum::<f64>();
            (0..count)
                .map(|n| sum(n) / windows.len().max(1) as f64)
                .collect()
        };
        let means = [mean(first), mean(second)];
        let covariance = |a: usize, b: usize| -> f64 {
            let of = |windows: &[&Vec<f64>], mean: &[f64]| {
                let product = |x: &&Vec<f64>| (x[a] - mean[a]) * (x[b] - mean[b]);
                windows.iter().map(product).sum::<f64>() / windows.len().max(1) as f64
            };
            0.5 * (of(first, &means[0]) + of(second, &means[1]))
        };
        let mut matrix: Vec<Vec<f64>> = (0..count)
            .map(|a| (0..count).map(|b| covariance(a, b)).collect())
            .collect();
        for (n, row) in matrix.iter_mut().enumerate() {
            row[n] = row[n] * (1.0 + RIDGE) + 1e-12;
        }
        let apart = (0..count).map(|n| means[0][n] - means[1][n]).collect();
        Self {
            middle: (0..count)
                .map(|n| 0.5 * (means[0][n] + means[1][n]))
                .collect(),
            direction: solved(matrix, apart),
        }
    }

    /// Position along the direction, above 0 on the side of the first mean.
    fn at(&self, x: &[f64]) -> f64 {
        let off = x.iter().zip(&self.middle).map(|(x, m)| x - m);
        off.zip(&self.direction).map(|(x, w)| x * w).sum()
    }
}

/// The solution of a positive definite system, by Gauss's elimination.
fn solved(mut matrix: Vec<Vec<f64>>, mut right: Vec<f64>) -> Vec<f64> {
    let count = right.len();
    for n in 0..count {
        let pivot = matrix[n].clone();
        for below in n + 1..count {
            let factor = matrix[below][n] / pivot[n];
            for (value, above) in matrix[below].iter_mut().zip(&pivot) {
                *value -= factor * above;
            }
            right[below] -= factor * right[n];
        }
    }
    for n in (0..count).rev() {
        let known: f64 = (n + 1..count).map(|m| matrix[n][m] * right[m]).sum();
        right[n] = (right[n] - known) / matrix[n][n];
    }
    right
}

#[cfg(test)]
mod tests {
    use super::*;
    use wake_nn::noise::NoiseSource;

    #[test]
    fn a_system_is_solved() {
        let matrix = vec![
            vec![4.0, 1.0, 0.5],
            vec![1.0, 3.0, -0.2],
            vec![0.5, -0.2, 2.0],
        ];
        let x = solved(matrix.clone(), vec![1.0, -2.0, 0.3]);
        for (row, right) in matrix.iter().zip([1.0, -2.0, 0.3]) {
            let left: f64 = row.iter().zip(&x).map(|(a, x)| a * x).sum();
            assert!((left - right).abs() < 1e-14);
        }
    }

    /// Windows of noise, smooth along rows where `smooth`.
    fn windows(first: u64, count: u64, smooth: bool) -> Vec<Field> {
        let side = 64;
        let window = |seed: u64| {
            let white = NoiseSource::new(seed).normal(0, side * side + 1);
            let value = |n: usize| match smooth {
                true => 100.0 + 14.0 * (white[n] + white[n + 1]),
                false => 100.0 + 20.0 * white[n],
            };
            Field {
                rows: side,
                columns: side,
                values: (0..side * side).map(|n| value(n).round()).collect(),
            }
        };
        (first..first + count).map(window).collect()
    }

    /// Two sets of one kind are classified with an accuracy of ½, within four errors of a share of 48 windows, √(¼/48); smoothed
    /// noise is always classified correctly by its power near Nyquist.
    #[test]
    fn kinds_that_differ_are_told_apart_by_what_differs() {
        let real: Vec<Vec<Field>> = (0..6).map(|n| windows(8 * n, 8, false)).collect();
        for row in discriminant(&real, &windows(1000, 48, false)) {
            assert!((row.accuracy - 0.5).abs() < 4.0 * 0.072, "{row:?}");
        }
        let rows = discriminant(&real, &windows(1000, 48, true));
        let accuracy = |name: &str| {
            let row = rows.iter().find(|row| row.group.starts_with(name));
            row.expect("a row").accuracy
        };
        assert!(
            accuracy("power") > 0.99 && accuracy("all") > 0.99,
            "{rows:?}"
        );
        // Neither kind has blocks.
        assert!((accuracy("JPEG") - 0.5).abs() < 4.0 * 0.072, "{rows:?}");
    }
}
