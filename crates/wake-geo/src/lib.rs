#![doc = include_str!("../README.md")]
#![warn(clippy::print_stdout, clippy::print_stderr)]
#![cfg_attr(not(test), warn(unused_crate_dependencies))]

pub mod limits;

mod error;
mod read_at;
mod time;
mod xml;

// From pixels to places.
mod geodesic;
mod place;
mod projection;
mod geolocation;

// Files.
mod window;
mod geotiff;
mod picture;
mod safe;

// What callers use them for.
mod product;
mod land;
mod locate;

pub use error::{Error, Result};
pub use geodesic::{Track, destination, track};
pub use geolocation::{Affine, GridPoint};
pub use geotiff::{
    Compression, GeoTiff, GeoTiffLayout, Placement, SampleType, TiffSample, write_geotiff,
};
pub use land::{Land, LandMask};
pub use locate::{Located, locate};
pub use place::{PixelAxes, Place};
pub use product::{Product, Values};
pub use projection::Projection;
pub use safe::{Annotation, Pass, PixelCalibration, Polarization, Sentinel1, SwathLooks};
pub use time::UtcTime;
pub use window::Window;
