//! Slow references, strong baselines and helpers for tests and benches; simulations do not need them.
//!
//! | item | compares with |
//! | --- | --- |
//! | [`direct_quadrature`] | waves of a ship by the sum of plane waves |
//! | [`matrix_product`], [`synthesize`] | [`harmonic_sum`](crate::waves::harmonic_sum): the same sum as a matrix product, and by non-uniform FFTs |
//! | [`DirectImage`] | the fast image of moving pixels |
//! | [`cmod5n`] | σ⁰ of the open sea at C band by the empirical model CMOD5.N |
//! | [`seams`] | images assembled from squares |
//! | [`paper_grid`] | the scenes of the paper on which this project is based |
//!
//! Formulas of the field that no simulation uses: azimuth cutoff and coherence time of a moving sea, slant-range resolution
//! for a bandwidth, conversions between wavenumber and frequency spectra.

pub use crate::kelvin::quadrature::direct_quadrature;
pub use crate::measure::seams::seams;
pub use crate::nufft::synthesize;
pub use crate::sar::coherence::{azimuth_cutoff, coherence_time, cutoff_transfer};
pub use crate::sar::dense::DirectImage;
pub use crate::scattering::cmod5n::sigma0 as cmod5n;
pub use crate::scene::paper::paper_grid;
pub use crate::scene::sensor::slant_resolution;
pub use crate::spectrum::{kitaigorodskii_factor, to_frequency, to_wavenumber};
pub use crate::waves::matrix_product::matrix_product;
