//! wake-physics
pub mod constants;
pub mod dispersion;
mod error;
pub mod fft;
mod memory;
pub mod output;
mod plan;
mod raster;
pub mod scene;
pub mod spectrum;
pub mod spreading;
mod random;
pub mod waves;
pub mod surface;
pub mod wind_sea;

pub use error::{Error, Result};
pub use raster::{Field, Raster};
pub use scene::Scene;
