//! wake-physics
pub mod constants;
pub mod dispersion;
mod error;
pub mod fft;
mod raster;
pub mod scene;
pub mod waves;

pub use error::{Error, Result};
pub use raster::{Field, Raster};
pub use scene::Scene;
