//! Bicubic interpolation on a lattice.

use crate::scattering::slope_lattice::SlopeLattice;

/// Lagrange interpolation through four by four nodes: exact for cubics, of fourth order in the step.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Bicubic {
    start: [f64; 2],
    inverse_step: f64,
    nodes: [usize; 2],
    values: Vec<f64>,
}

impl Bicubic {
    pub(crate) fn nodes(&self) -> [usize; 2] {
        self.nodes
    }

    pub(crate) fn through(lattice: SlopeLattice) -> Self {
        Self {
            start: lattice.start,
            inverse_step: 1.0 / lattice.step,
            nodes: lattice.nodes,
            values: lattice.values,
        }
    }

    /// The value at a point; `None` outside the lattice or less than one cell from its edge.
    #[inline(always)]
    pub(crate) fn at(&self, [u, v]: [f64; 2]) -> Option<f64> {
        let (i, s) = cell((u - self.start[0]) * self.inverse_step, self.nodes[0])?;
        let (j, t) = cell((v - self.start[1]) * self.inverse_step, self.nodes[1])?;
        let (along, across) = (weights(s), weights(t));
        // Four columns at once, then across them.
        let mut sums = [0.0; 4];
        for (r, weight) in across.iter().enumerate() {
            let row = *self.values[(j + r) * self.nodes[0] + i..].first_chunk::<4>()?;
            sums = std::array::from_fn(|n| sums[n] + weight * row[n]);
        }
        let terms: [f64; 4] = std::array::from_fn(|n| along[n] * sums[n]);
        Some((terms[0] + terms[2]) + (terms[1] + terms[3]))
    }
}

/// First of the four nodes around a position, and the position between the middle two, 0 to 1.
#[inline(always)]
fn cell(position: f64, nodes: usize) -> Option<(usize, f64)> {
    if position >= 1.0 && position <= nodes as f64 - 2.0 {
        // The last valid position is the right end of the last cell.
        let node = (position as usize).min(nodes - 3);
        return Some((node - 1, position - node as f64));
    }
    None
}

/// Coefficients of t³, t², t and 1 in the weights of the nodes −1, 0, 1, 2.
const WEIGHTS: [[f64; 4]; 4] = [
    [-1.0 / 6.0, 0.5, -0.5, 1.0 / 6.0],
    [0.5, -1.0, 0.5, 0.0],
    [-1.0 / 3.0, -0.5, 1.0, -1.0 / 6.0],
    [0.0, 1.0, 0.0, 0.0],
];

/// Weights of the nodes −1, 0, 1, 2 at t between 0 and 1, all four at once.
#[inline(always)]
fn weights(t: f64) -> [f64; 4] {
    let [a, b, c, d] = &WEIGHTS;
    std::array::from_fn(|n| ((a[n] * t + b[n]) * t + c[n]) * t + d[n])
}

#[cfg(test)]
#[allow(
    clippy::float_cmp,
    reason = "exact zeros and values that nothing may change"
)]
mod tests {
    use super::*;

    #[test]
    fn cubics_are_exact_and_edges_are_out() {
        let cubic = |[u, v]: [f64; 2]| (u.powi(3) - 2.0 * u) * (1.0 - v * v + 0.5 * v.powi(3));
        let table = Bicubic::through(SlopeLattice::sample([-1.0, -0.5], 0.25, [9, 6], cubic));
        for point in [[-0.75, -0.25], [0.0, 0.1], [0.75, 0.5], [0.3, 0.33]] {
            let value = table.at(point).unwrap();
            assert!((value - cubic(point)).abs() < 1e-14, "{point:?} {value}");
        }
        for point in [
            [-0.76, 0.0],
            [0.76, 0.0],
            [0.0, -0.26],
            [0.0, 0.51],
            [f64::NAN, 0.0],
        ] {
            assert_eq!(table.at(point), None);
        }
    }

    #[test]
    fn error_falls_with_the_fourth_power_of_the_step() {
        let wave = |[u, v]: [f64; 2]| (3.0 * u + 2.0 * v).sin();
        let error = |step: f64| {
            let nodes = (2.0 / step) as usize + 1;
            let table = Bicubic::through(SlopeLattice::sample([-1.0; 2], step, [nodes; 2], wave));
            (0..400)
                .map(|n| {
                    [
                        f64::from(n % 20) * 0.05 - 0.5,
                        f64::from(n / 20) * 0.05 - 0.5,
                    ]
                })
                .map(|p| [p[0] + 0.013, p[1] + 0.007])
                .map(|p| (table.at(p).unwrap() - wave(p)).abs())
                .fold(0.0, f64::max)
        };
        let order = (error(0.2) / error(0.1)).log2();
        assert!((order - 4.0).abs() < 0.4, "{order}");
    }
}
