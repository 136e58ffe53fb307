//! From σ⁰ and motion to a SAR image: velocity bunching, resolution, speckle and the ship's echo.
//!
//! ```text
//! σ⁰, radial velocity, acceleration, elevation ─► Imaging ─► (+ points) ─► intensity ─► speckle ─► image
//! ```
//!
//! The radar looks toward +x (ground range) and flies toward +y (azimuth, row 0 at the largest y).
//! Intensity has the unit of σ⁰: every source pixel keeps all its power.

pub(crate) mod bunching;
pub mod coherence;
pub(crate) mod dense;
pub(crate) mod echo;
pub mod geometry;
pub mod halo;
pub mod impulse;
pub mod paired_echoes;
pub mod scatterers;
pub mod speckle;

mod imaging;
pub(crate) mod smooth;
mod taps;

pub use coherence::AzimuthResolution;
pub use imaging::{Imaging, Sources};
pub use impulse::ImpulseResponse;
