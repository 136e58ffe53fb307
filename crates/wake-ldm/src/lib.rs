#![cfg_attr(
    all(feature = "flex", feature = "dataset"),
    doc = include_str!("../README.md")
)]
#![cfg_attr(
    not(all(feature = "flex", feature = "dataset")),
    doc = "Latent diffusion of ship-wake radar images on burn."
)]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod error;
mod options;
pub mod streams;
mod eigen;

pub mod unet;

mod stable_diffusion;

mod self_check;

#[cfg(feature = "wake-model")]
mod wake_model;

#[cfg(feature = "dataset")]
mod sampled;

pub use error::{Error, Result};
#[cfg(feature = "dataset")]
pub use sampled::Sampled;
pub use self_check::self_check;
pub use stable_diffusion::{autoencoder, lora, pipeline, scheduler, text};
#[cfg(feature = "wake-model")]
pub use wake_model::sampler::WakeSampler;
#[cfg(feature = "wake-model")]
pub use wake_model::{conditioning, network, sampler, sea_texture};
pub use wake_nn::{burn, device_named};
