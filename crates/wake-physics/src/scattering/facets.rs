//! Bragg return of plane facets on a lattice of slopes, and its average over tilt.

use crate::scattering::Backscatter;
use crate::scattering::slope_lattice::{SlopeLattice, radius};
use crate::scattering::slopes::PrincipalAxes;
use crate::scattering::table_error::{Weights, interpolation_error};

/// Largest refinement of the lattice on which averages are taken, relative to the facet spacing.
const MOST_REFINEMENT: usize = 16;

/// Bragg return of plane facets on a lattice of slopes, with the parameters of the average.
pub(super) struct Facets {
    pub(super) lattice: SlopeLattice,
    pub(super) std: [f64; 2],
    pub(super) radius: [usize; 2],
}

impl Facets {
    /// Samples facets over a range of slopes, extended by the reach of the average.
    pub(super) fn sample(
        backscatter: &Backscatter,
        axes: &PrincipalAxes,
        range: [[f64; 2]; 2],
        spacing: f64,
    ) -> Self {
        let std = axes.variance.map(f64::sqrt);
        let radius = std.map(|s| radius(s, spacing));
        // Three nodes beyond the range at each end, and an odd number in total, so that every other node spans it too.
        let cells = range.map(|[first, last]| ((last - first) / (2.0 * spacing)).ceil() as usize);
        let nodes = [0, 1].map(|a| 2 * cells[a] + 7 + 2 * radius[a]);
        let start = [0, 1].map(|a| range[a][0] - spacing * (3 + radius[a]) as f64);
        let step = axes.slope([spacing, 0.0]);
        let lattice = SlopeLattice::of_rows(start, spacing, nodes, |first, row| {
            backscatter.two_scale.facets(axes.slope(first), step, row);
        });
        Self {
            lattice,
            std,
            radius,
        }
    }

    /// The tilt average on a lattice fine enough for the given interpolation error, if one exists.
    pub(super) fn averaged(&self, error: f64, weights: &Weights, most_nodes: usize) -> Average {
        let lattice = self.lattice.smoothed(self.std, self.radius, 1);
        let largest = lattice.values.iter().fold(0.0f64, |a, b| a.max(b.abs()));
        let averaging = self.averaging_error(&lattice, largest, weights);
        let interpolation = interpolation_error(&lattice, weights);
        let mut average = Average {
            lattice,
            largest,
            error: averaging + interpolation,
        };
        let refinement = (1.1 * (interpolation / (error - averaging)).powf(0.25)).ceil();
        let resolved = self.std.iter().all(|&s| s >= self.lattice.step);
        let finest = (most_nodes as f64 / average.lattice.values.len() as f64).sqrt();
        let refinement = refinement.min(finest.floor());
        if resolved && averaging < error && refinement > 1.0 {
            let refinement = (refinement as usize).min(MOST_REFINEMENT);
            average.lattice = self.lattice.smoothed(self.std, self.radius, refinement);
            average.error = averaging + interpolation_error(&average.lattice, weights);
        }
        average
    }

    /// Error of the averages, from the largest difference made by leaving out every other facet.
    pub(super) fn averaging_error(
        &self,
        average: &SlopeLattice,
        largest: f64,
        weights: &Weights,
    ) -> f64 {
        let half = self.radius.map(|r| r / 2);
        let coarse = self.lattice.every_other().smoothed(self.std, half, 1);
        let fine = average.every_other();
        let pairs = fine.values.iter().zip(&coarse.values).enumerate();
        let difference = pairs.fold(0.0f64, |most, (n, (a, b))| {
            most.max((a - b).abs() * weights.at(fine.place(n)))
        });
        if difference > 0.0 {
            difference * (difference / largest).cbrt()
        } else {
            0.0
        }
    }
}

/// Bragg return averaged over tilt.
pub(super) struct Average {
    pub(super) lattice: SlopeLattice,
    /// Largest value.
    pub(super) largest: f64,
    /// Stated total error of the averages and their interpolation.
    pub(super) error: f64,
}

impl Average {
    /// Factor on the facet spacing that should reduce the error to `error`, assuming that ln(error/largest) is inversely
    /// proportional to the spacing.
    pub(super) fn next_spacing(&self, error: f64) -> f64 {
        let factor = (self.error / self.largest).ln() / (error / self.largest).ln();
        if factor > 0.0 {
            factor.clamp(0.5, 0.85)
        } else {
            0.5
        }
    }
}
