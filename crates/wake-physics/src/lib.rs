//! wake-physics
pub mod constants;
pub mod dispersion;
mod error;
pub mod fft;
pub mod grey;
pub mod hull;
pub mod kelvin;
pub mod labels;
mod memory;
pub mod nufft;
pub mod output;
mod plan;
pub mod quadrature;
mod random;
mod raster;
pub mod sar;
pub mod scene;
pub mod spectrum;
pub mod spreading;
pub mod surface;
pub mod track;
pub mod waves;
pub mod wind_sea;

pub use error::{Error, Result};
pub use raster::{Field, Raster};
pub use scene::Scene;
pub use track::Track;
