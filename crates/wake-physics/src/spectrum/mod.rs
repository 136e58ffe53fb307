//! Wavenumber spectra of the wind sea.
//!
//! ```text
//! ⟨ζ²⟩ = ∫S(k) dk = ∬Ψ(kx, ky) dkx dky      Ψ = S(k) D(k, φ)/k, ∫D dφ = 1      B(k) = k³ S(k)
//! ```
//!
//! One file per author's model.

pub mod elfouhaily;

pub use elfouhaily::Elfouhaily;
