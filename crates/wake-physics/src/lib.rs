//! wake-physics
pub mod constants;
pub mod dispersion;
mod error;
pub mod fft;
pub mod output;
pub mod permittivity;
mod raster;
pub mod scattering;
pub mod scene;
pub mod spectrum;
pub mod spreading;
pub mod waves;
pub mod wind_sea;

pub use error::{Error, Result};
pub use raster::{Field, Raster};
pub use scene::Scene;
