//! Radar backscatter of the sea: the cross-section σ⁰ of each pixel from its slope.
//!
//! ```text
//! σ⁰ = σ_Bragg(slope) · exp(m − ½ var m) · remaining + σ_specular(slope)
//! ```
//!
//! Waves are divided into three bands. Waves resolved by a pixel tilt its facet. Waves between the pixel and the radar's
//! split wavenumber `k_d` are averaged over, as Gaussian slopes. Waves shorter than `k_d` scatter (Bragg). Tilt enters only
//! through `σ_Bragg`; m is the hydrodynamic modulation alone.
//!
//! Values are linear, per unit area of the horizontal plane. The radar looks toward +x, so a slope ∂ζ/∂x > 0, which rises
//! away from the radar, faces it and is bright.

pub mod bragg;
pub mod breaking;
pub mod hydrodynamic;
pub mod modulation;
mod slope_lattice;
mod slope_means;
mod slopes;
mod specular;
mod facets;
mod table;
mod table_error;
mod two_scale;

mod backscatter;
mod bicubic;
pub(crate) mod cmod5n;

pub use backscatter::{Backscatter, FacetFields, Sensitivity};
pub use slopes::SlopeCovariance;
pub use specular::Specular;
pub use table::BackscatterTable;
pub use two_scale::TwoScale;

pub use crate::scene::Polarization;
