#![cfg_attr(feature = "flex", doc = include_str!("../README.md"))]
#![cfg_attr(
    not(feature = "flex"),
    doc = "Layers of diffusion models and detectors on burn."
)]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod error;
pub mod noise;

#[cfg(feature = "burn")]
mod device;
#[cfg(feature = "flex")]
mod kernels;
#[cfg(feature = "flex")]
mod operation;
#[cfg(feature = "burn")]
mod numbers;

#[cfg(feature = "burn")]
pub mod activation;
#[cfg(feature = "burn")]
pub mod adamw;
#[cfg(feature = "burn")]
mod layer_norm;
#[cfg(feature = "burn")]
pub mod linear;
#[cfg(feature = "burn")]
pub mod attention;
#[cfg(feature = "burn")]
pub mod conv;
#[cfg(feature = "burn")]
pub mod feed_forward;
#[cfg(feature = "burn")]
pub mod norm;
#[cfg(feature = "burn")]
pub mod patch;
#[cfg(feature = "burn")]
mod projection;
#[cfg(feature = "burn")]
pub mod resample;
#[cfg(feature = "burn")]
pub mod resnet;
#[cfg(feature = "burn")]
pub mod timestep;
#[cfg(feature = "burn")]
pub mod transformer;

#[cfg(feature = "burn")]
pub mod weights;
#[cfg(feature = "burn")]
pub mod self_check;

#[cfg(feature = "burn")]
pub use burn;
#[cfg(feature = "burn")]
pub use device::{device_label, device_named, is_cpu, on_pool};
pub use error::{Error, Mismatch, Misshapen, Result, check_range};
#[cfg(feature = "burn")]
pub use numbers::{cast_to, check_finite, is_half};
