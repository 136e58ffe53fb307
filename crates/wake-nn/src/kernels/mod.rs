//! Arithmetic on plain slices for burn's CPU backend, forward and backward: convolution, attention, linear layers,
//! normalisation and activations.
//!
//! Images are `[batch, channels, rows, columns]` in row-major order, as in a contiguous tensor.
//! All cores are used; every sum has a fixed order that does not depend on their number.

mod arch;
pub(super) mod attention;
mod columns;
pub(super) mod conv;
pub(super) mod group_norm;
pub(super) mod layer_norm;
pub(super) mod linear;
pub(super) mod pointwise;
mod product;
mod silu;
pub(super) mod squares;
mod sum;
mod tile;

use rayon::prelude::*;

/// A vector of zeros. All cores write blocks of 2 to 32 MiB; smaller ones are faster on one, and larger ones come from the system,
/// which zeroes them.
fn zeros(length: usize) -> Vec<f32> {
    const BLOCK: usize = 1024;
    if !(1 << 19..1 << 23).contains(&length) {
        return vec![0.0; length];
    }
    let blocks = (0..length.div_ceil(BLOCK)).into_par_iter().with_min_len(64);
    let blocks: Vec<[f32; BLOCK]> = blocks.map(|_| [0.0; BLOCK]).collect();
    let mut zeros = blocks.into_flattened();
    zeros.truncate(length);
    zeros
}

#[test]
fn zeros_are_as_many_as_asked_for() {
    for length in [
        0,
        1,
        (1 << 19) - 1,
        1 << 19,
        (1 << 19) + 1,
        (1 << 20) + 1000,
    ] {
        let zeros = zeros(length);
        assert_eq!(zeros.len(), length);
        assert!(zeros.iter().all(|&zero| zero.to_bits() == 0));
    }
}

/// Reproducible numbers between −½ and ½.
#[cfg(test)]
fn noise(count: usize, seed: u32) -> Vec<f32> {
    let mut state = seed;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 24) as f32 - 0.5
    };
    (0..count).map(|_| next()).collect()
}
