//! General numerical methods: roots and extrema, quadrature, interpolation, vectorised functions.

mod dual;
mod interpolation;
mod quadrature;
mod search;
pub(crate) mod vector;

pub(crate) use dual::Dual;
pub(crate) use interpolation::catmull_rom;
pub(crate) use quadrature::{GaussLegendre, gauss_hermite, largest_phase};
pub(crate) use search::{largest, root, smallest_at};
pub(crate) use vector::vectorized;
