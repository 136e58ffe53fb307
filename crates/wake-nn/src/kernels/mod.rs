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
