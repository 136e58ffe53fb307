#![doc = include_str!("../README.md")]
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod device;
mod error;
mod options;

pub mod nn;
pub mod noise;

pub mod autoencoder;
pub mod text;
pub mod unet;

pub mod scheduler;
pub mod weights;

pub mod conditioning;
pub mod small;

pub mod pipeline;
pub mod sampler;

pub mod metrics;

#[cfg(feature = "train")]
pub mod dataset;
#[cfg(feature = "train")]
pub mod train;
#[cfg(feature = "flex")]
mod self_check;

pub use device::device_named;
pub use error::{Error, Mismatch, Misshapen, Result};
pub use sampler::WakeSampler;
#[cfg(feature = "flex")]
pub use self_check::self_check;
