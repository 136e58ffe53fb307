//! A function of two slopes on a lattice, and its mean over Gaussian slopes.

use rayon::prelude::*;
use std::f64::consts::PI;

/// Values at the nodes `start + step·(i, j)`, with the first index varying fastest.
#[derive(Debug, Clone)]
pub(crate) struct SlopeLattice {
    pub start: [f64; 2],
    pub step: f64,
    pub nodes: [usize; 2],
    pub values: Vec<f64>,
}

impl SlopeLattice {
    /// Samples a function, row by row in parallel.
    ///
    /// - `fill`: writes the values of a row, given the coordinates of its first node
    pub(crate) fn of_rows(
        start: [f64; 2],
        step: f64,
        nodes: [usize; 2],
        fill: impl Fn([f64; 2], &mut [f64]) + Sync,
    ) -> Self {
        let mut values = vec![0.0; nodes[0] * nodes[1]];
        values
            .par_chunks_mut(nodes[0])
            .enumerate()
            .for_each(|(j, row)| fill([start[0], start[1] + step * j as f64], row));
        Self {
            start,
            step,
            nodes,
            values,
        }
    }

    /// Samples a function, node by node.
    #[cfg(test)]
    pub(crate) fn sample(
        start: [f64; 2],
        step: f64,
        nodes: [usize; 2],
        function: impl Fn([f64; 2]) -> f64 + Sync,
    ) -> Self {
        Self::of_rows(start, step, nodes, |[u, v], row| {
            for (i, value) in row.iter_mut().enumerate() {
                *value = function([u + step * i as f64, v]);
            }
        })
    }

    /// Coordinates of node `n`, in the order of the values.
    pub(crate) fn place(&self, n: usize) -> [f64; 2] {
        let [i, j] = [n % self.nodes[0], n / self.nodes[0]];
        [
            self.start[0] + self.step * i as f64,
            self.start[1] + self.step * j as f64,
        ]
    }

    /// Every other node of both coordinates, from the first.
    pub(crate) fn every_other(&self) -> Self {
        let nodes = self.nodes.map(|n| n.div_ceil(2));
        let values = (0..nodes[1])
            .flat_map(|j| (0..nodes[0]).map(move |i| (2 * i, 2 * j)))
            .map(|(i, j)| self.values[j * self.nodes[0] + i])
            .collect();
        Self {
            start: self.start,
            step: 2.0 * self.step,
            nodes,
            values,
        }
    }

    /// Mean over independent Gaussian shifts of standard deviations `std` along the two coordinates, on a lattice
    /// `refinement` times finer (1 if a standard deviation is below the step).
    ///
    /// The result loses `radius` nodes at each end of a coordinate, which must be at least [`radius`].
    pub(crate) fn smoothed(&self, std: [f64; 2], radius: [usize; 2], refinement: usize) -> Self {
        let bases = [0, 1].map(|a| self.nodes[a] - 2 * radius[a]);
        let nodes = bases.map(|b| (b - 1) * refinement + 1);
        let [along, across] =
            [0, 1].map(|a| Phases::new(std[a] / self.step, radius[a], refinement));
        let mut rows = vec![0.0; nodes[0] * self.nodes[1]];
        rows.par_chunks_mut(nodes[0])
            .zip(self.values.par_chunks(self.nodes[0]))
            .for_each(|(out, row)| along.smooth_row(row, bases[0], out));
        let mut values = vec![0.0; nodes[0] * nodes[1]];
        values
            .par_chunks_mut(nodes[0])
            .enumerate()
            .for_each(|(j, out)| across.sum_rows(&rows, j, out));
        Self {
            start: [0, 1].map(|a| self.start[a] + self.step * radius[a] as f64),
            step: self.step / refinement as f64,
            nodes,
            values,
        }
    }
}

/// Nodes on either side needed for the mean over a Gaussian of standard deviation `std`. The number is even, so that every
/// other node serves for twice the step.
pub(crate) fn radius(std: f64, step: f64) -> usize {
    if std <= 0.0 {
        return 0;
    }
    2 * (0.5 * (6.0 * std / step + 1.0)).max(2.0).ceil() as usize
}

/// Weights of a Gaussian mean at a node and at the points that subdivide the following step.
struct Phases {
    weights: Vec<Vec<f64>>,
}

impl Phases {
    /// Weights for every subdivision of a step.
    ///
    /// - `ratio` standard deviation over step
    fn new(ratio: f64, radius: usize, refinement: usize) -> Self {
        let phase = |r: usize| weights(ratio, radius, r as f64 / refinement as f64);
        Self {
            weights: (0..refinement).map(phase).collect(),
        }
    }

    /// Mean along a row, from `bases` nodes.
    fn smooth_row(&self, row: &[f64], bases: usize, out: &mut [f64]) {
        let refinement = self.weights.len();
        let mut sums = vec![0.0; bases];
        for (phase, weights) in self.weights.iter().enumerate() {
            sums.fill(0.0);
            for (k, &weight) in weights.iter().enumerate() {
                add(&mut sums, weight, &row[k..k + bases]);
            }
            for (o, &sum) in out[phase..].iter_mut().step_by(refinement).zip(&sums) {
                *o = sum;
            }
        }
    }

    /// Mean across rows of the length of `out`, at refined row `j`.
    fn sum_rows(&self, rows: &[f64], j: usize, out: &mut [f64]) {
        let (base, phase) = (j / self.weights.len(), j % self.weights.len());
        let rows = rows[base * out.len()..].chunks(out.len());
        for (row, &weight) in rows.zip(&self.weights[phase]) {
            add(out, weight, row);
        }
    }
}

fn add(sums: &mut [f64], weight: f64, values: &[f64]) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum += weight * value;
    }
}

/// Weights of 2·`radius` + 1 nodes for the mean over a Gaussian of standard deviation `ratio` steps, centred `offset` steps
/// after the middle node.
///
/// The weights are samples of the Gaussian where the step resolves it (trapezoidal rule, exact to e^{−2π²} = 3e-9 for the
/// sharpest function on the lattice). Otherwise, without offset, they are the five weights with the Gaussian's moments 1,
/// σ² and 3σ⁴, exact for polynomials of degree 5.
fn weights(ratio: f64, radius: usize, offset: f64) -> Vec<f64> {
    let distance = |n: usize| n as f64 - radius as f64 - offset;
    let q = ratio * ratio;
    if ratio >= 1.0 {
        let scale = 1.0 / (ratio * (2.0 * PI).sqrt());
        let gaussian = |n: usize| scale * (-0.5 * distance(n).powi(2) / q).exp();
        return (0..=2 * radius).map(gaussian).collect();
    }
    let near = q * (4.0 - 3.0 * q) / 6.0;
    let far = q * (3.0 * q - 1.0) / 24.0;
    let weight = |n: usize| match n.abs_diff(radius) {
        0 => 1.0 - 2.0 * (near + far),
        1 => near,
        2 => far,
        _ => 0.0,
    };
    (0..=2 * radius).map(weight).collect()
}

#[cfg(test)]
#[allow(
    clippy::float_cmp,
    reason = "exact zeros and values that nothing may change"
)]
mod tests {
    use super::*;

    /// E[exp(a u + b v)] over independent Gaussians is exp((a²σu² + b²σv²)/2) with either rule, at the nodes and between
    /// them.
    #[test]
    fn means_of_exponentials() {
        let (a, b) = (1.3f64, -0.7f64);
        // Wide, narrow and no spread; the five weights err by (15σ⁶ − 11 h⁶) a⁶/720, below 2e-9 here.
        for (std, refinement) in [([0.1, 0.06], 3), ([0.02, 0.1], 1), ([0.0, 0.01], 1)] {
            let step = 0.03;
            let radius = std.map(|s| radius(s, step));
            let nodes = radius.map(|r| 2 * r + 7);
            let lattice =
                SlopeLattice::sample([-0.2, 0.1], step, nodes, |[u, v]| (a * u + b * v).exp());
            let mean = lattice.smoothed(std, radius, refinement);
            assert_eq!(mean.nodes, [6 * refinement + 1; 2]);
            let gain = (0.5 * ((a * std[0]).powi(2) + (b * std[1]).powi(2))).exp();
            for j in 0..mean.nodes[1] {
                for i in 0..mean.nodes[0] {
                    let u = mean.start[0] + mean.step * i as f64;
                    let v = mean.start[1] + mean.step * j as f64;
                    let value = mean.values[j * mean.nodes[0] + i];
                    let ratio = value / ((a * u + b * v).exp() * gain);
                    assert!((ratio - 1.0).abs() < 1e-8, "{std:?} {ratio}");
                }
            }
        }
    }

    #[test]
    fn every_other_node_keeps_places() {
        let lattice = SlopeLattice::sample([1.0, 2.0], 0.5, [5, 3], |[u, v]| 10.0 * u + v);
        let coarse = lattice.every_other();
        assert_eq!(coarse.nodes, [3, 2]);
        for j in 0..2 {
            for i in 0..3 {
                let (u, v) = (1.0 + i as f64, 2.0 + j as f64);
                assert!((coarse.values[j * 3 + i] - (10.0 * u + v)).abs() < 1e-12);
            }
        }
    }

    /// Six standard deviations on either side, plus one step for the points between nodes; even, and at least two at both
    /// the step and twice the step.
    #[test]
    fn means_reach_six_standard_deviations() {
        for (std, step) in [(0.1, 0.03), (0.2, 0.02), (0.05, 0.05), (0.06, 0.017)] {
            let needed = 6.0 * std / step + 1.0;
            let found = radius(std, step);
            assert!(found.is_multiple_of(2), "{std} {step}");
            assert!(
                found as f64 >= needed && (found as f64) < needed + 2.0,
                "{std} {step}: {found}"
            );
        }
        assert_eq!([radius(0.0, 0.1), radius(1e-3, 0.1)], [0, 4]);
    }
}
