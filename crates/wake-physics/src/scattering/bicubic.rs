//! Bicubic interpolation on a lattice.

use crate::scattering::lattice::Lattice;

/// Lagrange interpolation through four by four nodes: exact for cubics, of fourth order in the step.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Bicubic {
    start: [f64; 2],
    inverse_step: f64,
    nodes: [usize; 2],
    values: Vec<f32>,
}

impl Bicubic {
    pub(crate) fn through(lattice: &Lattice) -> Self {
        Self {
            start: lattice.start,
            inverse_step: 1.0 / lattice.step,
            nodes: lattice.nodes,
            values: lattice.values.iter().map(|&v| v as f32).collect(),
        }
    }

    /// The value at a point; `None` less than one cell from the edge of the lattice, and outside it.
    #[inline]
    pub(crate) fn at(&self, [u, v]: [f64; 2]) -> Option<f32> {
        let (i, s) = cell((u - self.start[0]) * self.inverse_step, self.nodes[0])?;
        let (j, t) = cell((v - self.start[1]) * self.inverse_step, self.nodes[1])?;
        let (along, across) = (weights(s), weights(t));
        let mut sum = [0.0f32; 4];
        for (r, weight) in across.iter().enumerate() {
            let row = self.values[(j + r) * self.nodes[0] + i..].first_chunk::<4>()?;
            for n in 0..4 {
                sum[n] += weight * row[n];
            }
        }
        Some(along[0] * sum[0] + along[1] * sum[1] + along[2] * sum[2] + along[3] * sum[3])
    }
}

/// First of the four nodes around a position, and the position between the middle two, 0 to 1.
#[inline]
fn cell(position: f64, nodes: usize) -> Option<(usize, f32)> {
    if position >= 1.0 && position <= nodes as f64 - 2.0 {
        // The last admitted position is the right end of the last cell.
        let node = (position as usize).min(nodes - 3);
        return Some((node - 1, (position - node as f64) as f32));
    }
    None
}

/// Weights of the nodes −1, 0, 1, 2 at t between 0 and 1.
#[inline]
fn weights(t: f32) -> [f32; 4] {
    let (before, after, far) = (t + 1.0, 1.0 - t, 2.0 - t);
    [
        -t * after * far * (1.0 / 6.0),
        before * after * far * 0.5,
        before * t * far * 0.5,
        -before * t * after * (1.0 / 6.0),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cubics_are_exact_and_edges_are_out() {
        let cubic = |[u, v]: [f64; 2]| (u.powi(3) - 2.0 * u) * (1.0 - v * v + 0.5 * v.powi(3));
        let table = Bicubic::through(&Lattice::sample([-1.0, -0.5], 0.25, [9, 6], cubic));
        for point in [[-0.75, -0.25], [0.0, 0.1], [0.75, 0.5], [0.3, 0.33]] {
            let value = f64::from(table.at(point).unwrap());
            // Rounding of f32 nodes of size 1.
            assert!((value - cubic(point)).abs() < 1e-6, "{point:?} {value}");
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
            let table = Bicubic::through(&Lattice::sample([-1.0; 2], step, [nodes; 2], wave));
            (0..400)
                .map(|n| {
                    [
                        f64::from(n % 20) * 0.05 - 0.5,
                        f64::from(n / 20) * 0.05 - 0.5,
                    ]
                })
                .map(|p| [p[0] + 0.013, p[1] + 0.007])
                .map(|p| (f64::from(table.at(p).unwrap()) - wave(p)).abs())
                .fold(0.0, f64::max)
        };
        let order = (error(0.2) / error(0.1)).log2();
        assert!((order - 4.0).abs() < 0.4, "{order}");
    }
}
