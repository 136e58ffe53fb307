#![doc = include_str!("../README.md")]
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod error;
mod files;
mod image;
pub mod normalize;
mod raster;
mod scaling;
mod wake;

pub mod network;
mod onnx;
pub mod self_check;

pub mod calibration;

mod extent;
mod maps;
mod missing;
mod search;

mod detector;

pub mod drawing;
pub mod radon;
pub mod score;

mod finder;

pub use burn;
pub use calibration::Calibration;
pub use detector::Detector;
pub use error::{Error, Result};
pub use files::{image_files, image_name, picture_name};
pub use finder::{Finder, Radon};
pub use image::GreyImage;
pub use onnx::onnx;
pub use raster::Raster;
pub use search::{LEAST_SCORE, Tile};
pub use wake::{Detection, Extent, Wake, angle_of, direction};
