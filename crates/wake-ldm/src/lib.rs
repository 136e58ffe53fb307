#![doc = include_str!("../README.md")]
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod device;
mod error;
mod files;
mod options;

pub mod metrics;
pub mod nn;
pub mod noise;
pub mod unet;
pub mod weights;

mod stable_diffusion;
mod wake_model;

#[cfg(feature = "dataset")]
pub mod dataset;
#[cfg(feature = "train")]
pub mod evaluation;
#[cfg(feature = "train")]
pub mod train;
#[cfg(feature = "flex")]
mod self_check;

pub use burn;
pub use device::device_named;
pub use error::{Error, Mismatch, Misshapen, Result};
pub use files::{fingerprint, read_text};
#[cfg(feature = "flex")]
pub use self_check::self_check;
pub use stable_diffusion::{autoencoder, lora, pipeline, scheduler, text};
pub use wake_model::sampler::WakeSampler;
pub use wake_model::{conditioning, network, sampler, sea_texture};
