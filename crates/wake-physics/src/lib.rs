//! wake-physics
pub mod constants;
pub mod dispersion;
mod error;
pub mod fft;
pub mod hull;
pub mod kelvin;
pub mod nufft;
pub mod quadrature;
mod raster;
pub mod scene;
pub mod track;
pub mod turbulent;
pub mod waves;

pub use error::{Error, Result};
pub use raster::{Field, Raster};
pub use scene::Scene;
pub use track::Track;
