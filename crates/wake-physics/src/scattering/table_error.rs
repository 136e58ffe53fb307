//! Errors of an interpolation on a lattice of slopes, and their weights by position.

use crate::scattering::bicubic::Bicubic;
use crate::scattering::slope_lattice::SlopeLattice;
use rayon::prelude::*;

/// Cells in which a table of plane facets is compared with the facets themselves.
const CHECKED: usize = 64;

/// Largest error of a mean over that of a table with [`Weights`]: ∫ x e^{−x²/2}/w dx = ¾ + ½, with w = 1 up to x² = 4 ln 2.
pub(crate) const OF_MEANS: f64 = 1.25;

/// Weight of the error of a table, by position.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Weights {
    /// Ranges of the facets' own slopes along the axes.
    pub(crate) facets: [[f64; 2]; 2],
    /// Largest variance of additional subpixel slopes.
    pub(crate) variance: f64,
}

impl Weights {
    /// Weight 1 within the range of facets; beyond it at most
    ///
    /// ```text
    /// 2 exp(−d²/4σ²)
    /// ```
    ///
    /// at the distance d, because only means reach there, with a density that falls as exp(−d²/2σ²): see [`OF_MEANS`].
    pub(crate) fn at(&self, point: [f64; 2]) -> f64 {
        if self.variance <= 0.0 {
            return 1.0;
        }
        let beyond = |axis: usize| {
            let [first, last] = self.facets[axis];
            (first - point[axis]).max(point[axis] - last).max(0.0)
        };
        let square = beyond(0).powi(2) + beyond(1).powi(2);
        (2.0 * (-0.25 * square / self.variance).exp()).min(1.0)
    }
}

/// An eighth of the largest difference between a lattice and the interpolation of its every other node, at the centres of
/// the coarse cells.
pub(crate) fn interpolation_error(lattice: &SlopeLattice, weights: &Weights) -> f64 {
    let coarse = Bicubic::through(lattice.every_other());
    let mut difference = 0.0f64;
    for j in (1..lattice.nodes[1]).step_by(2) {
        let v = lattice.start[1] + lattice.step * j as f64;
        for i in (1..lattice.nodes[0]).step_by(2) {
            let u = lattice.start[0] + lattice.step * i as f64;
            if let Some(other) = coarse.at([u, v]) {
                let value = lattice.values[j * lattice.nodes[0] + i];
                difference = difference.max((other - value).abs() * weights.at([u, v]));
            }
        }
    }
    difference / 8.0
}

/// Largest difference between a function and the interpolation of its values, at points between the nodes of the cells
/// where the second differences are largest.
pub(crate) fn error_between_nodes(
    lattice: &SlopeLattice,
    function: impl Fn([f64; 2]) -> f64 + Sync,
) -> f64 {
    let [columns, rows] = lattice.nodes;
    let at = |i: usize, j: usize| lattice.values[j * columns + i];
    let bend = |(i, j): (usize, usize)| {
        let along = at(i - 1, j) - 2.0 * at(i, j) + at(i + 1, j);
        let across = at(i, j - 1) - 2.0 * at(i, j) + at(i, j + 1);
        along.abs().max(across.abs())
    };
    let inner = (2..rows.saturating_sub(2))
        .flat_map(|j| (2..columns.saturating_sub(2)).map(move |i| (i, j)));
    let mut worst: Vec<(f64, (usize, usize))> = inner.map(|node| (bend(node), node)).collect();
    let kept = CHECKED.min(worst.len());
    if kept == 0 {
        return 0.0;
    }
    worst.select_nth_unstable_by(kept - 1, |a, b| b.0.total_cmp(&a.0));
    let table = Bicubic::through(lattice.clone());
    let points = worst[..kept].iter().flat_map(|&(_, (i, j))| {
        // On the four sides of the node, and between these.
        [
            (-0.5, 0.0),
            (0.5, 0.0),
            (0.0, -0.5),
            (0.0, 0.5),
            (-0.5, -0.5),
            (0.5, 0.5),
            (-0.25, 0.25),
            (0.25, -0.25),
        ]
        .map(|(u, v)| {
            [
                lattice.start[0] + lattice.step * (i as f64 + u),
                lattice.start[1] + lattice.step * (j as f64 + v),
            ]
        })
    });
    let points: Vec<[f64; 2]> = points.collect();
    let difference = |&point: &[f64; 2]| {
        let found = table.at(point).unwrap_or(0.0).max(0.0);
        (found - function(point)).abs()
    };
    points.par_iter().map(difference).reduce(|| 0.0, f64::max)
}

#[cfg(test)]
#[allow(
    clippy::float_cmp,
    reason = "weights of 1, and those of mirrored places"
)]
mod tests {
    use super::*;

    /// ∫ x e^{−x²/2}/w dx with w the weight x deviations away: the largest allowed errors everywhere add up to the allowed
    /// error.
    #[test]
    fn errors_beyond_the_facets_count_as_means_look_there() {
        let weights = Weights {
            facets: [[-0.1, 0.2], [-0.3, 0.1]],
            variance: 0.01,
        };
        assert_eq!(weights.at([0.2, -0.3]), 1.0);
        let step = 1e-3;
        let sum: f64 = (0..10_000)
            .map(|n| step * (f64::from(n) + 0.5))
            .map(|x| x * (-0.5 * x * x).exp() / weights.at([0.2 + 0.1 * x, 0.0]))
            .sum();
        assert!((sum * step - OF_MEANS).abs() < 1e-5, "{}", sum * step);
        assert!(weights.at([-0.4, 0.0]) < weights.at([-0.3, 0.0]));
        assert_eq!(weights.at([-0.3, 0.0]), weights.at([0.0, 0.3]));
    }
}
