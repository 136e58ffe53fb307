//! Choice of kernel, lattice and precision: the fastest combination that meets the demanded error.

use super::kernel::{Kernel, WIDEST};
use crate::raster::Raster;

/// Oversampling factors tried: finer lattices cost transforms; coarser ones need wider kernels and round more.
const OVERSAMPLING: [f64; 5] = [1.2, 1.35, 1.5, 1.75, 2.0];

/// Largest rounding error at a pixel, over (machine epsilon · root sum of squares of the strengths), as
/// ROUNDING[0] + ROUNDING[1]·amplification²; measured, see the tests.
const ROUNDING: [f64; 2] = [12.0, 1.2];

/// Sum of the magnitudes and root sum of squares of a field's strengths.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Size {
    pub(crate) sum: f64,
    pub(crate) root: f64,
}

impl Size {
    /// Root mean square of waves with unrelated phases.
    pub(crate) fn expected_rms(self) -> f64 {
        self.root * std::f64::consts::FRAC_1_SQRT_2
    }
}

/// Kernel, lattice and precision of one synthesis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Gridding {
    /// The kernel.
    pub(crate) kernel: Kernel,
    /// Points of the lattice along y and along x.
    pub(crate) lattice: [usize; 2],
    /// Whether the transform runs in `f64`.
    pub(crate) double_precision: bool,
}

/// Allowed error of the fields, relative to the sizes of their strengths.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Demand {
    /// Error over the sum of |strength|.
    aliases: f64,
    /// Error over the root sum of squares.
    rounding: f64,
}

impl Demand {
    /// Strictest demand that keeps `tolerance`·rms for every field, half for aliases and half for rounding.
    pub(crate) fn strictest(fields: impl Iterator<Item = (Size, f64)>, tolerance: f64) -> Self {
        let mut demand = Self {
            aliases: 1.0,
            rounding: 1.0,
        };
        for (size, rms) in fields {
            let error = 0.5 * tolerance * rms;
            demand.aliases = demand.aliases.min(error / size.sum);
            demand.rounding = demand.rounding.min(error / size.root);
        }
        demand
    }
}

impl Gridding {
    /// The cheapest gridding that meets a demand, or the most accurate one if none does.
    ///
    /// - `counts`: number of waves and of fields
    pub(crate) fn fastest(demand: &Demand, raster: &Raster, counts: [usize; 2]) -> Self {
        let mut best = Self::new(1e-13, 2.0, raster, true);
        let mut cost = f64::INFINITY;
        for oversampling in OVERSAMPLING {
            let single = Self::new(0.5 * demand.aliases, oversampling, raster, false);
            let double = Self {
                double_precision: true,
                ..single
            };
            for gridding in [single, double] {
                let meets = 2.0 * gridding.kernel.error <= demand.aliases
                    && gridding.rounding() <= demand.rounding;
                if meets && gridding.cost(counts) < cost {
                    cost = gridding.cost(counts);
                    best = gridding;
                }
            }
        }
        best
    }

    pub(crate) fn new(
        error: f64,
        oversampling: f64,
        raster: &Raster,
        double_precision: bool,
    ) -> Self {
        let lattice = [raster.rows, raster.columns].map(|n| {
            let half = (0.5 * oversampling * n as f64).ceil() as usize;
            lattice_length(2 * half.max(WIDEST))
        });
        let actual =
            (lattice[0] as f64 / raster.rows as f64).min(lattice[1] as f64 / raster.columns as f64);
        Self {
            kernel: Kernel::new(error, actual.min(4.0)),
            lattice,
            double_precision,
        }
    }

    /// Largest rounding error over the root sum of squares of the strengths.
    pub(crate) fn rounding(&self) -> f64 {
        let epsilon = if self.double_precision {
            f64::EPSILON
        } else {
            f64::from(f32::EPSILON)
        };
        epsilon * (ROUNDING[0] + ROUNDING[1] * self.kernel.amplification.powi(2))
    }

    /// Bound on the error of a field at every pixel.
    pub(crate) fn error_bound(&self, size: &Size) -> f64 {
        2.0 * self.kernel.error * size.sum + self.rounding() * size.root
    }

    /// Rough time in nanoseconds on one core for transforms and spreading.
    fn cost(&self, [waves, fields]: [usize; 2]) -> f64 {
        let points = (self.lattice[0] * self.lattice[1]) as f64;
        let pairs = fields.div_ceil(2) as f64;
        let precision = if self.double_precision { 2.2 } else { 1.0 };
        let width = self.kernel.width as f64;
        let kernels = 40.0 * waves as f64 * width;
        let spreading = pairs * 2.0 * waves as f64 * width * width;
        kernels + precision * (0.4 * pairs * points * points.log2() + spreading)
    }
}

/// Smallest length of at least `n` of the form 8·2^a·3^b or five times that. It is even, as the lattice must be, and takes
/// half the time per pixel of lengths with 5³ or 7.
fn lattice_length(n: usize) -> usize {
    let mut m = n.div_ceil(8).max(1);
    loop {
        let mut rest = m >> m.trailing_zeros();
        while rest.is_multiple_of(3) {
            rest /= 3;
        }
        if rest == 1 || rest == 5 {
            return 8 * m;
        }
        m += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lattice_lengths_are_even_and_smooth() {
        let lengths = [1, 8, 9, 641, 650, 700, 3600].map(lattice_length);
        assert_eq!(lengths, [8, 8, 16, 648, 720, 720, 3840]);
    }
}
