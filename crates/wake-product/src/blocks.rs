//! Division of a large image into overlapping blocks, and blending weights.

use std::f64::consts::FRAC_PI_2;
use std::ops::Range;

/// Side of a block, and overlap of neighbours \[pixels\].
const BLOCK: usize = 1024;
const OVERLAP: usize = 128;

/// Blocks along one direction of an image.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Axis {
    length: usize,
}

/// Blending weights of a block at one of its lines or pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Weight {
    /// Weight of means; the weights of all blocks sum to 1.
    pub(crate) mean: f32,
    /// Weight of independent deviations from means; the squares of the weights sum to 1, which preserves the variance.
    pub(crate) deviation: f32,
}

impl Axis {
    pub(crate) fn new(length: usize) -> Self {
        Self { length }
    }

    /// Number of blocks.
    pub(crate) fn count(self) -> usize {
        self.length
            .saturating_sub(OVERLAP)
            .div_ceil(BLOCK - OVERLAP)
            .max(1)
    }

    /// Lines or pixels of a block.
    pub(crate) fn block(self, n: usize) -> Range<usize> {
        let start = n * (BLOCK - OVERLAP);
        start..(start + BLOCK).min(self.length)
    }

    /// Number of lines to which no block after the first `n` contributes.
    pub(crate) fn done(self, n: usize) -> usize {
        match n == self.count() {
            true => self.length,
            false => n * (BLOCK - OVERLAP),
        }
    }

    /// Weights of block `n` at each of its lines or pixels.
    pub(crate) fn weights(self, n: usize) -> Vec<Weight> {
        let block = self.block(n);
        let ramp = |k: usize| ((k as f64 + 0.5) / OVERLAP as f64).min(1.0);
        let of = |at: usize| {
            let from_start = at - block.start;
            let to_end = block.end - 1 - at;
            let rising = if n == 0 { 1.0 } else { ramp(from_start) };
            let falling = if n + 1 == self.count() {
                1.0
            } else {
                ramp(to_end)
            };
            let sine = |t: f64| (FRAC_PI_2 * t).sin();
            Weight {
                mean: (rising * falling) as f32,
                deviation: (sine(rising) * sine(falling)) as f32,
            }
        };
        block.clone().map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Weights of means and squared weights of deviations sum to 1 everywhere, for any length.
    #[test]
    fn weights_keep_means_and_variances() {
        for length in [1, 130, 1024, 1025, 1920, 1921, 5000] {
            let axis = Axis::new(length);
            let (mut means, mut squares) = (vec![0.0; length], vec![0.0; length]);
            for n in 0..axis.count() {
                let block = axis.block(n);
                assert!(
                    !block.is_empty() && block.end <= length,
                    "{length} {n} {block:?}"
                );
                for (at, weight) in block.zip(axis.weights(n)) {
                    means[at] += weight.mean;
                    squares[at] += weight.deviation.powi(2);
                }
            }
            let off = |sum: &f32| (sum - 1.0).abs() > 1e-5;
            assert!(
                !means.iter().any(off) && !squares.iter().any(off),
                "{length}"
            );
            assert_eq!(axis.done(axis.count()), length);
        }
    }
}
