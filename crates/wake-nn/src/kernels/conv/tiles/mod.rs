//! Convolutions with 3 × 3 kernels by tiles of 2 × 2 pixels, with four products per pixel instead of nine, and their
//! gradients with respect to the weights by the same transforms.
//!
//! ```text
//! y  = Aᵀ [ (G w Gᵀ) ⊙ (Bᵀ d B) ] A
//! dw = Gᵀ [ (A dy Aᵀ) ⊙ (Bᵀ d B) ] G
//!
//!      ⎡1  0 −1  0⎤       ⎡ 1   0   0⎤        ⎡1  1  1  0⎤
//! Bᵀ = ⎢0  1  1  0⎥   G = ⎢ ½   ½   ½⎥   Aᵀ = ⎣0  1 −1 −1⎦
//!      ⎢0 −1  1  0⎥       ⎢ ½  −½   ½⎥
//!      ⎣0  1  0 −1⎦       ⎣ 0   0   1⎦
//! ```
//!
//! - `d`: the 4 × 4 pixels that a tile reads; `w`: a kernel; `dy`: the gradient of a tile's pixels
//! - `⊙`: element by element, summed over the channels for `y` and over the tiles for `dw`: a matrix product for each of
//!   the sixteen places
//!
//! The gradient is the transpose of the convolution, as a linear map of the kernel.
//!
//! # References
//!
//! Winograd (1980), "Arithmetic Complexity of Computations"; Lavin & Gray (2016), "Fast Algorithms for Convolutional Neural
//! Networks", Eq. 5 to 8, F(2 × 2, 3 × 3).

use pulp::Simd;

use crate::kernels::arch::arch;

use super::geometry::Geometry;
use crate::kernels::tile;

mod forward;
mod weights;

pub(super) use forward::convolve;
pub(super) use weights::weight_gradient;

/// Places of a transformed tile.
const PLACES: usize = 16;

/// Kernels that are transformed side by side.
const LANES: usize = 16;

/// Largest count of numbers in the transformed kernels, which all tasks read: 20 MiB, a part of the last-level cache.
const FAR: usize = 5 * 1024 * 1024;

/// Below this many channels, the transforms cost more than they save.
const FEW: usize = 16;

/// Below this many channels, tiles do not pay for weight gradients, where both factors of every product are transformed.
const FEW_FOR_WEIGHTS: usize = 96;

/// Products that take as long as the transform of one kernel, memory access included, with tiles as wide as [`WIDE`];
/// fewer with narrower tiles, where products take longer.
const TRANSFORM: usize = 1500;

/// Tile width with AVX-512.
const WIDE: usize = 32;

/// Whether tiles need at most two thirds of the products, counting transforms of kernels and unfilled vectors, and the
/// kernels fit in the cache.
pub(super) fn win(geometry: &Geometry) -> bool {
    let width = arch().dispatch(tile::Width);
    let [channels_in, channels_out] = geometry.channels;
    let [rows, columns] = geometry.size_out();
    let windows = geometry.batch * rows.div_ceil(2) * columns.div_ceil(2);
    let tiles = PLACES * windows.next_multiple_of(width);
    let transform = TRANSFORM * width / WIDE;
    (geometry.kernel, geometry.stride) == (3, 1)
        && channels_in.min(channels_out) >= FEW
        && PLACES * channels_in * channels_out <= FAR
        && 3 * (tiles + transform) <= 2 * 9 * geometry.batch * rows * columns
}

/// As `win`, for gradients with respect to the weights.
pub(super) fn win_for_weights(geometry: &Geometry) -> bool {
    let [channels_in, channels_out] = geometry.channels;
    channels_in.min(channels_out) >= FEW_FOR_WEIGHTS && win(geometry)
}

/// Windows that tiles read: 4 × 4 pixels, two apart.
fn tiles_of(geometry: &Geometry) -> Geometry {
    let [rows, columns] = geometry.size_out();
    let [top, left, bottom, right] = geometry.border;
    Geometry {
        kernel: 4,
        stride: 2,
        border: [top, left, bottom + rows % 2, right + columns % 2],
        ..*geometry
    }
}

/// `Bᵀ` times four numbers.
#[inline(always)]
fn differences<S: Simd>(simd: S, [a, b, c, d]: [S::f32s; 4]) -> [S::f32s; 4] {
    [
        simd.sub_f32s(a, c),
        simd.add_f32s(b, c),
        simd.sub_f32s(c, b),
        simd.sub_f32s(b, d),
    ]
}
