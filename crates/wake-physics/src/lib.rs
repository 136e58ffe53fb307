//! wake-physics
pub mod constants;
pub mod dispersion;
mod error;
pub mod fft;
pub mod grey;
pub mod labels;
mod raster;
pub mod sar;
pub mod scene;
pub mod waves;

pub use error::{Error, Result};
pub use raster::{Field, Raster};
pub use scene::Scene;
